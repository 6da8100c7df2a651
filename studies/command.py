"""How a study's command line ends: by an exit code and at most one sentence, whatever stopped it."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import wraps
from types import FrameType
from typing import Any, ParamSpec, TextIO

from bipot.errors import BipotError
from studies import INTERRUPTED, STOPPED, leave
from studies.pool import STOPS

REFUSED = 2
"""Exit code of input that is refused, of a march that stopped, and of results that cannot be kept."""

AGAIN, PATIENCE = 0.1, 2.0
"""Seconds after which the clock asks again for what a signal has asked, and after which it does not ask any more."""

Arguments = ParamSpec("Arguments")


def command(main: Callable[Arguments, int]) -> Callable[Arguments, int]:
    """A study's ``main`` that returns an exit code where it was stopped, and says why in one sentence on stderr.

    130 after Ctrl-C or SIGTERM; 2 after an error of the library, an output that cannot be written, a process that died
    and memory that did not suffice. A standard output that nobody reads any more ends nothing.
    """

    @wraps(main)
    def guarded(*given: Arguments.args, **named: Arguments.kwargs) -> int:
        stop = Stop()
        try:
            with stoppable(stop), flushed():
                return main(*given, **named)
        except KeyboardInterrupt:
            return _ended(STOPPED, INTERRUPTED)
        except Exception as error:
            # Compiled modules make another exception of the interrupt that reaches them.
            if stop.came is not None:
                return _ended(STOPPED, INTERRUPTED)
            if (words := _sentence(error)) is None:
                raise
            return _ended(words, REFUSED)

    return guarded


def _sentence(error: Exception) -> str | None:
    """What is said of an exception; None of one that only a mistake in the study raises."""
    if isinstance(error, BrokenProcessPool):
        return "error: a process of the study died: was it killed, or out of memory?"
    if isinstance(error, MemoryError):
        return f"error: out of memory ({error})" if str(error) else "error: out of memory"
    return f"error: {error}" if isinstance(error, BipotError | OSError) else None


def say(text: str, to: TextIO | None = None) -> None:
    """Print a line, at once; where nobody reads it any more, the study goes on without."""
    stream = sys.stdout if to is None else to
    try:
        print(text, file=stream, flush=True)
    except BrokenPipeError:
        _mute(stream)


@contextmanager
def flushed() -> Iterator[None]:
    """What was printed is out when the block ends, so that a full disk under it is seen, and a closed pipe is not."""
    try:
        yield
    finally:
        if sys.stdout is not None:
            try:
                sys.stdout.flush()
            except BrokenPipeError:
                _mute(sys.stdout)


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
            _ended(STOPPED, INTERRUPTED)
            os._exit(INTERRUPTED)
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


@contextmanager
def stoppable(stop: Stop) -> Iterator[None]:
    """Ctrl-C and SIGTERM go to ``stop``. In another thread than the first nothing changes: there no signal arrives."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in STOPS}
    # What is ignored stays so: a shell starts jobs in the background without Ctrl-C.
    own = {number: handler for number, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    try:
        for number in own:
            signal.signal(number, stop)
        yield
    finally:
        stop.over()
        for number, handler in own.items():
            # Where the study is all that runs, it has its exit code now.
            signal.signal(number, signal.SIG_IGN if handler is leave else handler)


def _importing(frame: FrameType | None) -> bool:
    """Whether the code that was interrupted runs because something is imported."""
    while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None


def _ended(words: str, code: int) -> int:
    """Say why, if anybody listens."""
    # A RuntimeError says that a signal came while something else was being printed there.
    with suppress(OSError, RuntimeError):
        print(" ".join(words.split()), file=sys.stderr, flush=True)
    return code


def _mute(stream: Any) -> None:
    """Let what is left in the stream go nowhere, now and when Python ends."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
