r"""The displacements that all supports together hold or prescribe, node by node.

Where supports give a node the displacements v_i along independent unit vectors n_i, its displacement, up to the free
part across all n_i, is

    u = sum_i v_i w_i,    n_i . w_j = delta_ij,    w_j in the span of all n_i,

and further supports must agree with it. The axes of a node (:mod:`bipot.fem.axes`) are the coordinate axes if some of
these span the n_i; otherwise they are a basis of the span that begins with n_1, and one of its complement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space, qr

from bipot.errors import require
from bipot.fem.axes import Axes
from bipot.meshes.mesh import Mesh
from bipot.scene.supports import Prescribed, Support, Symmetry, named
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints, max_abs, read_only

PARALLEL = 1e-9
"""Sine of the angle up to which two directions count as the same."""

LEAST_SINE = 1e-3
"""Least sine of the angle between two directions, one of them driven, at which a node moves a thousand times as far."""

AGREES = 1e-12
"""Difference of two displacements, over the largest, that counts as round-off."""


class Directions(NamedTuple):
    """Unit vectors along which a body as a whole is kept in its place.

    ``planes`` (p, d) are normals of planes in which it stays: planes of symmetry, and for a ring one along its axis.
    ``held`` (h, d) are these and the directions of supports, ``free`` (d, f) is an orthonormal basis of the others.
    """

    planes: Floats
    held: Floats
    free: Floats

    @staticmethod
    def of(supports: Sequence[Support], dimension: int, ring: bool) -> Directions:
        """The directions of a body with these ``supports``, which is a ``ring`` or not."""
        around = [np.eye(dimension)[0]] * ring
        kept = [s.along(dimension) for s in supports if isinstance(s, Symmetry)]
        planes = np.array([*kept, *around]).reshape(-1, dimension)
        held = np.array([*(s.along(dimension) for s in supports), *around]).reshape(-1, dimension)
        return Directions(planes, held, null_space(np.vstack([np.zeros(dimension), held]), rcond=PARALLEL))


@dataclass(frozen=True)
class Driven:
    """A ``support`` that moves its ``nodes`` (m,), by its displacement times ``ways`` (m, d)."""

    support: Prescribed
    nodes: Ints
    ways: Floats


@dataclass(frozen=True)
class Holding:
    """The ``axes`` of the nodes, components (a, d) along them that are ``held``, and supports that are ``driven``."""

    axes: Axes
    held: Bools
    driven: tuple[Driven, ...]

    @staticmethod
    def of(supports: Sequence[Support], mesh: Mesh) -> Holding:
        """The holding of a ``mesh`` by these ``supports``.

        Raises:
            SceneError: an unknown boundary; supports that contradict each other at a node, or drive it along directions
                that are almost the same. It names the node.
        """
        member = np.zeros((len(mesh.nodes), len(supports)), dtype=bool)
        for k, support in enumerate(supports):
            member[mesh.boundary_nodes(support.boundary), k] = True
        d = mesh.dimension
        ways, held = np.zeros((*member.shape, d)), np.zeros(mesh.nodes.shape, dtype=bool)
        rows = np.tile(np.eye(d), (len(mesh.nodes), 1, 1))
        # All nodes with the same set of supports are alike, and there are few such sets.
        sets, number = np.unique(member, axis=0, return_inverse=True)
        for k in np.flatnonzero(sets.any(axis=1)).tolist():
            alike, chosen = np.flatnonzero(number.ravel() == k), np.flatnonzero(sets[k])
            ways[np.ix_(alike, chosen)], rows[alike], held[alike] = _joint(supports, chosen, int(alike[0]), d)
        turned = np.flatnonzero((rows != np.eye(d)).any(axis=(1, 2)))
        moving = [(k, support) for k, support in enumerate(supports) if isinstance(support, Prescribed)]
        driven = [Driven(support, np.flatnonzero(member[:, k]), ways[member[:, k], k]) for k, support in moving]
        return Holding(Axes(turned, rows[turned]), read_only(held, np.bool_), tuple(driven))

    @property
    def numbers(self) -> Ints:
        """Numbers (h,) of the components that are held, node by node."""
        return np.flatnonzero(self.held)

    def free_along(self, nodes: Ints, vectors: Floats) -> Bools:
        """Whether the supports let nodes (p,) move with a component along unit vectors (p, d)."""
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
        """Which components along the axes (a, d) are prescribed to be other than zero."""
        out = np.zeros(self.held.shape, dtype=bool)
        for driven in self.driven:
            if driven.support.displacement != 0:
                out[driven.nodes] |= self.axes.at(driven.nodes, driven.ways) != 0
        return out


def _joint(supports: Sequence[Support], chosen: Ints, node: int, dimension: int) -> tuple[Floats, Floats, Bools]:
    """The joint effect of the supports with the numbers ``chosen`` (s,) on the ``node``.

    It is the ``ways`` (s, d) by which the supports' displacements move the node, its axes (d, d), and the components
    along these that are held (d,).
    """
    given = [supports[k] for k in chosen.tolist()]
    vectors = np.array([support.along(dimension) for support in given])
    moving = any(isinstance(support, Prescribed) and support.displacement for support in given)
    independent, sine = _independent(vectors)
    apart = f"such that directions that hold node {node}, one of them driven, are one or at an angle"
    allowed = f"{apart} above {LEAST_SINE:g}, not {sine:.2g}"
    require(not moving or sine >= LEAST_SINE, "scene.supports", supports, allowed)
    whole, triangle = np.linalg.qr(vectors[independent].T, mode="complete")
    count, ways = len(independent), np.zeros(vectors.shape)
    if moving:
        # n = Q R, hence w = Q R'^-1
        ways[independent] = np.linalg.solve(triangle[:count], whole[:, :count].T)
    _require_agreeing(supports, given, ways, node)
    span = whole[:, :count] @ whole[:, :count].T
    held = np.diag(span) > 0.5
    if np.abs(span - np.diag(held)).max() <= ACROSS:
        return ways, np.eye(dimension), held
    axes = whole.T
    # QR may return the opposite of n_1.
    axes[:count] *= np.sign(np.diag(triangle))[:, None]
    return ways, axes, np.arange(dimension) < count


def _independent(vectors: Floats) -> tuple[list[int], float]:
    """Which of the unit ``vectors`` (s, d) span them all, and the least sine of the angle of one to those before it.

    They are the first, and then always the vector farthest off the span of those chosen, while it is off by more than
    :data:`PARALLEL`.
    """
    rest = vectors - np.outer(vectors @ vectors[0], vectors[0])
    triangle, order = qr(rest.T, mode="r", pivoting=True)
    sines = np.abs(np.diagonal(triangle))
    sines = sines[sines > PARALLEL]
    return [0, *order[: len(sines)].tolist()], float(sines.min(initial=1.0))


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
