"""Signals that wait: for code that cannot be left in the middle of."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

WAITING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGALRM") if hasattr(signal, name)]


@contextmanager
def undisturbed() -> Iterator[None]:
    """Ctrl-C, SIGTERM and the alarm clock reach this thread when the block ends, and processes started in it never.

    An exception that their handlers raise is lost in what compiled code calls back, or ends the interpreter there. Only
    in the first thread do handlers run. Where the system knows no such waiting, as on Windows, nothing changes.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, WAITING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
