"""Checks that the methods of a tool's surface agree: a surface of a user's own may be any object that has them.

The gap is a distance and the normal its gradient exactly where the foot x - g n of every point off the surface lies on
it. An increment adds up what :meth:`~bipot.tools.surfaces.Surface.passed` says, so a wrong growth of gap or arc would
be a wrong answer whose certificate does not show it.
"""

from __future__ import annotations

import numpy as np

from bipot.errors import require
from bipot.tensors import norm
from bipot.tools.surfaces import Distance, Surface, frames
from bipot.typing import Floats, max_abs

ALIKE = 1e-6
"""Over distances and the extent of the candidates: places that differ by less are the same."""

TOLD = 1e-8
"""Over the numbers whose difference a gap is: what is larger than that can be told of a surface."""

OFF, ALONG = 1e-3, 1e-5
"""How far from where they are, and along the surface, candidates are tried, over their extent."""

ARCS = 0.01
"""Deviation of the growth of an arc from its derivative that the curvature of a line explains, over the way."""


def require_agreeing(surface: Surface, x: Floats, field: str) -> Distance:
    """The surface's distance of points x (a, d); raises SceneError where its methods do not agree.

    ``field`` names the surface.
    """
    found, extent = _finite_distance(surface, x, field), max_abs(x - x.mean(axis=0))
    outside = found.gap > -ALIKE * extent
    if not outside.any():
        return found
    x, normal = x[outside], found.normal[outside]
    moved = np.full(x.shape[1], OFF * extent)
    extent = extent + TOLD * float(np.max(surface.size(x, moved)))
    given, own = surface.gap(x, moved), surface.distance(x - moved).gap
    _require_close(given, own, extent, field + ".gap", "that of distance(x - moved)")
    x = x + OFF * extent * normal
    gap, normal, curvature = _finite_distance(surface, x, field)
    astray = np.abs(surface.distance(x - gap[:, None] * normal).gap)
    right = bool((astray <= ALIKE * (np.abs(gap) + extent)).all() and (gap > 0).any())
    require(right, f"{field}.distance", "normal", "the gradient of the gap, a distance: x - gap normal on the surface")
    off = gap > 0
    x, gap, normal, curvature = x[off], gap[off], normal[off], curvature[off]
    grown = _passed(surface, x, -gap[:, None] / 2 * normal, field)[:, 0]
    _require_close(grown, -gap / 2, gap + extent, f"{field}.passed", "the growth of the gap of points x that move by")
    if x.shape[1] == 2:
        _require_arcs(surface, x, Distance(gap, normal, curvature), ALONG * extent, field)
    return found


def _require_arcs(surface: Surface, x: Floats, found: Distance, way: float, field: str) -> None:
    """Require that arcs grow by 1 - c g of the ``way``, but at points that pass from a piece to another."""
    grown = _passed(surface, x, way * frames(found.normal)[:, 1], field)[:, 1] / way
    off = float(np.median(np.abs(grown - (1 - found.curvature * found.gap))))
    require(off <= ARCS, f"{field}.passed", f"off by {off:.2g}", "the growth of the arc along (n_y, -n_x), 1 - c gap")


def _require_close(given: Floats, own: Floats, lengths: Floats | float, field: str, allowed: str) -> None:
    """Require values (a,) that differ from their ``own`` by round-off of the ``lengths``."""
    require(np.shape(given) == own.shape, field, f"of shape {np.shape(given)}", f"of shape {own.shape}")
    off = np.abs(given - own)
    require(bool((off <= ALIKE * lengths).all()), field, f"off by {np.max(off):.2g}", allowed)


def _passed(surface: Surface, x: Floats, by: Floats, field: str) -> Floats:
    """What points x (a, d) that move ``by`` (a, d) pass, (a, 2), in space (a, 1)."""
    grown, shape = np.asarray(surface.passed(x, by)), (len(x), 2 if x.shape[1] == 2 else 1)
    right = grown.shape == shape and bool(np.isfinite(grown).all())
    require(right, f"{field}.passed", f"of shape {grown.shape}", f"finite, of shape {shape}")
    return grown


def _finite_distance(surface: Surface, x: Floats, field: str) -> Distance:
    """The surface's distance of points x (a, d); raises SceneError if it is not finite or has another shape."""
    found = surface.distance(x)
    require(isinstance(found, Distance), field, type(found).__name__, "one whose distance is a Distance")
    shapes = x.shape[:-1], x.shape, x.shape[:-1] + (3, 3) * (x.shape[-1] == 3)
    for name, value, shape in zip(Distance._fields, found, shapes, strict=True):
        good = np.shape(value) == shape and bool(np.isfinite(value).all())
        require(good, f"{field}.distance", name, f"finite, of shape {shape}, at the candidates")
    off = max_abs(norm(found.normal) - 1)
    require(off < 1e-9, f"{field}.distance", "normal", f"of length one, not off by {off:.2g}")
    return found
