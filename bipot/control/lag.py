r"""How far friction lags behind slip that turns: the part of the error of an increment that is of order one.

Friction opposes the mean slip of the whole increment, but acts as the force of its end. Where slip turns in the
surface, as under a tool that twists while it presses, friction lags by half the angle that slip turns by in the
increment. The lag is a force d, and it has the energy L,

    d = (r_t - |r_t| t_0) / 2 . 2 h/(h + h_0),        L = sum_c |d . du|,

with t_0 the direction of friction in the last increment, turned with the tool, du the displacement of the body's point
beyond that of a body that supports and tools carry, and h, h_0 the lengths of this increment and the last one at one
pace; the factor 2 h/(h + h_0) is there because directions belong to the middles of increments. Points that stick, land
or slide back do not count. In a plane slip cannot turn.

The relative error of the force is

    (L + D f) / (W + D),        f = sum_c |d| / sum_c r_n,

with W the work of strain and D that of friction. Where strain does the work it is L/W, the part of the body's power,
and so of the force that strains it, that the lag changes. Where friction does the work, as under a lid that spins on a
body which it no longer strains, L and W are remainders of zero and their ratio means nothing; the friction that lags is
then the part f of the force that presses the lid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.increment import Solved
from bipot.state import State
from bipot.tensors import norm
from bipot.typing import Floats

LEAST_SLIP = 1e-6
"""A slip smaller than this, over the motion expected in the increment, is that of a point that sticks."""


class Lag(NamedTuple):
    """The energy L of an increment's lag, the part f of friction, and the work D of friction (module docstring)."""

    energy: float = 0.0
    part: float = 0.0
    friction: float = 0.0

    def share(self, strained: float) -> float:
        """The relative error of the force, where strain does the work W = ``strained``."""
        work = strained + self.friction
        return (self.energy + self.friction * self.part) / work if work > 0 else 0.0


def lag(start: State, solved: Solved) -> Lag:
    """The lag of the increment ``solved`` from the accepted ``start``; none from rest."""
    iterate = solved.iterate
    increment = iterate.increment
    contacts, length = increment.system.candidates, increment.tau - start.tau
    if start.nodes.shape[1] == 2 or not start.length > 0:
        return Lag()
    now = contacts.vectors(_tangential(solved.r), iterate.frames)
    then = contacts.vectors(_tangential(start.forces), contacts.frames_at(start.nodes, increment.tools.placed))
    # Turned as the tools turn that the parts meet.
    then, normals = contacts.faces.turned(then, iterate.advance), iterate.frames[:, 0]
    then = then - np.vecdot(then, normals)[:, None] * normals
    slides = norm(iterate.motion[:, 1:]) > LEAST_SLIP * increment.units.length
    counted = slides[contacts.parts.owner] & (np.vecdot(now, then) > 0)
    now, then = now[counted], then[counted]
    ratio = norm(now) / norm(then)
    behind = (now - ratio[:, None] * then) * (length / (length + increment.past.length))
    beyond = contacts.met.motion(solved.response.du - increment.tools.gone)[counted]
    pressed = float(np.abs(contacts.parts.spread(solved.r)[counted, 0]).sum())
    return Lag(
        energy=float(np.abs(np.vecdot(behind, beyond)).sum()),
        part=float(norm(behind).sum()) / pressed if pressed > 0 else 0.0,
        friction=float(np.abs(np.vecdot(solved.r[:, 1:], iterate.motion[:, 1:])).sum()),
    )


def _tangential(r: Floats) -> Floats:
    """Forces r (c, d) without their normal components."""
    return np.column_stack([np.zeros(len(r)), r[:, 1:]])
