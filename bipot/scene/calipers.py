"""How far a body extends between its facets: relative motion over that is a strain, the same however it is turned."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.tools.plane import leftwards
from bipot.typing import Floats, max_abs

ALIKE = 9
"""Decimals of unit normals that are one: a flat side has a normal for each facet."""

ROUND_OFF = 1e-14
"""Over the longest motion, what of a difference is none."""

AT_ONCE = 256
"""Normals along which all nodes are measured in one product."""


class Calipers(NamedTuple):
    """Different unit ``normals`` (f, d) of a body's outer facets, and its ``widths`` (f,) across these."""

    normals: Floats
    widths: Floats

    @staticmethod
    def of(facets: Floats, places: Floats) -> Calipers:
        """Of the body with these outer ``facets``, corner by corner (f, n, d), and nodes at these ``places`` (a, d).

        >>> corners = np.array([[0.0, 0.0], [4.0, 3.0], [2.5, 5.0], [-1.5, 2.0]])
        >>> edges = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        >>> sorted(Calipers.of(edges, corners).widths.round(12).tolist())
        [2.5, 2.5, 5.0, 5.0]
        """
        normals = across(facets)
        _, first = np.unique(normals.round(ALIKE), axis=0, return_index=True)
        normals = normals[np.sort(first)]
        parts = np.array_split(normals, -(-len(normals) // AT_ONCE))
        return Calipers(normals, np.concatenate([np.ptp(places @ part.T, axis=0) for part in parts]))

    def strain(self, ways: Floats) -> float:
        """The largest part, over all facets, by which motions ``ways`` (m, d) differ across one of the width there.

        It is none where these differ by their round-off alone, as where all goes along together.

        >>> corners = np.array([[0.0, 0.0], [4.0, 3.0], [2.5, 5.0], [-1.5, 2.0]])
        >>> edges = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        >>> round(Calipers.of(edges, corners).strain(np.array([[0.0, 0.0], [-0.3, 0.4]])), 12)
        0.2
        """
        apart = np.ptp(np.unique(ways, axis=0) @ self.normals.T, axis=0)
        return float((np.where(apart > ROUND_OFF * max_abs(ways), apart, 0.0) / self.widths).max())


def across(facets: Floats) -> Floats:
    """Unit normals (f, d) of edges by their ends, or of faces by their corners, (f, n, d)."""
    along = facets[:, -1] - facets[:, 0]
    if facets.shape[2] == 2:
        normals = -leftwards(along)
    else:
        normals = np.cross(facets[:, 2] - facets[:, 0], facets[:, -1] - facets[:, 1])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
