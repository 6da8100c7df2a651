"""What the fuzz study's recomputation is given: an accepted increment in plain arrays, nothing of the library."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from studies.independent.element import Bools, Floats, Ints
from studies.independent.sampling import Parts
from studies.independent.tools import Rigid

EPS = 64 * float(np.finfo(np.float64).eps)
"""Round-off over the terms that cancel: sums of up to some dozens of products."""

CARRIES = 1e-8
"""A push below this part of the increment's largest contact force is none."""


@dataclass(frozen=True)
class Setting:
    """What does not change in a run. ``held`` (a, 2) says which components along its ``axes`` (a, 2, 2) a node's
    supports fix, rows of each node's; those of coordinates where there are none.
    ``young`` and ``poisson`` of each element (e, 1) or of all, the ``yield_stress`` (e, q) may be infinite. ``rest``
    (a, 2) are the nodes where ``small`` strain is taken and equilibrium asked. ``volume`` is what the volume change of
    an element is fitted by: as_is, p0, p1. ``surface`` (f, 2) are neighbours on that of the body, ``mirrors`` the
    planes x_direction = position, of symmetry or at the axis, that make it whole.
    """

    elements: Ints
    axisymmetric: bool
    midpoint: bool
    quadrature: str
    young: Floats | float
    poisson: Floats | float
    yield_stress: Callable[[Floats], Floats]
    held: Bools
    size: float
    rest: Floats
    small: bool = False
    volume: str = "as_is"
    surface: Ints = field(default_factory=lambda: np.empty((0, 2), np.intp))
    mirrors: tuple[tuple[int, float], ...] = ()
    axes: Floats | None = None

    @property
    def whole(self) -> float:
        """The size of the whole body: the larger side with the images beyond planes of symmetry, not beyond an axis."""
        low, high = self.rest.min(axis=0), self.rest.max(axis=0)
        for d, position in self.mirrors:
            if not (self.axisymmetric and d == 0):
                reach = max(high[d] - position, position - low[d])
                low[d], high[d] = position - reach, position + reach
        return float((high - low).max())

    def along(self, vectors: Floats) -> Floats:
        """Components (..., a, 2) along the axes of nodes of their vectors (..., a, 2)."""
        return vectors if self.axes is None else np.einsum("aij,...aj->...ai", self.axes, vectors)

    def across(self, components: Floats) -> Floats:
        """The vectors (..., a, 2) of components (..., a, 2) along the axes."""
        return components if self.axes is None else np.einsum("aij,...ai->...aj", self.axes, components)

    def freed(self, vectors: Floats) -> Floats:
        """What of nodes' vectors (..., a, 2) is not held."""
        return self.across(np.where(self.held, 0.0, self.along(vectors)))

    @property
    def shear(self) -> Floats:
        """G of elements (e, 1), or of all (1, 1)."""
        return np.reshape(self.young / (2 * (1 + self.poisson)), (-1, 1))

    @property
    def bulk(self) -> Floats:
        """K of elements (e, 1), or of all (1, 1)."""
        return np.reshape(self.young / (3 * (1 - 2 * self.poisson)), (-1, 1))


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
    and ``before`` (c,) are the gaps that open, of the start, in means of its own configuration.

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


@dataclass(frozen=True)
class Led:
    """The m tools that forces drive: ``tool`` (m,) by number, their ``normal`` and the force's ``direction`` (m, 2).

    ``force`` (m,) is what acts at the end on the modelled part. How far the tool has gone along it since rest is
    ``begun`` and ``ended`` (m,) at start and end, ``advance`` (m,) in the increment, as stored.

    What a moment turns goes by ``spin`` (m,) times the arm as that grows by one, about ``centre`` (m, 2) at the end:
    its direction is zero, its force the moment times the spin; the spin is zero of others, and so is the normal of what
    is not flat.
    """

    tool: Ints
    normal: Floats
    direction: Floats
    spin: Floats
    centre: Floats
    force: Floats
    begun: Floats
    ended: Floats
    advance: Floats

    def ways(self, k: int, x: Floats) -> Floats:
        """What the tool of number k here takes its points at x (c, 2) along (c, 2)."""
        arm = x - self.centre[k]
        return self.direction[k] + self.spin[k] * np.column_stack([-arm[:, 1], arm[:, 0]])


@dataclass(frozen=True)
class Moment:
    """A state in plain arrays: nodes, stress and plastic strain (e, q, 3, 3), peeq (e, q), forces (c, 2)."""

    nodes: Floats
    stress: Floats
    plastic_strain: Floats
    peeq: Floats
    forces: Floats


@dataclass(frozen=True)
class Step:
    """An accepted increment. ``gap`` (c,) is the one stored, or None; ``flow`` that of the increment before, or None.

    ``loads`` are nodal forces (a, 2) at start and end and the sizes (a,) of what they are summed of.
    ``held`` are nodes of the tools' boundaries that supports hold along the normal: no candidates, and without force.
    ``prescribed`` are the displacements (a, 2) since rest that supports ask of what they hold, at start and end.
    ``largest`` is the largest contact force of the run up to its end, ``energy`` the largest energy of its increments
    before. ``displacement`` is exact where the state stores it, else the difference of positions, ``by_difference``.
    ``tools`` are those that are not flat. ``balanced`` (a, 2) is where the start is in equilibrium.
    """

    start: Moment
    end: Moment
    displacement: Floats
    by_difference: bool
    contacts: Contacts
    held: Contacts
    gap: Floats | None
    flow: tuple[Floats, Floats] | None
    largest: float
    loads: tuple[Floats, Floats, Floats]
    prescribed: tuple[Floats, Floats]
    led: Led
    balanced: Floats
    energy: float = 0.0
    tools: tuple[Rigid, ...] = ()


def beyond(value: Floats, round_off: Floats | float, scale: float) -> float:
    """Largest (value - round_off)+ over ``scale``; 0/0 is 0."""
    worst = float(np.maximum(value - round_off, 0.0).max(initial=0.0))
    return 0.0 if worst == 0.0 else (worst / scale if scale > 0 else float("inf"))


def mandel_to_full(t: Floats) -> Floats:
    """(..., 4) in the order 11, 22, 33, sqrt(2) 12 to (..., 3, 3)."""
    full = np.zeros((*t.shape[:-1], 3, 3))
    for k in range(3):
        full[..., k, k] = t[..., k]
    full[..., 0, 1] = full[..., 1, 0] = t[..., 3] / np.sqrt(2)
    return full
