"""What the study of the total error runs: series of ``bipot``, each an element and form, and those of CalculiX."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bipot.fem.elements import Quadrature
from bipot.meshes.layout import Layout
from bipot.tools.tool import Sampling
from studies.accuracy import choice
from studies.accuracy.choice import Choice, Pace
from studies.accuracy.deck import FACES, NODES, Deck
from studies.accuracy.total_row import MARKS
from studies.element_types import AnyType, ElementType
from studies.methods import Method

SIDES = (3, 6, 10, 20)
COARSE = SIDES[:3]
ACCURATE: tuple[Pace, ...] = (Pace(accuracy=1e-2), Pace(accuracy=1e-3))
BOTH = (*ACCURATE, Pace(increments=40))


@dataclass(frozen=True)
class Series:
    """An element and form, with the sides that a quadratic element would have, at every pace."""

    kind: AnyType
    layout: Layout = Layout.TENSOR
    method: Method = Method.NEWTON
    quadrature: Quadrature | None = None
    contact: Sampling = Sampling.NODES
    sides: tuple[int, ...] = SIDES
    paces: tuple[Pace, ...] = ACCURATE

    def jobs(self, mu: float) -> Iterator[Choice]:
        """Its runs; a linear element has twice as many along a side."""
        rule = (self.quadrature or self.kind.quadrature).value
        for side in self.sides:
            elements = side * (1 if self.kind.element.quadratic else 2)
            for pace in self.paces:
                names = self.method.value, self.kind.value, rule, self.layout.value, self.contact.value
                yield Choice(mu, choice.OWN, *names, elements, str(pace))


@dataclass(frozen=True)
class Foreign:
    """An element of CalculiX in one kind of contact, on every side at every longest increment."""

    element: str
    contact: str
    sides: tuple[int, ...]
    longest: tuple[float, ...]
    penalties: tuple[tuple[float, float], ...] = ((10.0, 0.1),)
    """Stiffness over E/h, and what of it sticks."""
    deck: type[Deck] = Deck

    def decks(self, mu: float) -> Iterator[Deck]:
        """Its calculations."""
        for side in self.sides:
            for longest in self.longest:
                for stiffness, sticking in self.penalties:
                    yield self.deck(mu, self.element, self.contact, side, longest, stiffness, sticking)


LOCKING = (ElementType.Q4, ElementType.Q9, ElementType.T3)
MIDDLE = COARSE[1:2]
FORMS = (Method.TANGENT, Method.DISSIPATION, Method.UZAWA, Method.PENALTY)

OWN = (
    Series(ElementType.Q8),
    Series(ElementType.Q8, quadrature=Quadrature.GAUSS2, paces=BOTH),
    Series(ElementType.Q8, quadrature=Quadrature.GAUSS2, sides=(2, 8, 12)),
    Series(ElementType.Q8, contact=Sampling.WEIGHTED, sides=COARSE),
    Series(ElementType.Q4P0, sides=(*COARSE, 14, 20), paces=BOTH),
    Series(ElementType.Q4P0, sides=(1, 2, 4)),
    Series(ElementType.Q4P0, Layout.FANNED),
    Series(ElementType.Q8P1, sides=COARSE, paces=BOTH),
    Series(ElementType.Q8P1, Layout.FANNED),
    Series(ElementType.Q9P1, Layout.FANNED),
    Series(ElementType.T6, Layout.FANNED, sides=COARSE[:2]),
    *(Series(kind, sides=MIDDLE) for kind in LOCKING),
    *(Series(ElementType.Q4P0, method=method, sides=MIDDLE) for method in FORMS),
)
"""In the tensor layout of what would fold in the corner only coarse meshes: finer ones end earlier."""

FOREIGN = (
    Foreign("CAX8R", NODES, (2, 3, 5, 7), (0.02, 0.01)),
    Foreign("CAX8R", FACES, (3, 5, 7), (0.02, 0.01, 0.005)),
    Foreign("CAX8R", FACES, (10,), (0.02, 0.01)),
    Foreign("CAX8R", FACES, (5,), (0.01,), ((1.0, 1.0), (100.0, 0.1))),
    Foreign("CAX8R", FACES, (20,), (0.02,)),
    Foreign("CAX8", FACES, (5,), (0.02,)),
    Foreign("CAX4R", NODES, (20,), (0.02,)),
    Foreign("CAX4R", FACES, (10, 20), (0.02,)),
    Foreign("CAX4", FACES, (20,), (0.02,)),
)
"""Two kinds of contact, quadratic and linear elements, penalties: of each a few, and the best of them counts."""


@dataclass(frozen=True)
class Plan:
    """Coefficients, series, and repetitions: ``repeats`` if they take less than ``row`` seconds together, else one.

    ``marks`` are the reductions at which forces are read, ``alone`` the module that runs a job of ``bipot``.
    """

    mus: tuple[float, ...] = (0.1, 0.3)
    own: tuple[Series, ...] = OWN
    foreign: tuple[Foreign, ...] = FOREIGN
    repeats: int = 3
    row: float = 8.0
    marks: tuple[float, ...] = MARKS
    alone: str = "studies.accuracy.alone"

    def jobs(self) -> Iterator[Choice]:
        """All runs of ``bipot``."""
        return (job for mu in self.mus for series in self.own for job in series.jobs(mu))

    def decks(self) -> Iterator[Deck]:
        """All calculations of CalculiX."""
        return (deck for mu in self.mus for series in self.foreign for deck in series.decks(mu))


FAST = Plan(
    mus=(0.1,),
    own=(
        Series(ElementType.Q4P0, sides=(1,), paces=(Pace(accuracy=1e-2), Pace(increments=12))),
        Series(ElementType.Q4P0, sides=(1,), method=Method.TANGENT, paces=(Pace(accuracy=1e-2),)),
    ),
    foreign=(Foreign("CAX8R", NODES, (2,), (0.02,)), Foreign("CAX4", FACES, (4,), (0.02,))),
    repeats=1,
)
