"""The increment before, as the next one sees it: at its own pace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.contact.closeness import NEXT_TO
from bipot.programs.data import ContactRows
from bipot.scene.paces import BEGINNING, Paces
from bipot.schedule import ROUND_OFF
from bipot.state import State
from bipot.system import System
from bipot.typing import Floats, max_abs


@dataclass(frozen=True)
class Past:
    """The increment that led to ``start``, where the ``paces`` of paths and loads may change; none between kinks."""

    start: State
    paces: Paces

    @property
    def turns(self) -> bool:
        """Whether rates of paths and loads come into other proportions at the start."""
        return self.paces.is_turn(self.start.tau)

    @cached_property
    def quicker(self) -> float:
        """How many times as fast as before all goes on (:mod:`bipot.scene.paces`); 1 after a turn."""
        return self.paces.factor(self.start.tau)

    @property
    def length(self) -> float:
        """Its length in pseudo-time at the pace of the next one."""
        return self.start.length / self.quicker

    @property
    def rates(self) -> Floats:
        """Its rates (a d + m,), of nodes and translations, at the pace of the next one."""
        return self.quicker * self.start.rates


def past_of(system: System, start: State, tau: float, rows: Callable[[], ContactRows]) -> Past:
    """The increment that led to the start of one to ``tau``; to the beginning of a path, that was one of another path.

    What a tool does that carries nothing at the start, and that the body does not come to whether it rests or goes on,
    turns nothing for the body: a strip goes on through rolls when a pusher stops that it has left behind. The contact
    ``rows`` of the increment are made only where a kink asks.
    """
    scene, contacts = system.body.scene, system.candidates
    if start.tau == 0:
        return Past(start, BEGINNING)
    if not any(abs(kink - start.tau) <= ROUND_OFF for kink in scene.kinks):
        return Past(start, Paces((), ()))
    going = (tau - start.tau) * start.rates
    posed = rows()
    there = posed.motion(system.body.space.gather(going))[:, 0]
    gap = np.minimum.reduce([start.gap, posed.gap, there])
    # Tools that carry forces, or come to do so.
    felt = contacts.owned & (start.forces.any(axis=1) | (gap <= NEXT_TO * max_abs(going)))
    return Past(start, scene.paces(felt.any(axis=1)))
