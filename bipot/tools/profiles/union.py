"""Several surfaces as one tool: only the nearest one counts, so no node touches the tool twice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bipot.errors import require, require_tuple
from bipot.tools.surfaces import Distance, Surface, Tips, coordinates
from bipot.typing import Bools, Floats, Ints, Scalar, Vector

HALVINGS = 52
"""Halvings of a point's way, to find where another surface becomes the nearest."""


@dataclass(frozen=True)
class Union(Surface):
    """The union of the ``surfaces``: its gap is the least of theirs.

    Outside this is the distance; inside two surfaces at once it is the larger depth. Slip is the arc of the nearest
    surface; over a joint it is the arc on the first surface up to the joint and then that on the last.

    Raises:
        SceneError: no surfaces.

    >>> from bipot.tools.circle import Circle
    >>> two = Union((Circle((0.0, 3.0), 1.0), Circle((3.0, 3.0), 1.0)))
    >>> two.distance(np.array([[0.0, 1.5], [3.0, 1.0]])).gap.tolist()
    [0.5, 1.0]
    """

    surfaces: tuple[Surface, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "surfaces", require_tuple(self.surfaces, Surface, "union.surfaces"))
        require(len(self.surfaces) > 0, "union.surfaces", self.surfaces, "at least one")
        dimensions = {coordinates(surface, f"union.surfaces[{k}]") for k, surface in enumerate(self.surfaces)}
        require(len(dimensions) == 1, "union.surfaces", self.surfaces, "all of a plane, or all of space")

    def distance(self, x: Floats) -> Distance:
        """As :meth:`bipot.tools.surfaces.Surface.distance`."""
        nearest, found = self._nearest(x), [surface.distance(x) for surface in self.surfaces]
        return Distance(*(_chosen(nearest, parts) for parts in zip(*found, strict=True)))

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.gap`."""
        return np.min([surface.gap(x, moved) for surface in self.surfaces], axis=0)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.size`."""
        return np.max([surface.size(x, moved) for surface in self.surfaces], axis=0)

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.passed`; gaps by two distances where another becomes the nearest."""
        start, end = self._nearest(x), self._nearest(x + by)
        out = _chosen(end, [surface.passed(x, by) for surface in self.surfaces])
        over, rest = start != end, np.zeros(x.shape[-1])
        if over.any():
            out[over, 0] = self.gap(x[over] + by[over], rest) - self.gap(x[over], rest)
            out[over, 1:] = self._over(x[over], by[over], start[over], end[over])
        return out

    def _over(self, x: Floats, by: Floats, start: Ints, end: Ints) -> Floats:
        """Arcs (c, 1) of points x (c, d) that go ``by`` (c, d) from one surface to another; in space (c, 0)."""
        low, high = np.zeros((len(x), 1)), np.ones((len(x), 1))
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            stays = (self._nearest(x + middle * by) == start)[:, None]
            low, high = np.where(stays, middle, low), np.where(stays, high, middle)
        first = _chosen(start, [surface.passed(x, high * by) for surface in self.surfaces])
        then = _chosen(end, [surface.passed(x + high * by, (1 - high) * by) for surface in self.surfaces])
        return first[:, 1:] + then[:, 1:]

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.crossed`."""
        return np.any([surface.crossed(x, by) for surface in self.surfaces], axis=0)

    def beyond(self, x: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.beyond`."""
        return _chosen(self._nearest(x), [surface.beyond(x) for surface in self.surfaces])

    def tips(self) -> Tips:
        """As :meth:`bipot.tools.surfaces.Surface.tips`: those of all of them."""
        found = [surface.tips() for surface in self.surfaces]
        return Tips(
            np.concatenate([tips.centre for tips in found]),
            np.concatenate([tips.radius for tips in found]),
            min(tips.thickness for tips in found),
        )

    def image(self, normal: Vector, position: float) -> Union:
        """As :meth:`bipot.tools.surfaces.Surface.image`."""
        return Union(tuple(surface.image(normal, position) for surface in self.surfaces))

    def same(self, other: Surface, roundoff: float) -> bool:
        """As :meth:`bipot.tools.surfaces.Surface.same`, in any order."""
        if not isinstance(other, Union):
            return False
        pairs = (self.surfaces, other.surfaces), (other.surfaces, self.surfaces)
        return all(any(one.same(two, roundoff) for two in others) for some, others in pairs for one in some)

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """As :meth:`bipot.tools.surfaces.Surface.lines`: those of all of them, one inside the other too."""
        return [line for surface in self.surfaces for line in surface.lines(middle, reach)]

    def _nearest(self, x: Floats) -> Ints:
        """Number (…) of the surface that is nearest to points x (…, d)."""
        rest = np.zeros(x.shape[-1])
        return np.argmin([surface.gap(x, rest) for surface in self.surfaces], axis=0)


def _chosen(nearest: Ints, parts: Sequence[NDArray[Scalar]]) -> NDArray[Scalar]:
    """From arrays (…) or (…, d), one for each surface, the values of the ``nearest`` (…)."""
    out = np.array(parts)
    index = nearest.reshape(1, *nearest.shape, *(1,) * (out.ndim - 1 - nearest.ndim))
    return np.take_along_axis(out, index, axis=0)[0]
