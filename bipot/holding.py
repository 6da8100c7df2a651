r"""What all supports together hold of the nodes, and where those go that are driven.

Where one support holds a node along a unit vector n_1, the displacement is v_1 n_1 and what the node does across it.
Where two do, along different ones, both components are held,

    u = v_1 w_1 + v_2 w_2,    n_i . w_j = delta_ij,

and more have to agree with that. The axes of a node (:mod:`bipot.fem.axes`) are its n_1 and what is across it where
one support holds it along a direction between the coordinates' axes, and these everywhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.errors import require
from bipot.fem.axes import Axes
from bipot.mesh import Mesh
from bipot.supports import Prescribed, Support, named
from bipot.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints, read_only

PARALLEL = 1e-9
"""Sine of the angle up to which two directions are one."""

LEAST_SINE = 1e-3
"""Of the angle between two of which one is driven: the node goes a thousand times as far across them."""

AGREES = 1e-12
"""Of the largest displacement: by how much two may differ that are one but for round-off."""


@dataclass(frozen=True)
class Driven:
    """The support that moves its ``nodes`` (m,) by its displacement times ``ways`` (m, d)."""

    support: Prescribed
    nodes: Ints
    ways: Floats


@dataclass(frozen=True)
class Holding:
    """``axes`` of the nodes, which of the components along them (a, d) are ``held``, and what is ``driven`` of them."""

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
            joint = (_joint if d == 2 else _on_axes)(supports, own, int(alike[0]))
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
        """What is prescribed of the displacement (a, d) since rest, at pseudo-time ``tau``; zero elsewhere."""
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
    """What supports (s,) make of a node: its ``axes`` (d, d), which components along them are ``held`` (d,), and by
    which ``ways`` (s, d) their displacements take it.
    """

    ways: Floats
    axes: Floats
    held: Bools


def _joint(supports: Sequence[Support], own: Ints, node: int) -> _Joint:
    """Of those of the supports that are the node's ``own``."""
    given = [supports[k] for k in own.tolist()]
    vectors, ways = np.array([support.vector for support in given]), np.zeros((len(given), 2))
    (x, y), both = vectors[0], np.array([True, True])
    sine = x * vectors[:, 1] - y * vectors[:, 0]
    other = int(np.argmax(np.abs(sine)))
    if abs(sine[other]) > PARALLEL:
        moving = any(isinstance(support, Prescribed) and support.displacement for support in given)
        apart = f"such that directions that hold node {node}, one of them driven, are one or at an angle"
        clear = not moving or abs(sine[other]) >= LEAST_SINE
        require(clear, "scene.supports", supports, f"{apart} above {LEAST_SINE:g}, not {abs(sine[other]):.2g}")
        u, v = vectors[other]
        ways[0], ways[other] = np.array([v, -u]) / sine[other], np.array([-y, x]) / sine[other]
        joint = _Joint(ways, np.eye(2), both)
    else:
        ways[0] = x, y
        on_axis = x == 0 or y == 0
        axes = np.eye(2) if on_axis else np.array([[x, y], [-y, x]])
        joint = _Joint(ways, axes, np.array([x, y]) != 0 if on_axis else both & (True, False))
    _require_agreeing(supports, given, joint.ways, node)
    return joint


def _on_axes(supports: Sequence[Support], own: Ints, node: int) -> _Joint:
    """The same in space, where supports hold along axes alone."""
    given = [supports[k] for k in own.tolist()]
    vectors = np.array([support.along(3) for support in given])
    # The first along an axis takes the node there; others have to agree.
    axis = np.argmax(vectors, axis=1)
    first = np.argmax(axis[:, None] == axis, axis=1) == np.arange(len(given))
    joint = _Joint(np.where(first[:, None], vectors, 0.0), np.eye(3), np.asarray(vectors.any(axis=0)))
    _require_agreeing(supports, given, joint.ways, node)
    return joint


def _require_agreeing(supports: Sequence[Support], given: Sequence[Support], ways: Floats, node: int) -> None:
    """Refuse those ``given`` at a node that do not all find the displacement along them where the ``ways`` take it."""
    moving = [support for support in given if isinstance(support, Prescribed)]
    for tau in sorted({tau for support in moving for tau, _ in support.amplitude.points}):
        values = np.array([s.at(tau) if isinstance(s, Prescribed) else 0.0 for s in given])
        moved = values @ ways
        for support, value in zip(given, values.tolist(), strict=True):
            vector = support.along(ways.shape[1])
            once = f"such that node {node} has one displacement along {named(vector)}"
            off = abs(float(np.dot(vector, moved)) - value)
            require(off <= AGREES * float(np.abs(values).max()), "scene.supports", supports, once)
