"""An iterate with contact forces as Newton sees it: the pieces of the law there, and what is missing to a solution."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bipot.iterate import Iterate
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.pieces import Pieces
from bipot.typing import Floats, max_abs, vdot

BAND_PULL, BAND_GAP = 1e-9, 1e-11
"""Dead band over the largest contact force and the body size: a tenth of the default acceptance bounds."""

FAINT = 1e-14
"""Gaps and slips below this part of the largest place and displacement are round-off of these."""

BAND_LAW = 1e-10
"""Dead band of the gap, as a force over the largest contact force: far below the bound on the law."""


class Point(NamedTuple):
    """An iterate with contact forces r (c, d) as Newton sees it: motion (c, d), pieces of the law, ``miss``, merit.

    ``miss`` (c, d) is the residual of the law, and the merit |(rho - G' r, miss)|, both in units of force.
    """

    iterate: Iterate
    r: Floats
    motion: Floats
    pieces: Pieces
    miss: Floats
    merit: float

    @property
    def error(self) -> float:
        """The merit over the norm of the forces; inf if there are none."""
        present = math.sqrt(vdot(self.r, self.r))
        return self.merit / present if present else np.inf

    def work(self, along: Floats, r: Floats) -> float:
        """Work, along a step (n,), of the body's forces that contact forces r (c, d) leave unbalanced."""
        return float(along @ (self.iterate.residual - self.iterate.rows.forces(r)))

    def landing(self, before: Pieces, driven: Floats) -> float:
        """Work of the elastic stiffness at contacts open ``before`` along ``driven`` (n,), the step of driven tools."""
        depth = np.where(before.closed, 0.0, np.maximum(-self.motion[:, 0], 0.0))
        deeper = -(self.iterate.rows.G_n @ driven)
        return float((before.scale / SOFTENED * depth) @ deeper)


@dataclass(frozen=True)
class Law:
    """The contacts of an increment with their frames and scale (c,): turns iterates into points.

    ``present`` is the largest contact force at the increment's start.
    """

    frames: Frames
    scale: Floats
    present: float

    def point(self, iterate: Iterate, r: Floats, last: Pieces | None) -> Point:
        """The point of an iterate and forces r (c, d), after the ``last`` pieces of the attempt if there are any."""
        rows, motion = iterate.rows, iterate.motion
        largest = max(max_abs(r), self.present)
        gap = np.minimum(BAND_GAP * iterate.increment.units.size, BAND_LAW * largest / self.scale)
        clear = motion
        if last is None:
            # Without forces yet, a gap of 1e-17 is an open contact and such a slip slides: nothing may hold the body.
            places = max(max_abs(iterate.increment.start.nodes), max_abs(iterate.response.du))
            clear = np.where(np.abs(motion) > FAINT * places, motion, 0.0)
        pieces = Pieces.of(rows, clear, r, self.scale, (BAND_PULL * largest, gap), last)
        if iterate.measured is not None:
            pieces = replace(pieces, measured=iterate.measured)
        return self.at(iterate, r, pieces)

    def at(self, iterate: Iterate, r: Floats, pieces: Pieces, residual: Floats | None = None) -> Point:
        """The point of an iterate and forces r (c, d) with these pieces; ``residual`` (n,) is another body's."""
        balance = (iterate.residual if residual is None else residual) - iterate.rows.forces(r)
        miss = pieces.value(iterate.motion, r)
        merit = math.sqrt(float(balance @ balance) + vdot(miss, miss))
        return Point(iterate, r, iterate.motion, pieces, miss, merit)

    def frames_at(self, iterate: Iterate) -> Frames:
        """The contacts' frames at an iterate."""
        return self.frames.turned(iterate.rows) if iterate.increment.system.candidates.curved else self.frames
