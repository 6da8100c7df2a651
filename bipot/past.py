"""The increment before, as the next one sees it: at its own pace."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from bipot.response import State
from bipot.scene.paces import Paces
from bipot.typing import Floats


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
