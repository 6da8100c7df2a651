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
from functools import wraps
from types import FrameType
from typing import Any, ParamSpec, TextIO

from bipot.errors import BipotError
from studies import INTERRUPTED, STOPPED

REFUSED = 2
"""Exit code of input that is refused, of a march that stopped, and of results that cannot be kept."""

AGAIN = 1.0
"""Seconds after a signal in which a second one means the same: terminals and ``timeout`` send two."""

Arguments = ParamSpec("Arguments")


def command(main: Callable[Arguments, int]) -> Callable[Arguments, int]:
    """A study's ``main`` that returns an exit code where it was stopped, and says why in one sentence on stderr.

    130 after Ctrl-C or SIGTERM; 2 after an error of the library, an output that cannot be written, a process that died
    and memory that did not suffice. A standard output that nobody reads any more ends nothing.
    """

    @wraps(main)
    def guarded(*given: Arguments.args, **named: Arguments.kwargs) -> int:
        try:
            with stoppable(), flushed():
                return main(*given, **named)
        except KeyboardInterrupt:
            return _ended(STOPPED, INTERRUPTED)
        except BrokenProcessPool:
            return _ended("error: a process of the study died: was it killed, or out of memory?", REFUSED)
        except MemoryError as error:
            return _ended(f"error: out of memory{f' ({error})' if str(error) else ''}", REFUSED)
        except (BipotError, OSError) as error:
            return _ended(f"error: {error}", REFUSED)

    return guarded


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


@contextmanager
def stoppable() -> Iterator[None]:
    """Ctrl-C and SIGTERM raise KeyboardInterrupt once; a later one, should that have been lost, ends the process.

    In another thread than the first nothing changes, because there no signal arrives.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    began: list[float] = []

    def stop(number: int, frame: FrameType | None) -> None:
        if not began:
            began.append(time.monotonic())
            raise KeyboardInterrupt
        if time.monotonic() - began[0] > AGAIN:
            _ended(STOPPED, INTERRUPTED)
            os._exit(INTERRUPTED)

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    # What is ignored stays so: a shell starts jobs in the background without Ctrl-C.
    own = {number: handler for number, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    try:
        for number in own:
            signal.signal(number, stop)
        yield
    finally:
        for number, handler in own.items():
            signal.signal(number, handler)


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
