r"""From the corners of a line and the radii of its fillets to its pieces; invalid lines are refused.

A fillet of the radius r at a corner where the line turns by theta takes r tan(|theta|/2) off the straights beside it.
The line continues straight beyond open ends and may not cross itself. For this it is enough that it does not with sharp
corners, and that no corner is inside the triangle that a fillet cuts off at another.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot.errors import require
from bipot.tensors import norm
from bipot.tools.plane import angle_between, cross, leftwards
from bipot.tools.profiles.pieces import ProfilePieces, Rounds, Straights
from bipot.typing import Bools, Floats, Ints

STRAIGHT = 1e-12
"""A turn (radians) below this counts as none."""

BACK = 1e-9
"""A turn within this (radians) of half a circle leads back along the line itself."""

FITS = 1e-12
"""Fraction of a straight by which fillets may exceed its length, by round-off."""

PARALLEL = 1e-9
"""Sides whose directions differ by less (radians) are parallel."""


def pieces_of(points: Sequence[tuple[float, float]], radii: Sequence[float], closed: bool) -> ProfilePieces:
    """Straights and rounds of the line through ``points``, with fillets of the ``radii`` at its inner ones.

    Raises:
        SceneError: points that follow each other are the same, the line goes back on itself or crosses itself, a fillet
            does not fit, or comes near another part of the line.
    """
    corners = np.array(points)
    sides = _sides(corners, closed)
    repeated = np.flatnonzero(norm(sides) <= FITS * np.abs(corners).max())[:1].tolist()
    require(not repeated, "profile.points", points, f"different: number {repeated} and the next are one")
    theta = angle_between(*_beside(sides, closed))
    turning = np.flatnonzero(np.abs(theta) > STRAIGHT)
    back = turning[np.abs(theta[turning]) > np.pi - BACK].tolist()
    require(not back, "profile.points", points, f"a line that does not go back on itself, as at inner corners {back}")
    inner = turning if closed else turning + 1
    kept = corners[inner] if closed else corners[[0, *inner.tolist(), -1]]
    require(len(kept) > 2 * closed, "profile.points", points, "three that are not on one line, where it is closed")
    _require_simple(kept, closed, points)
    return _cut(kept, np.array(radii)[turning], theta[turning], closed, inner)


def _sides(corners: Floats, closed: bool) -> Floats:
    """Vectors (l, d) from corner to corner; of a closed line the last leads back to the first."""
    return np.diff(corners, axis=0, append=corners[:1]) if closed else np.diff(corners, axis=0)


def _beside(sides: Floats, closed: bool) -> tuple[Floats, Floats]:
    """The sides (m, d) before and after the inner corners."""
    return (np.roll(sides, 1, axis=0), sides) if closed else (sides[:-1], sides[1:])


def _cut(corners: Floats, radius: Floats, theta: Floats, closed: bool, names: Ints) -> ProfilePieces:
    """The pieces of a line without straight corners; ``names`` (m,) are the numbers of the inner ones as given."""
    sides = _sides(corners, closed)
    length, trim = norm(sides), radius * np.tan(np.abs(theta) / 2)
    along, turn = sides / length[:, None], -np.sign(theta)
    # What fillets take off the start and the end of every side.
    taken = np.stack([trim, np.roll(trim, -1)] if closed else [np.append(0.0, trim), np.append(trim, 0.0)])
    left = length - taken.sum(axis=0)
    _require_fits(left, length, radius, closed, names)
    left = np.maximum(left, 0.0)
    inner = corners if closed else corners[1:-1]
    _require_clear(corners, inner, trim, along, closed, names)
    before, after = _beside(along, closed)
    centre = inner - trim[:, None] * before - (turn * radius)[:, None] * leftwards(before)
    # A closed line begins with the round of its first corner.
    swept = radius * np.abs(theta)
    ends = np.cumsum(swept + left) if closed else np.cumsum(left + np.append(swept, 0.0))
    rounds = Rounds(centre, radius, turn, before, after, ends - left - swept if closed else ends[:-1] - swept)
    begins = ends - left if closed else ends - left - np.append(swept, 0.0)
    low, high = np.zeros_like(left), left.copy()
    if not closed:
        low[0], high[-1] = -np.inf, np.inf
    starts = corners[: len(sides)] + taken[0][:, None] * along
    straights = Straights(starts, along, leftwards(along), left, low, high, begins)
    span, extent = norm(np.ptp(corners, axis=0)), max(norm(corners).max(), radius.max(initial=0.0))
    return ProfilePieces(rounds, straights, float(ends[-1]) if closed else np.inf, float(span), float(extent))


def _require_fits(left: Floats, length: Floats, radius: Floats, closed: bool, names: Ints) -> None:
    """Require that fillets do not exceed the length of a side."""
    short = np.flatnonzero(left < -FITS * length)[:1]
    if short.size:
        k = int(short[0])
        beside = [k, (k + 1) % len(radius)] if closed else [c for c in (k - 1, k) if 0 <= c < len(radius)]
        found = {int(names[c]): float(radius[c]) for c in beside}
        room = f"such that they fit on a side of {length[k]:g}: by corner they are {found}"
        require(False, "profile.fillets", [float(r) for r in radius], room)


def _require_clear(corners: Floats, inner: Floats, trim: Floats, along: Floats, closed: bool, names: Ints) -> None:
    """Require that no corner is in the triangle that a fillet cuts off at another."""
    before, after = _beside(along, closed)
    # In the oblique frame of a corner's two sides the triangle is u, v >= 0, u + v <= trim.
    to = corners - inner[:, None]
    area = cross(before, after)[:, None]
    u, v = cross(-to, after[:, None]) / area, cross(before[:, None], to) / area
    slack = FITS * np.abs(corners).max()
    inside = (u > -slack) & (v > -slack) & (u + v < trim[:, None] - slack) & (trim > 0)[:, None]
    itself = np.arange(len(inner))[:, None] + (0 if closed else 1)
    near = np.flatnonzero((inside & (np.arange(len(corners)) != itself)).any(axis=1))[:1]
    if near.size:
        field = f"profile.fillets, corner {int(names[near[0]])}"
        require(False, field, float(trim[near[0]]), "so short a cut off its sides that no other corner is inside it")


def _require_simple(corners: Floats, closed: bool, points: object) -> None:
    """Require that no side meets another; the first and last side of an open line have no end."""
    sides, count = _sides(corners, closed), len(corners) - (not closed)
    start = corners[:count]
    low, high = np.zeros(count), np.ones(count)
    if not closed:
        low[0], high[-1] = -np.inf, np.inf
    i, j = np.triu_indices(count, 2)
    apart = ~((i == 0) & (j == count - 1) & closed)
    i, j = i[apart], j[apart]
    crossing = _meet((start[i], sides[i], low[i], high[i]), (start[j], sides[j], low[j], high[j]))
    found = [(int(a), int(b)) for a, b in zip(i[crossing], j[crossing], strict=True)][:1]
    ends = "" if closed else ", and does not where it goes on straight beyond its ends: go on, or close it"
    require(not found, "profile.points", points, f"a line that does not meet itself, as sides {found} do{ends}")


Side = tuple[Floats, Floats, Floats, Floats]
"""Sides: starts (k, d), vectors (k, d), and the multiples of these (k,) at which sides begin and end."""


def _meet(one: Side, other: Side) -> Bools:
    """Whether sides that are not parallel meet (k,), also end to end.

    Where two on one line overlap, one of them ends on the other, and there begins a third, which is not parallel.
    """
    (p, d, low, high), (q, e, low_e, high_e) = one, other
    size, area, to = norm(d) * norm(e), cross(d, e), q - p
    slanted = np.abs(area) > PARALLEL * size
    safe = np.where(slanted, area, 1.0)
    a, b = cross(to, e) / safe, cross(to, d) / safe
    return slanted & (a >= low - FITS) & (a <= high + FITS) & (b >= low_e - FITS) & (b <= high_e + FITS)
