"""An end to runs that take too long in one increment, whose halves of halves may take minutes before they fail."""

from __future__ import annotations

import time

from bipot.increment import Observer, Trial


class Late(Exception):
    """A run has taken longer than it may."""


def until(seconds: float) -> Observer:
    """An observer that raises :class:`Late` after so many ``seconds`` of processor time from now on."""
    began = time.process_time()

    def observe(trial: Trial) -> None:
        if time.process_time() - began > seconds:
            raise Late

    return observe
