"""How far a body extends between its faces: relative motion over that is a strain, the same however it is turned."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.typing import Floats


class Calipers(NamedTuple):
    """Unit ``normals`` (f, d) of the faces of a body's convex hull, and its ``widths`` (f,) across these."""

    normals: Floats
    widths: Floats

    @staticmethod
    def of(places: Floats) -> Calipers:
        """Of the body whose nodes are at these ``places`` (a, d).

        >>> corners = np.array([[0.0, 0.0], [4.0, 3.0], [2.5, 5.0], [-1.5, 2.0]])
        >>> sorted(Calipers.of(corners).widths.round(12).tolist())
        [2.5, 2.5, 5.0, 5.0]
        """
        # Imported here, because it takes long, and only increments by accuracy need it.
        from scipy.spatial import ConvexHull

        # In units of the body, so that nothing of it is small.
        size = float(np.ptp(places, axis=0).max())
        x = (places - places.mean(axis=0)) / size
        hull = ConvexHull(x)
        normals, corners = hull.equations[:, :-1], x[hull.vertices]
        widths = np.array([np.ptp(corners @ normal) for normal in normals])
        return Calipers(normals, widths * size)

    def strain(self, ways: Floats) -> float:
        """The largest part, over all faces, by which motions ``ways`` (m, d) differ across one of the width there.

        >>> corners = np.array([[0.0, 0.0], [4.0, 3.0], [2.5, 5.0], [-1.5, 2.0]])
        >>> round(Calipers.of(corners).strain(np.array([[0.0, 0.0], [-0.3, 0.4]])), 12)
        0.2
        """
        apart = np.ptp(np.unique(ways, axis=0) @ self.normals.T, axis=0)
        return float((apart / self.widths).max())
