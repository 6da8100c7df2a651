"""How a study's command line ends: by an exit code and at most one sentence, whatever stopped it."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from functools import wraps
from typing import Any, ParamSpec, TextIO

from bipot.errors import BipotError
from studies import INTERRUPTED, STOPPED
from studies.progress import Progress, terminal
from studies.stopping import stoppable

REFUSED = 2
"""Exit code of input that is refused, of a march that stopped, and of results that cannot be kept."""

HELP = frozenset({"-h", "--help"})

Arguments = ParamSpec("Arguments")


def command(main: Callable[Arguments, int]) -> Callable[Arguments, int]:
    """A study's ``main`` that returns an exit code where it was stopped, and says why in one sentence on stderr.

    130 after Ctrl-C or SIGTERM; 2 after an error of the library, an output that cannot be written, a process that died
    and memory that did not suffice. A standard output that nobody reads any more ends nothing.
    """

    @wraps(main)
    def guarded(*given: Arguments.args, **named: Arguments.kwargs) -> int:
        try:
            with stoppable() as stop, flushed():
                try:
                    return main(*given, **named)
                except BrokenPipeError:
                    # Before Python 3.11.4 a parser that prints its help into an unbuffered pipe says this.
                    if HELP.isdisjoint(sys.argv):
                        raise
                    _mute(sys.stdout)
                    return 0
                except Exception as error:
                    # Compiled modules make another exception of the interrupt that reaches them.
                    if stop.came is not None:
                        raise KeyboardInterrupt from error
                    raise
        except KeyboardInterrupt:
            return _ended(STOPPED, INTERRUPTED)
        except Exception as error:
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
    """Print a line, at once; where nobody reads it any more, the study goes on without.

    Letters that the stream does not know, as in the name of a folder, are written as their codes.
    """
    stream = sys.stdout if to is None else to
    encoding = getattr(stream, "encoding", None) or "utf-8"
    try:
        print(text.encode(encoding, "backslashreplace").decode(encoding), file=stream, flush=True)
    except BrokenPipeError:
        _mute(stream)


@contextmanager
def progressing(title: str) -> Iterator[Progress]:
    """A bar of this title where the terminal can show one, closed when the block ends."""
    progress = terminal()
    progress.start(title)
    try:
        yield progress
    finally:
        progress.close()


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
