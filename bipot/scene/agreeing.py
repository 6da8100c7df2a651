"""Checks that the methods of a tool's surface agree: a surface of a user's own may be any object that has them.

The gap is a distance and the normal its gradient exactly where the foot x - g n of every point off the surface lies on
it. An increment adds up what :meth:`~bipot.tools.surfaces.Surface.passed` says, so a wrong growth of gap or arc would
be a wrong answer whose certificate does not show it. A gap that grows as the normal says is right for short ways only:
points also go as far as the candidates extend.
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

SHALLOW = 0.01
"""Depth over the extent of the candidates from which, where all are in the tool at rest, they are brought out of it."""

STEEP = 1e-3
"""Growth of the gap across the normal, over the way: an angle between the normal and the gradient."""

ARCS = 0.01
"""Deviation of the growth of an arc from its derivative that the curvature of a line explains, over the way."""


def require_agreeing(surface: Surface, x: Floats, field: str) -> Distance:
    """The surface's distance of points x (a, d); raises SceneError where its methods do not agree.

    ``field`` names the surface.
    """
    found, extent = _finite_distance(surface, x, field), max_abs(x - x.mean(axis=0))
    moved = np.full(x.shape[1], OFF * extent)
    extent = extent + told(surface, x, float(np.max(_size(surface, x, moved, field))))
    x, normal = _outside(surface, x, found, extent, field)
    if not len(x):
        return found
    own = surface.distance(x - moved).gap
    given = _numbers(surface.gap(x[None], moved), x[None], (), f"{field}.gap")[0]
    _require_close(given, own, extent, field + ".gap", "that of distance(x - moved)")
    x = x + OFF * extent * normal
    gap, normal, curvature = _finite_distance(surface, x, field)
    astray = np.abs(surface.distance(x - gap[:, None] * normal).gap)
    steep = _slope(surface, x, normal, OFF * extent)
    right = bool((astray <= ALIKE * (np.abs(gap) + extent)).all() and (gap > 0).any() and steep <= STEEP)
    require(right, f"{field}.distance", "normal", "the gradient of the gap, a distance: x - gap normal on the surface")
    off = gap > 0
    x, found_off = x[off], Distance(gap[off], normal[off], curvature[off])
    _require_growing(surface, x, found_off, extent, field)
    if x.shape[1] == 2:
        _require_arcs(surface, x, found_off, ALONG * extent, field)
    return found


def told(surface: Surface, x: Floats, stated: float) -> float:
    """To what gaps of points x (..., d) can be told, numbers of the ``stated`` size as far as the gaps show these.

    Differences of large numbers are multiples of their last digit, or err by as much: from four equidistant places the
    gaps of a smooth surface have third differences of that size. Without either, the stated size is not theirs. Gaps
    that are zero at all places show nothing.
    """
    places = x.reshape(-1, x.shape[-1])
    way = np.full(places.shape[1], OFF * max_abs(places - places.mean(axis=0)))
    gaps = np.array([surface.distance(places - k * way).gap for k in range(4)])
    if not gaps[1:].any(axis=0).all():
        return TOLD * stated
    # The gap of one place may be a round number, and at a corner third differences are large.
    digits, third = _last_digit(gaps[1:]).min(axis=0), np.abs(np.diff(gaps, n=3, axis=0))
    shown = max(float(digits.max()), float(np.median(third)))
    # The last digit of a number is at least half of its round-off.
    shown *= 2 / float(np.finfo(float).eps)
    return TOLD * min(stated, max(shown, max_abs(places)))


def _last_digit(numbers: Floats) -> Floats:
    """The largest powers of two of which the numbers are multiples; inf of zero.

    >>> _last_digit(np.array([0.75, -6.0, 0.0])).tolist()
    [0.25, 2.0, inf]
    """
    part, power = np.frexp(numbers)
    whole = np.ldexp(part, 53).astype(np.int64)
    return np.where(numbers == 0, np.inf, np.ldexp((whole & -whole).astype(np.float64), power - 53))


def _outside(surface: Surface, x: Floats, found: Distance, extent: float, field: str) -> tuple[Floats, Floats]:
    """Those of points x (a, d) that are not in the tool, and normals; where all are, those that leave it soonest."""
    if (found.gap <= -ALIKE * extent).all():
        shallow = found.gap > -SHALLOW * extent
        x = (x - found.gap[:, None] * found.normal)[shallow]
        # What leaves one of two parts that overlap may be in the other.
        found = _finite_distance(surface, x, field)
    outside = found.gap > -ALIKE * extent
    return x[outside], found.normal[outside]


def _size(surface: Surface, x: Floats, moved: Floats, field: str) -> Floats:
    """The surface's size (a,) at points x (a, d); raises SceneError where what it says of them is no array (a,)."""
    for name, said in (("beyond", surface.beyond(x)), ("crossed", surface.crossed(x, np.zeros_like(x)))):
        _require_shape(said, x, (), "b", f"{field}.{name}")
    return _numbers(surface.size(x, moved), x, (), f"{field}.size")


def _slope(surface: Surface, x: Floats, normal: Floats, way: float) -> float:
    """How steep the gap is across the normals of points x (a, d), within this ``way``; the median, as at ARCS."""
    tangents = way * np.moveaxis(frames(normal)[:, 1:], 1, 0)
    ahead, behind = (surface.distance(x + sign * tangents).gap for sign in (1, -1))
    return float(np.median(np.abs(ahead - behind).max(axis=0))) / (2 * way)


def _require_growing(surface: Surface, x: Floats, found: Distance, extent: float, field: str) -> None:
    """Require that gaps grow by their difference as points x (a, d) go towards the surface, and far along it."""
    tangents, towards = frames(found.normal)[:, 1:].sum(axis=1), -found.gap[:, None] / 2 * found.normal
    for by in (towards, extent * (found.normal + tangents), extent * (found.normal - tangents)):
        grown, own = _passed(surface, x, by, field)[:, 0], surface.distance(x + by).gap - found.gap
        allowed = "the growth of the gap of points x that move by"
        _require_close(grown, own, found.gap + extent, f"{field}.passed", allowed)


def _require_arcs(surface: Surface, x: Floats, found: Distance, way: float, field: str) -> None:
    """Require that arcs grow by 1 - c g of the ``way``, but at points that pass from a piece to another.

    Level with a flat part, points beside its sharp corner pass one way to another piece, all of them: one way suffices.
    """
    ways = (sign * way * frames(found.normal)[:, 1] for sign in (1, -1))
    grown = np.array([_passed(surface, x, by, field)[:, 1] for by in ways]) / [[way], [-way]]
    off = float(np.median(np.abs(grown - (1 - found.curvature * found.gap)).min(axis=0)))
    require(off <= ARCS, f"{field}.passed", f"off by {off:.2g}", "the growth of the arc along (n_y, -n_x), 1 - c gap")


def _require_close(given: Floats, own: Floats, lengths: Floats | float, field: str, allowed: str) -> None:
    """Require values (a,) that differ from their ``own`` by round-off of the ``lengths``."""
    off = np.abs(given - own)
    require(bool((off <= ALIKE * lengths).all()), field, f"off by {np.max(off):.2g}", allowed)


def _passed(surface: Surface, x: Floats, by: Floats, field: str) -> Floats:
    """What points x (a, d) that move ``by`` (a, d) pass, (a, 2), in space (a, 1)."""
    return _numbers(surface.passed(x[None], by[None]), x[None], (2 if x.shape[1] == 2 else 1,), f"{field}.passed")[0]


def _finite_distance(surface: Surface, x: Floats, field: str) -> Distance:
    """The surface's distance of points x (a, d); raises SceneError if it is not finite or has another shape."""
    found, d = surface.distance(x[None]), x.shape[1]
    require(isinstance(found, Distance), field, type(found).__name__, "one whose distance is a Distance")
    inner, label = ((), (d,), (3, 3) if d == 3 else ()), f"{field}.distance"
    parts = zip(Distance._fields, found, inner, strict=True)
    found = Distance(*(_numbers(part, x[None], shape, f"{label}: {name}")[0] for name, part, shape in parts))
    off = max_abs(norm(found.normal) - 1)
    require(off < 1e-9, label, "normal", f"of length one, not off by {off:.2g}")
    return found


def _numbers(value: Floats, x: Floats, inner: tuple[int, ...], field: str) -> Floats:
    """``value``, an array (…, inner) of points x (…, d); raises SceneError unless it is one, of finite numbers."""
    _require_shape(value, x, inner, "fiu", field)
    require(bool(np.isfinite(value).all()), field, "NaN or infinite", "finite at the candidates and near them")
    return value


def _require_shape(value: object, x: Floats, inner: tuple[int, ...], kinds: str, field: str) -> None:
    """Require an array (…, inner) for points x (…, d), whose numbers are of these ``kinds`` of numpy's."""
    shape, words = (*x.shape[:-1], *inner), "numbers" if "f" in kinds else "True and False"
    found = f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
    right = isinstance(value, np.ndarray) and value.shape == shape and value.dtype.kind in kinds
    require(right, field, found, f"an array {shape} of {words}, for points {x.shape}")
