"""Element types by their name on the command line: an element of the mesh and how its volume change is represented.

The bare name of a quadrilateral is the element as it is (``q8`` is the paper's); ``p0`` and ``p1`` say what its volume
change is projected on. ``t6`` is the triangle with its one stable choice, the mean. Those of space are bricks.
"""

from __future__ import annotations

from enum import Enum
from typing import Self

from bipot.fem.elements import RULES, Quadrature
from bipot.fem.projection import VolumeChange
from bipot.meshes.elements import Element


class _Named(Enum):
    """What types have in common: the columns of their tables, and the rules."""

    element: Element
    """Of the mesh."""
    volume: VolumeChange

    def __new__(cls, name: str, element: Element, volume: VolumeChange) -> Self:
        """A member by its name, with the columns of the table."""
        member = object.__new__(cls)
        member._value_ = name
        member.element, member.volume = element, volume
        return member

    @property
    def quadratures(self) -> tuple[Quadrature, ...]:
        """The rules it may be asked for, its default first.

        >>> [rule.value for rule in ElementType("t6").quadratures]
        ['triangle3', 'triangle7']
        """
        return RULES[self.element]

    @property
    def quadrature(self) -> Quadrature:
        """Its default rule."""
        return self.quadratures[0]


class ElementType(_Named):
    """The types of a plane by name, in the order of tables: as they are, then projected."""

    Q8 = "q8", Element.Q8, VolumeChange.AS_IS
    Q4 = "q4", Element.Q4, VolumeChange.AS_IS
    Q9 = "q9", Element.Q9, VolumeChange.AS_IS
    T3 = "t3", Element.T3, VolumeChange.AS_IS
    Q8P1 = "q8p1", Element.Q8, VolumeChange.P1
    Q4P0 = "q4p0", Element.Q4, VolumeChange.P0
    Q9P1 = "q9p1", Element.Q9, VolumeChange.P1
    T6 = "t6", Element.T6, VolumeChange.P0


class SolidType(_Named):
    """The types of space by name."""

    H8 = "h8", Element.H8, VolumeChange.AS_IS
    H20 = "h20", Element.H20, VolumeChange.AS_IS
    H8P0 = "h8p0", Element.H8, VolumeChange.P0
    H20P0 = "h20p0", Element.H20, VolumeChange.P0
    H20P1 = "h20p1", Element.H20, VolumeChange.P1


AnyType = ElementType | SolidType
