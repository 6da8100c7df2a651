"""Flat parts of faces in space, written a second time for the fuzz study: nothing of the library.

A face with nodes in the middle of its edges has parts between all its nodes, which are points between parts: four
triangles, or those around the corners of a square and the square between its middles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.data import Floats, Ints

PARTS = {
    6: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    8: ((0, 4, 7, 7), (4, 1, 5, 5), (5, 2, 6, 6), (6, 3, 7, 7), (4, 5, 6, 7)),
}
"""The flat parts of faces of so many nodes: corners in order, then the middles after each. Triangles beside squares
have their last corner twice."""

PLACES = {
    6: np.array([[0, 0], [2, 0], [0, 2], [1, 0], [1, 1], [0, 1]]),
    8: np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1]]),
}
"""Where these nodes are in coordinates of the face."""

POWERS = np.array([(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (2, 1), (1, 2)])
"""Of these coordinates, in the polynomials of which the first n are those of a face of n nodes."""


def _monomials(x: Floats, count: int) -> Floats:
    """The first (q, n) at x (q, 2)."""
    return np.asarray(np.stack([x[:, 0] ** a * x[:, 1] ** b for a, b in POWERS[:count]], axis=1), np.float64)


@dataclass(frozen=True)
class Flats:
    """The flat parts of ``faces`` (f, n)."""

    faces: Ints

    @property
    def _parts(self) -> tuple[tuple[int, ...], ...]:
        n = self.faces.shape[1]
        return PARTS.get(n, (tuple(range(n)),))

    @property
    def nodes(self) -> Ints:
        """Their corners (l, k), face by face."""
        return np.array([face[list(part)] for face in self.faces for part in self._parts])

    def whole(self, i: int) -> Ints:
        """The nodes (n,) of the face of the i-th one."""
        return np.asarray(self.faces[i // len(self._parts)])

    def shapes(self, i: int, of_flat: Floats) -> Floats:
        """The face's shape functions (q, n) by those of its i-th one (q, k)."""
        n = self.faces.shape[1]
        if n not in PARTS:
            return of_flat
        at = of_flat @ PLACES[n][list(self._parts[i % len(self._parts)])]
        return _monomials(at, n) @ np.linalg.inv(_monomials(PLACES[n], n))
