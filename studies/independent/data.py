"""What the fuzz study's recomputation is given: an accepted increment in plain arrays, nothing of the library."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from studies.independent.candidates import Contacts
from studies.independent.element import Bools, Floats, Ints
from studies.independent.tools import Rigid

EPS = 64 * float(np.finfo(np.float64).eps)
"""Round-off over the terms that cancel: sums of up to some dozens of products."""


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
