"""The candidates of an accepted increment in a plane, in plain arrays, for the fuzz study's recomputation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from studies.independent.element import Bools, Floats, Ints
from studies.independent.sampling import Parts

CARRIES = 1e-8
"""A push below this part of the increment's largest contact force is none."""


@dataclass(frozen=True)
class Curved:
    """What nodes have beside the tangent plane at the end of tools that are not flat, zero or one of flat tools.

    Of the w nodes that candidates are means of: ``normal`` (w, 2) at the start; ``stretch`` (w,) at start and end, by
    which the arc of a tool is longer than the way of the node; what gap and slip grow by beyond the way along normal
    and tangent, ``opened`` and ``slid`` (w,), and the lengths (w,) of places that these are differences of,
    ``blurred``; ``past`` (w,) says which end past an open end of the tool, ``places`` (w,) is the size of its numbers.
    ``apart`` (c,) says which candidates start in the air, ``left`` (c,) the gaps with which they begin to slip.
    """

    normal: Floats
    stretch: tuple[Floats, Floats]
    opened: Floats
    slid: Floats
    blurred: Floats
    apart: Bools
    left: Floats
    past: Bools
    places: Floats


@dataclass(frozen=True)
class Contacts:
    """Candidates in an increment, each the mean of nodes by its ``weights`` (c, a), at ``node`` (c,).

    ``rubs`` (c,) says if it has friction, with the coefficient ``mu`` (c,), ``cap`` (c,) what the shear yield stress
    lets it carry at the end and ``cap_before`` (c,) at the start, inf where none is asked. ``tool`` (c,) numbers their
    tools. Where they are means of two ``bodies``, of which one may be far softer, each gives way by its own stiffness,
    and ``before`` (c,) are the gaps that open, of the start, in means of its own configuration. Of slips by which
    points come or go past an end a part ``passing`` (c,) touches; those by which they go are ``gone`` (c,), else nan.

    Node by node, of the w :attr:`parts`: the ``normal`` (w, 2) of the tool's plane, its ``offset`` n . x at start and
    end (w,), its ``motion`` (w, 2). Of a curved tool the plane is the one that is tangent where the node is nearest at
    the end, and ``offset`` is that of the start; the motion is that of the tool's point there. In a body that supports
    and other tools carry and that is at rest otherwise, nodes go ``taken`` (w, 2). Gaps and slips of
    candidates are the means of those of nodes, and nodes take their shares of forces as vectors of their own.
    """

    node: Ints
    weights: Floats
    rubs: Bools
    tool: Ints
    normal: Floats
    mu: Floats
    offset: Floats
    offset_end: Floats
    motion: Floats
    taken: Floats
    cap: Floats | float = np.inf
    cap_before: Floats | float = np.inf
    curved: Curved | None = None
    before: Floats | None = None
    passing: Floats | float = 0.0
    gone: Floats | float = np.nan

    @property
    def bodies(self) -> bool:
        """Whether each is a mean of two bodies."""
        return self.before is not None

    @cached_property
    def parts(self) -> Parts:
        """The nodes that candidates are means of, one by one."""
        return Parts.of(self.weights)

    @property
    def past(self) -> Bools:
        """Candidates (c,) of which a node ends past an open end of their tool."""
        return np.zeros(len(self.node), dtype=bool) if self.curved is None else self.parts.any(self.curved.past)

    @property
    def welded(self) -> Bools:
        """Whether what touches is tied (c,): nothing bounds the friction."""
        return np.isinf(self.mu) & np.isinf(self.cap)

    @property
    def start_normal(self) -> Floats:
        """The normal (w, 2) where the increment starts."""
        return self.normal if self.curved is None else self.curved.normal

    @property
    def met(self) -> Ints:
        """The tools (w,) that nodes meet."""
        return self.tool[self.parts.owner]

    def start_gap(self, nodes: Floats) -> Floats:
        """Gaps (c,) with nodes (a, 2) where they start."""
        if self.before is not None:
            return self.before
        return self.parts.mean(np.vecdot(self.start_normal, nodes[self.parts.node]) - self.offset)

    def gap(self, nodes: Floats) -> Floats:
        """Gaps (c,) with nodes (a, 2) where they end."""
        return self.parts.mean(np.vecdot(self.normal, nodes[self.parts.node]) - self.offset_end)

    def opened(self, du: Floats) -> Floats:
        """What gaps (c,) grow by as nodes go ``du`` (a, 2)."""
        own = np.vecdot(self.normal, du[self.parts.node] - self.motion)
        return self.parts.mean(own if self.curved is None else own + self.curved.opened)

    def slip(self, du: Floats) -> Floats:
        """Slips (c,) of candidates as nodes go ``du`` (a, 2), zero where they do not rub."""
        own = np.vecdot(self.tangent, du[self.parts.node] - self.motion)
        return np.where(self.rubs, self.parts.mean(own if self.curved is None else own + self.curved.slid), 0.0)

    def most(self, r: Floats) -> Floats:
        """Largest friction (c,) under forces r (c, 2) of the end."""
        return self._most(r, self.cap)

    def most_before(self, r: Floats) -> Floats:
        """The same of the start, zero where nothing bounds it."""
        return np.where(self.welded, 0.0, self._most(r, self.cap_before))

    def _most(self, r: Floats, cap: Floats | float) -> Floats:
        """Largest friction (c,) below a ``cap``; without a coefficient the cap where a point carries at all."""
        carries = r[:, 0] > CARRIES * float(np.linalg.norm(r, axis=1).max(initial=0.0))
        by_pressure = np.where(np.isinf(self.mu), 0.0, self.mu) * r[:, 0]
        by_pressure = np.where(np.isinf(self.mu), np.where(carries | np.isinf(cap), np.inf, 0.0), by_pressure)
        return np.minimum(by_pressure, cap)

    @property
    def tangent(self) -> Floats:
        """(n_2, -n_1) of nodes (w, 2)."""
        return np.column_stack([self.normal[:, 1], -self.normal[:, 0]])

    def sizes(self, nodal: Floats) -> Floats:
        """Size (c,) of what the mean of a nodal field (a, d) is summed of, once for each of its terms."""
        terms = np.count_nonzero(self.weights, axis=1)
        return terms * (np.abs(self.weights) @ np.abs(nodal)).max(axis=1)

    def vectors(self, forces: Floats) -> Floats:
        """What nodes (w, 2) take of forces (c, 2) dual to gap and slip at the end, as vectors."""
        return self._taken(forces, self.normal, None if self.curved is None else self.curved.stretch[1])

    def start_vectors(self, forces: Floats) -> Floats:
        """The same of forces (c, 2) of the start."""
        return self._taken(forces, self.start_normal, None if self.curved is None else self.curved.stretch[0])

    def on_nodes(self, taken: Floats) -> Floats:
        """Sums (a, ...) over nodes of what they have ``taken`` (w, ...), one by one."""
        out = np.zeros((self.weights.shape[1], *taken.shape[1:]))
        np.add.at(out, self.parts.node, taken)
        return out

    def _taken(self, forces: Floats, normal: Floats, stretch: Floats | None) -> Floats:
        own = self.parts.share[:, None] * forces[self.parts.owner]
        along = np.column_stack([normal[:, 1], -normal[:, 0]])
        return own[:, :1] * normal + own[:, 1:] * (along if stretch is None else stretch[:, None] * along)
