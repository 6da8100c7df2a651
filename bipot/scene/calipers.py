"""A body's widths across its facets: relative motion over a width is a strain, however the body is turned."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.tools.plane import leftwards
from bipot.typing import Floats, max_abs

ALIKE = 9
"""Unit normals that agree to so many decimals are one: every facet of a flat side has its own."""

ROUND_OFF = 1e-14
"""A difference of motions below this part of the longest one counts as zero."""

AT_ONCE = 256
"""How many normals all nodes are measured along in one product, which limits its memory."""


class Calipers(NamedTuple):
    """Different unit ``normals`` (f, d) of a body's outer facets, and its ``widths`` (f,) along them."""

    normals: Floats
    widths: Floats

    @staticmethod
    def of(facets: Floats, places: Floats) -> Calipers:
        """The calipers of a body with outer ``facets`` (f, n, d), given by corners, and nodes at ``places`` (a, d).

        >>> corners = np.array([[0.0, 0.0], [4.0, 3.0], [2.5, 5.0], [-1.5, 2.0]])
        >>> edges = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        >>> sorted(Calipers.of(edges, corners).widths.round(12).tolist())
        [2.5, 2.5, 5.0, 5.0]
        """
        along = facets[:, -1] - facets[:, 0]
        flat = facets.shape[2] == 2
        normals = -leftwards(along) if flat else np.cross(facets[:, 2] - facets[:, 0], facets[:, -1] - facets[:, 1])
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        _, first = np.unique(normals.round(ALIKE), axis=0, return_index=True)
        normals = normals[np.sort(first)]
        parts = np.array_split(normals, -(-len(normals) // AT_ONCE))
        return Calipers(normals, np.concatenate([np.ptp(places @ part.T, axis=0) for part in parts]))

    def strain(self, ways: Floats) -> float:
        """The largest difference, along any normal, of the motions ``ways`` (m, d) over the width along that normal.

        Differences that are round-off of the motions, as of bodies carried along as a whole, count as zero.

        >>> corners = np.array([[0.0, 0.0], [4.0, 3.0], [2.5, 5.0], [-1.5, 2.0]])
        >>> edges = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        >>> round(Calipers.of(edges, corners).strain(np.array([[0.0, 0.0], [-0.3, 0.4]])), 12)
        0.2
        """
        apart = np.ptp(ways @ self.normals.T, axis=0)
        return float((np.where(apart > ROUND_OFF * max_abs(ways), apart, 0.0) / self.widths).max())
