"""Symmetric tensors as Mandel vectors: the double contraction is the dot product, norms are Euclidean.

The last axis s is 4 in two dimensions, order (11, 22, 33, √2·12) with 33 the hoop or out-of-plane component,
and 6 in three, order (11, 22, 33, √2·12, √2·23, √2·31).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from bipot.typing import Floats, Vector, read_only


def components(dimension: int) -> int:
    """Number s of components of a Mandel vector in so many dimensions.

    >>> components(2), components(3)
    (4, 6)
    """
    return 4 if dimension == 2 else 6


@cache
def identity(size: int) -> Floats:
    """Unit tensor as a Mandel vector, shape (s,), read-only.

    >>> identity(4).tolist()
    [1.0, 1.0, 1.0, 0.0]
    """
    return read_only(np.arange(size) < 3, np.float64)


@cache
def deviatoric_projector(size: int) -> Floats:
    """Projector on trace-free tensors, I - 1 ⊗ 1 / 3, shape (s, s), read-only."""
    return read_only(np.eye(size) - np.outer(identity(size), identity(size)) / 3.0, np.float64)


@cache
def deviatoric_basis(size: int) -> Floats:
    """Orthonormal rows Q spanning the trace-free tensors, (s-1, s), read-only: ξ = Q t and dev t = Qᵀ ξ.

    >>> Q = deviatoric_basis(4)
    >>> bool(np.allclose(Q.T @ Q, deviatoric_projector(4)))
    True
    """
    basis = np.zeros((size - 1, size))
    basis[0, :3] = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    basis[1, :3] = np.array([1.0, 1.0, -2.0]) / np.sqrt(6.0)
    basis[2:, 3:] = np.eye(size - 3)
    return read_only(basis, np.float64)


def contract(t: Floats, table: Floats) -> Floats:
    """t table, (…, s) and (s, m) -> (…, m), as one product of matrices, where ``@`` makes one per leading index."""
    return (t.reshape(-1, t.shape[-1]) @ table).reshape(*t.shape[:-1], table.shape[1])


def trace(t: Floats) -> Floats:
    """Trace t_kk of Mandel vectors, (…, s) -> (…)."""
    return t[..., 0] + t[..., 1] + t[..., 2]


def deviator(t: Floats) -> Floats:
    """Deviator t - (t_kk / 3) 1 of Mandel vectors, (…, s) -> (…, s)."""
    return contract(t, deviatoric_projector(t.shape[-1]))


def norm(t: Floats) -> Floats:
    """Euclidean norm over the last axis, (…, s) -> (…)."""
    return np.sqrt(np.vecdot(t, t))


def unit(t: Floats, otherwise: Floats | Vector | float = 0.0) -> Floats:
    """t/|t|, ``otherwise`` where t = 0, (…, d) -> (…, d)."""
    length = norm(t)[..., None]
    return np.divide(t, length, out=np.full(t.shape, otherwise), where=length > 0)


def equivalent_stress(sigma: Floats) -> Floats:
    """Von Mises stress √(3/2) |dev σ|, the first term of (7), (…, s) -> (…).

    >>> round(float(equivalent_stress(np.array([100.0, 0.0, 0.0, 0.0]))), 12)
    100.0
    """
    return np.sqrt(1.5) * norm(deviator(sigma))


def equivalent_strain(e: Floats) -> Floats:
    """Equivalent strain √(2/3) |e| of trace-free e (8), (…, s) -> (…).

    >>> round(float(equivalent_strain(np.array([0.2, -0.1, -0.1, 0.0]))), 12)
    0.2
    """
    return np.sqrt(2.0 / 3.0) * norm(e)
