"""The discrete Coulomb problem, in its reduced and its global form.

Reduced: u = W r + q. Global: M v = H r + f, u = Hᵀ v + w, hence W = Hᵀ M⁻¹ H and q = Hᵀ M⁻¹ f + w.
Both with the law of each contact, K_mu* ∋ u + mu |u_t| n ⟂ r ∈ K_mu, rows (n, t_1 … t_{d-1}) for d = 2 or 3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from bipot.basics.definite import asymmetry, by_diagonal, by_units, definite, semidefinite
from bipot.errors import ProgramError, require, require_count, require_magnitude
from bipot.typing import Floats, Ints, Sealed, as_numbers, max_abs

LARGEST = 1e60
"""Largest number of a problem, and inverse of the smallest that decides its units: squares of forces, which may be
the quotient of two, then neither overflow nor vanish."""

TIE = 1.0 + 1e-9
"""Ratio up to which two numbers count as equal."""


def _matrix(value: object, field: str) -> sparse.csr_array:
    given: Any = value if sparse.issparse(value) else as_numbers(value, field)
    numeric = given.ndim == 2 and given.dtype.kind in "fiu"
    require(numeric, field, f"of shape {given.shape} and type {given.dtype}", "a matrix of numbers")
    matrix = sparse.csr_array(given, dtype=np.float64, copy=True)
    matrix.sum_duplicates()
    matrix.data.flags.writeable = False
    require(bool(np.all(np.isfinite(matrix.data))), field, "a matrix with NaN or inf", "finite")
    require_magnitude(max_abs(matrix.data), f"largest entry of {field}", LARGEST)
    return matrix


def column_count(matrix: sparse.csr_array) -> int:
    """Number of columns, as an int for type checkers that do not know sparse shapes."""
    return int(np.array(matrix.shape)[1])


def _vector(value: ArrayLike, field: str, size: int) -> Floats:
    vector = as_numbers(value, field)
    require(vector.shape == (size,), f"{field}.shape", vector.shape, f"({size},)")
    require(bool(np.all(np.isfinite(vector))), field, "a vector with NaN or inf", "finite")
    vector.flags.writeable = False
    return vector


def _load(value: ArrayLike, field: str, size: int) -> Floats:
    vector = _vector(value, field, size)
    require_magnitude(max_abs(vector), f"largest number of {field}", LARGEST)
    return vector


def _friction(value: ArrayLike, contacts: int) -> Floats:
    given = as_numbers(value, "mu")
    single = given.shape in ((), (1,))
    vector = _vector(np.full(contacts, float(given.flat[0])) if single else given, "mu", contacts)
    require(bool(np.all(vector >= 0)), "mu", float(vector.min(initial=0.0)), ">= 0")
    require(max_abs(vector) <= LARGEST, "mu", max_abs(vector), f"<= {LARGEST:g}")
    return vector


def require_problem(problem: object) -> None:
    """Raise SceneError unless ``problem`` is one of either form."""
    either = isinstance(problem, CoulombProblem | GlobalCoulombProblem)
    require(either, "problem", problem, "a CoulombProblem or a GlobalCoulombProblem")


def _require_contacts(rows: int, dim: int) -> None:
    require_count(dim, "dim")
    require(dim in (2, 3), "dim", dim, "2 or 3")
    require(rows > 0 and rows % dim == 0, "contact rows", rows, f"a positive multiple of dim = {dim}")


class Affine(Sealed):
    """u = W r + q with d = ``dim`` rows a contact: what a problem and its scaled form share."""

    W: Any
    q: Floats
    dim: int

    @property
    def size(self) -> int:
        """Number of contact rows, d c."""
        return self.q.size

    def velocity(self, r: Floats) -> Floats:
        """u = W r + q, (dc,)."""
        return self.W @ r + self.q

    def by_contact(self, vector: Floats) -> Floats:
        """The rows of each contact, (dc,) -> (c, d)."""
        return vector.reshape(-1, self.dim)

    def symmetric_part(self) -> sparse.csr_array:
        """(W + Wᵀ)/2, what a convex subproblem can hold."""
        W = sparse.csr_array(self.W)
        return sparse.csr_array((W + W.T) * 0.5)

    def antisymmetric_part(self) -> sparse.csr_array:
        """(W - Wᵀ)/2, what a convex subproblem must carry as a load."""
        W = sparse.csr_array(self.W)
        return sparse.csr_array((W - W.T) * 0.5)


@dataclass(frozen=True, eq=False, repr=False)
class CoulombProblem(Affine):
    """u = W r + q with Coulomb's law at every contact; W (dc, dc), q (dc,), mu (c,) or a number, dim = d.

    W may be dense or sparse, unsymmetric and rank deficient. Raises SceneError for shapes that do not fit,
    NaN, masked numbers, mu < 0 or mu = inf, dim other than 2 and 3.

    >>> problem = CoulombProblem(W=np.eye(2), q=[-1.0, 0.5], mu=0.3, dim=2)
    >>> problem.contacts, problem.velocity(np.array([1.0, -0.3])).tolist()
    (1, [0.0, 0.2])
    """

    W: sparse.csr_array
    q: Floats
    mu: Floats
    dim: int

    def __post_init__(self) -> None:
        matrix = _matrix(self.W, "W")
        rows = matrix.indptr.size - 1
        _require_contacts(rows, self.dim)
        require(matrix.shape == (rows, rows), "W.shape", matrix.shape, "square")
        object.__setattr__(self, "W", matrix)
        object.__setattr__(self, "q", _load(self.q, "q", rows))
        object.__setattr__(self, "mu", _friction(self.mu, rows // self.dim))
        weakest = int(self.contact_unit.argmin())
        require_magnitude(float(self.contact_unit[weakest] ** 2), f"mean diagonal of W at contact {weakest}", LARGEST)

    def __repr__(self) -> str:
        """One line, without the arrays."""
        return f"CoulombProblem({self.contacts} contacts, dim={self.dim})"

    @property
    def contacts(self) -> int:
        """Number of contacts, c."""
        return self.q.size // self.dim

    @property
    def asymmetry(self) -> float:
        """Max |W' - W'ᵀ| / max |W'|, W' by the units of contacts; 0 for W = 0."""
        return asymmetry(self._by_units)

    @property
    def semidefinite(self) -> bool:
        """Whether the symmetric part of W is positive semidefinite, to single precision and by the units of contacts.

        It costs a factorisation.
        """
        return semidefinite(self._by_units)

    @cached_property
    def _by_units(self) -> sparse.csr_array:
        return by_units(self.W, np.repeat(self.contact_unit, self.dim))

    @property
    def force_scale(self) -> float:
        """Step rho = d c / trace W of the unit-free residual, force per displacement; 1 when trace W <= 0."""
        trace = float(self.W.diagonal().sum())
        return self.size / trace if trace > 0 else 1.0

    @cached_property
    def contact_unit(self) -> Floats:
        """√w of each contact, (c,), w the mean diagonal of its block of W, length per force; where this is not
        positive, the mean of the positive ones.

        If W is symmetric and positive semidefinite, no entry between contacts a and b is above d √(w_a w_b). Where one
        is in another W, w_a and w_b are at least this entry over d. Where w is still zero it is 1.
        """
        flexibility = self.by_contact(np.asarray(self.W.diagonal(), dtype=np.float64)).mean(axis=1)
        positive = flexibility > 0
        w = np.where(positive, flexibility, flexibility[positive].mean() if positive.any() else 0.0)
        entries = sparse.coo_array(abs(self.W))
        (a, b), size = (rows // self.dim for rows in entries.coords), entries.data / self.dim
        beyond = size > TIE * np.sqrt(w[a] * w[b])
        out = w.copy()
        for contact in (a[beyond], b[beyond]):
            np.maximum.at(out, contact, size[beyond])
        return np.sqrt(np.where(out > 0, out, 1.0))

    @cached_property
    def groups(self) -> Ints:
        """Number of the group that each contact belongs to, (c,): W couples no two groups."""
        # Loaded here, because only judging a problem needs it, not importing the library.
        from scipy.sparse import csgraph

        entries = sparse.coo_array(self.W)
        pairs = entries.coords[0] // self.dim, entries.coords[1] // self.dim
        touching = sparse.coo_array((entries.data != 0, pairs), shape=(self.contacts, self.contacts))
        return np.asarray(csgraph.connected_components(touching, directed=False)[1], dtype=np.intp)

    @cached_property
    def magnitudes(self) -> sparse.csr_array:
        """|W|, entry by entry."""
        return sparse.csr_array(abs(self.W))


@dataclass(frozen=True, eq=False)
class GlobalCoulombProblem(Sealed):
    """M v = H r + f, u = Hᵀ v + w with Coulomb's law; M (m, m), H (m, dc), f (m,), w (dc,), mu (c,).

    >>> unit = np.eye(2)
    >>> bodies = GlobalCoulombProblem(M=2 * unit, H=unit, f=[-2.0, 1.0], w=[0.0, 0.0], mu=0.3, dim=2)
    >>> bodies.reduced().q.tolist()
    [-1.0, 0.5]
    """

    M: sparse.csr_array
    H: sparse.csr_array
    f: Floats
    w: Floats
    mu: Floats
    dim: int

    def __post_init__(self) -> None:
        mass, rows = _matrix(self.M, "M"), _matrix(self.H, "H")
        dofs, contact_rows = rows.indptr.size - 1, column_count(rows)
        _require_contacts(contact_rows, self.dim)
        require(mass.shape == (dofs, dofs), "M.shape", mass.shape, f"({dofs}, {dofs}), the rows of H")
        object.__setattr__(self, "M", mass)
        object.__setattr__(self, "H", rows)
        object.__setattr__(self, "f", _load(self.f, "f", dofs))
        object.__setattr__(self, "w", _load(self.w, "w", contact_rows))
        object.__setattr__(self, "mu", _friction(self.mu, contact_rows // self.dim))

    @property
    def asymmetry(self) -> float:
        """Max |M' - M'ᵀ| / max |M'|, M' by the roots of its diagonal; 0 for M = 0."""
        return asymmetry(by_diagonal(self.M))

    @property
    def semidefinite(self) -> bool:
        """Whether the symmetric part of M is positive definite: W is semidefinite then. It costs a factorisation."""
        return definite(sparse.csc_matrix(by_diagonal(self.M)))

    def reduced(self) -> CoulombProblem:
        """Eliminate v: W = Hᵀ M⁻¹ H, q = Hᵀ M⁻¹ f + w, by one sparse factorisation of M.

        Raises:
            ProgramError: M is singular.
        """
        solve = self._factorised().solve
        W = self.H.T @ solve(self.H.toarray())
        return CoulombProblem(W=sparse.csr_array(W), q=self.H.T @ solve(self.f) + self.w, mu=self.mu, dim=self.dim)

    def state(self, r: Floats) -> Floats:
        """v = M⁻¹ (H r + f), (m,)."""
        return self._factorised().solve(self.H @ _vector(r, "r", self.w.size) + self.f)

    def _factorised(self) -> sparse_linalg.SuperLU:
        try:
            return sparse_linalg.splu(sparse.csc_matrix(self.M))
        except RuntimeError as error:
            raise ProgramError(f"M of the global problem cannot be factorised: {error}") from error
