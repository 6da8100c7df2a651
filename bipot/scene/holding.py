r"""The displacements that all supports together hold or prescribe, node by node.

Where supports hold a node along independent unit vectors n_i, its displacement, up to the free part across them all, is

    u = sum_i v_i w_i,    n_i . w_j = delta_ij,    w_j in their span,

and further supports must agree with it. The axes of a node (:mod:`bipot.fem.axes`) are those of the coordinates where
these span the n_i; elsewhere they are a basis of the span that begins with n_1, and its complement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space

from bipot.errors import require
from bipot.fem.axes import Axes
from bipot.meshes.mesh import Mesh
from bipot.scene.supports import Prescribed, Support, Symmetry, named
from bipot.tensors import norm
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints, max_abs, read_only

PARALLEL = 1e-9
"""Sine of the angle up to which two directions count as one."""

LEAST_SINE = 1e-3
"""Least sine of the angle between two directions of which one is driven: a node moves a thousand times as far there."""

AGREES = 1e-12
"""Difference of two displacements, over the largest, that counts as round-off."""


class Directions(NamedTuple):
    """Unit vectors along which a body as a whole is kept in its place.

    ``planes`` (p, d) are normals of planes in which it stays: those of symmetry, and a ring moves along its axis;
    ``held`` (h, d) are these and those of supports, and ``free`` (d, f) is an orthonormal basis of what they leave.
    """

    planes: Floats
    held: Floats
    free: Floats

    @staticmethod
    def of(supports: Sequence[Support], dimension: int, ring: bool) -> Directions:
        """Of the supports of a body."""
        around = [np.eye(dimension)[0]] * ring
        kept = [s.along(dimension) for s in supports if isinstance(s, Symmetry)]
        planes = np.array([*kept, *around]).reshape(-1, dimension)
        held = np.array([*(s.along(dimension) for s in supports), *around]).reshape(-1, dimension)
        return Directions(planes, held, null_space(np.vstack([np.zeros(dimension), held]), rcond=PARALLEL))


@dataclass(frozen=True)
class Driven:
    """The support that moves its ``nodes`` (m,) by its displacement times ``ways`` (m, d)."""

    support: Prescribed
    nodes: Ints
    ways: Floats


@dataclass(frozen=True)
class Holding:
    """The ``axes`` of the nodes, which components along them (a, d) are ``held``, and which of these are ``driven``."""

    axes: Axes
    held: Bools
    driven: tuple[Driven, ...]

    @staticmethod
    def of(supports: Sequence[Support], mesh: Mesh) -> Holding:
        """Of the supports of a mesh.

        Raises:
            SceneError: an unknown boundary; supports that prescribe two displacements of one node along one direction,
                or along three; that drive one along directions that are almost one. It names the node.
        """
        member = np.zeros((len(mesh.nodes), len(supports)), dtype=bool)
        for k, support in enumerate(supports):
            member[mesh.boundary_nodes(support.boundary), k] = True
        d = mesh.dimension
        ways, held = np.zeros((*member.shape, d)), np.zeros(mesh.nodes.shape, dtype=bool)
        rows = np.tile(np.eye(d), (len(mesh.nodes), 1, 1))
        # Few sets of supports hold all of the nodes.
        kinds, kind = np.unique(member, axis=0, return_inverse=True)
        for k in np.flatnonzero(kinds.any(axis=1)).tolist():
            alike, own = np.flatnonzero(kind.ravel() == k), np.flatnonzero(kinds[k])
            joint = _joint(supports, own, int(alike[0]), d)
            ways[np.ix_(alike, own)], rows[alike], held[alike] = joint.ways, joint.axes, joint.held
        turned = np.flatnonzero((rows != np.eye(d)).any(axis=(1, 2)))
        moving = [(k, support) for k, support in enumerate(supports) if isinstance(support, Prescribed)]
        driven = [Driven(support, np.flatnonzero(member[:, k]), ways[member[:, k], k]) for k, support in moving]
        return Holding(Axes(turned, rows[turned]), read_only(held, np.bool_), tuple(driven))

    @property
    def numbers(self) -> Ints:
        """Numbers (h,) of the components that are held, node by node."""
        return np.flatnonzero(self.held)

    def free_along(self, nodes: Ints, vectors: Floats) -> Bools:
        """Whether the supports let nodes (p,) move along unit vectors (p, d), in part at least."""
        parts = np.abs(self.axes.at(nodes, vectors))
        return np.asarray((~self.held[nodes] & (parts > ACROSS)).any(axis=1))

    def at(self, tau: float) -> Floats:
        """The prescribed displacement (a, d) since rest at pseudo-time ``tau``; zero where none is prescribed."""
        out = np.zeros(self.held.shape)
        for driven in self.driven:
            out[driven.nodes] += driven.support.at(tau) * driven.ways
        return out

    @property
    def shifted(self) -> Bools:
        """Which of the components along the axes (a, d) are prescribed other than zero."""
        out = np.zeros(self.held.shape, dtype=bool)
        for driven in self.driven:
            if driven.support.displacement != 0:
                out[driven.nodes] |= self.axes.at(driven.nodes, driven.ways) != 0
        return out


class _Joint(NamedTuple):
    """Effect of supports (s,) on a node: its ``axes`` (d, d), which components along them are ``held`` (d,), and the
    ``ways`` (s, d) by which their displacements move it.
    """

    ways: Floats
    axes: Floats
    held: Bools


def _joint(supports: Sequence[Support], own: Ints, node: int, dimension: int) -> _Joint:
    """Of those of the supports that are the node's ``own``."""
    given = [supports[k] for k in own.tolist()]
    vectors = np.array([support.along(dimension) for support in given])
    moving = any(isinstance(support, Prescribed) and support.displacement for support in given)
    chosen, sine = _independent(vectors)
    apart = f"such that directions that hold node {node}, one of them driven, are one or at an angle"
    require(
        not moving or sine >= LEAST_SINE, "scene.supports", supports, f"{apart} above {LEAST_SINE:g}, not {sine:.2g}"
    )
    whole, triangle = np.linalg.qr(vectors[chosen].T, mode="complete")
    count, ways = len(chosen), np.zeros(vectors.shape)
    if moving:
        # n = Q R, hence w = Q R'^-1
        ways[chosen] = np.linalg.solve(triangle[:count], whole[:, :count].T)
    _require_agreeing(supports, given, ways, node)
    span = whole[:, :count] @ whole[:, :count].T
    held = np.diag(span) > 0.5
    if np.abs(span - np.diag(held)).max() <= ACROSS:
        return _Joint(ways, np.eye(dimension), held)
    axes = whole.T
    # the first is n_1, not its opposite
    axes[:count] *= np.sign(np.diag(triangle))[:, None]
    return _Joint(ways, axes, np.arange(dimension) < count)


def _independent(vectors: Floats) -> tuple[list[int], float]:
    """Which of unit vectors (s, d) span them all, and the least sine of the angle of one with those before it.

    The first, then always the one farthest off the span of those chosen, while it is off by more than :data:`PARALLEL`.
    """
    chosen, least, rest = [0], 1.0, vectors - np.outer(vectors @ vectors[0], vectors[0])
    while len(chosen) < vectors.shape[1] and norm(rest).max() > PARALLEL:
        chosen.append(int(np.argmax(norm(rest))))
        sine = float(norm(rest)[chosen[-1]])
        way, least = rest[chosen[-1]] / sine, min(least, sine)
        rest = rest - np.outer(rest @ way, way)
    return chosen, least


def _require_agreeing(supports: Sequence[Support], given: Sequence[Support], ways: Floats, node: int) -> None:
    """Refuse displacements ``given`` at a node that do not agree with its displacement by the ``ways``."""
    moving = [support for support in given if isinstance(support, Prescribed)]
    for tau in sorted({tau for support in moving for tau, _ in support.amplitude.points}):
        values = np.array([support.at(tau) for support in given])
        moved = values @ ways
        for support, value in zip(given, values.tolist(), strict=True):
            vector = support.along(ways.shape[1])
            once = f"such that node {node} has one displacement along {named(vector)}"
            off = abs(float(np.dot(vector, moved)) - value)
            require(off <= AGREES * max_abs(values), "scene.supports", supports, once)
