"""Outlines made of what tools are made of, written a second time for the fuzz study: nothing of the library."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from studies.independent.element import Floats
from studies.independent.outline import Outline, angle_of, left

BENT = 1e-12
"""A turn (radians) below this is none."""


def half_plane(point: Sequence[float], normal: Sequence[float]) -> Outline:
    """What is behind the line through ``point`` with the ``normal``."""
    n, none = np.array([normal], dtype=np.float64), np.empty(0)
    return Outline(
        start=np.array([point], dtype=np.float64),
        along=-left(n),
        length=np.full(1, np.inf),
        low=np.array([-np.inf]),
        high=np.array([np.inf]),
        centre=np.empty((0, 2)),
        radius=none,
        turn=none,
        middle=np.empty((0, 2)),
        half=none,
        begin=np.zeros(1),
        around=np.inf,
        span=1.0,
    )


def disc(centre: Sequence[float], radius: float, hollow: bool) -> Outline:
    """The disc, or what is outside of it where it is ``hollow``."""
    none, straights = np.empty(0), np.empty((0, 2))
    return Outline(
        start=straights,
        along=straights,
        length=none,
        low=none,
        high=none,
        centre=np.array([centre], dtype=np.float64),
        radius=np.array([radius]),
        turn=np.array([-1.0 if hollow else 1.0]),
        middle=np.array([(0.0, 1.0)]),
        half=np.array([np.pi]),
        begin=np.zeros(1),
        around=2 * np.pi * radius,
        span=radius,
        thick=np.inf if hollow else 2 * radius,
    )


def chain(points: Sequence[Sequence[float]], fillets: Sequence[float], closed: bool) -> Outline:
    """Straights through ``points`` with ``fillets`` at the inner ones, which all are where the chain is ``closed``."""
    x = np.array(points, dtype=np.float64)
    sides = np.roll(x, -1, axis=0) - x if closed else np.diff(x, axis=0)
    length = np.linalg.norm(sides, axis=1)
    t = sides / length[:, None]
    inner = range(0 if closed else 1, len(x) if closed else len(x) - 1)
    arcs = [arc for k, radius in zip(inner, fillets, strict=True) if (arc := _arc(x, t, k, radius)) is not None]
    low, high = np.zeros(len(t)), length.copy()
    for arc in arcs:
        low[arc.corner] += arc.cut
        high[arc.corner - 1] -= arc.cut
    begin, around = _begins(low, high, arcs)
    # Along a straight places are told from its corner, which an arc has cut off.
    begin[: len(t)] -= low
    if not closed:
        low[0], high[-1] = -np.inf, np.inf
    return Outline(
        start=x[: len(t)],
        along=t,
        length=length,
        low=low,
        high=high,
        centre=np.array([arc.centre for arc in arcs]).reshape(-1, 2),
        radius=np.array([arc.radius for arc in arcs]),
        turn=np.array([arc.turn for arc in arcs]),
        middle=np.array([arc.middle for arc in arcs]).reshape(-1, 2),
        half=np.array([arc.half for arc in arcs]),
        begin=begin,
        around=around if closed else np.inf,
        span=float(np.ptp(x, axis=0).max()),
    )


class _Arc(NamedTuple):
    """The fillet at a corner, which cuts the length ``cut`` off both straights; else as in :class:`Outline`."""

    corner: int
    cut: float
    centre: Floats
    radius: float
    turn: float
    middle: Floats
    half: float


def _arc(x: Floats, t: Floats, corner: int, radius: float) -> _Arc | None:
    """At a corner of x (k, 2) between straights along t (l, 2); None where the chain goes straight on."""
    before, after = t[corner - 1], t[corner]
    theta = float(angle_of(before, after))
    if abs(theta) <= BENT:
        return None
    # The centre is on the bisector of the two straights, the middle of the arc between it and the corner.
    bisector = (after - before) / np.linalg.norm(after - before)
    centre, half = x[corner] + radius / np.cos(theta / 2) * bisector, abs(theta) / 2
    return _Arc(corner, radius * float(np.tan(half)), centre, radius, -float(np.sign(theta)), -bisector, half)


def _begins(low: Floats, high: Floats, arcs: Sequence[_Arc]) -> tuple[Floats, float]:
    """Arc lengths (l + m,) at which straights and arcs, which are before those, begin, and that of the whole."""
    number = {arc.corner: m for m, arc in enumerate(arcs)}
    out, at = np.zeros(len(low) + len(arcs)), 0.0
    for k in range(len(low)):
        if k in number:
            out[len(low) + number[k]] = at
            at += 2 * arcs[number[k]].radius * arcs[number[k]].half
        out[k] = at
        at += float(high[k] - low[k])
    return out, at
