"""Ctrl-C and SIGTERM while a study runs: one KeyboardInterrupt, where it does no harm, and an end in any case."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from types import FrameType
from typing import Any

from studies import leave

STOPS = (signal.SIGINT, signal.SIGTERM)
AGAIN, PATIENCE = 0.1, 2.0
"""Seconds after which the clock asks again for what a signal has asked, and after which it does not ask any more."""


@dataclass
class Stop:
    """What a signal does that asks to stop: it raises KeyboardInterrupt, once.

    Not in an import: compiled modules make other exceptions of it, or forget it. The clock asks again until that is
    over, and where the interrupt was lost elsewhere it ends the process. ``came`` is when a signal came first.
    """

    came: float | None = None
    raised: bool = False
    _clock: Any = None

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """A signal, or the clock."""
        now = time.monotonic()
        if self.came is None:
            self.came = now
            self._ask_again()
        if now - self.came > PATIENCE:
            leave(number, frame)
        if not (self.raised or _importing(frame)):
            self.raised = True
            raise KeyboardInterrupt

    def _ask_again(self) -> None:
        if hasattr(signal, "setitimer"):
            self._clock = signal.signal(signal.SIGALRM, self)
            signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)

    def over(self) -> None:
        """The study has ended: nothing is asked any more."""
        if self._clock is not None:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, self._clock)


_known: list[Stop] = []
"""Of the studies that run, the innermost last."""


def checkpoint() -> None:
    """Raise KeyboardInterrupt if a signal has come, for it may have been taken for another error where it was raised.

    What was computed since then is not to be kept.
    """
    if _known and _known[-1].came is not None:
        raise KeyboardInterrupt


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Ctrl-C and SIGTERM become a :class:`Stop`; in another thread than the first nothing does, none arrives there."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = {number: signal.getsignal(number) for number in STOPS}
    # What is ignored stays so: a shell starts jobs in the background without Ctrl-C.
    own = {number: handler for number, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    told, alone = sys.unraisablehook, leave in own.values()
    try:
        sys.unraisablehook = partial(_unraisable, stop, told)
        for number in own:
            signal.signal(number, stop)
        _known.append(stop)
        yield stop
    finally:
        _known[:] = [known for known in _known if known is not stop]
        stop.over()
        # Where the study is all that runs, it has its exit code now, and nothing more to tell after a stop.
        for number, handler in own.items():
            signal.signal(number, signal.SIG_IGN if handler is leave else handler)
        if stop.came is None or not alone:
            sys.unraisablehook = told


def _unraisable(stop: Stop, told: Callable[[Any], Any], found: Any) -> None:
    """An exception where none can be raised, as in a destructor: Python tells of it with a traceback, and goes on.

    The interrupt is one of those at times: then the clock raises it once more. Others may be what it led to.
    """
    if stop.came is None:
        told(found)
    elif issubclass(found.exc_type, KeyboardInterrupt):
        stop.raised = False


def _importing(frame: FrameType | None) -> bool:
    """Whether the code that was interrupted runs because something is imported."""
    while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None
