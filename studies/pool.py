"""Jobs in processes of their own that never outlive the one that asked for them.

Ctrl-C reaches every process of a terminal: the workers leave it to their parent, which hands out nothing more and ends
them. A worker whose parent is gone, however that ended, goes too. Workers start afresh instead of as copies: a copy of
a process with threads may find a lock held for ever, and it would inherit what its parent does at a signal.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from multiprocessing import active_children, get_context, parent_process
from typing import Any, TypeVar

from bipot.basics.undisturbed import WAITING, undisturbed

Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD = 4
"""Jobs handed out per process before their results are asked for: few, so that any number of jobs may be given."""

GONE = 1


@dataclass(frozen=True)
class Pool(Executor):
    """Processes that take jobs; their block shuts them down."""

    _executor: ProcessPoolExecutor

    def submit(self, job: Callable[..., Result], /, *arguments: Any, **named: Any) -> Future[Result]:
        """Hand out a job."""
        with undisturbed():
            return self._executor.submit(job, *arguments, **named)


@contextmanager
def processes(workers: int) -> Iterator[Pool]:
    """At most ``workers`` processes, started as jobs are handed out.

    Where the block ends by an exception, Ctrl-C among them, queued jobs are cancelled and running ones killed.
    """
    others = active_children()
    executor = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin)
    try:
        yield Pool(executor)
    except BaseException:
        # Not asked to end: a worker deep in compiled code would not hear it.
        for worker in set(active_children()) - set(others):
            worker.kill()
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def completed(job: Callable[[Item], Result], items: Iterable[Item], workers: int) -> Generator[Result, None, None]:
    """Results of the job as they come, from ``workers`` processes; none: from this one. Items are taken as needed."""
    if workers < 1:
        yield from map(job, items)
        return
    left, waiting = iter(items), set[Future[Result]]()
    with processes(workers) as pool:
        while True:
            waiting.update(pool.submit(job, item) for item in islice(left, AHEAD * workers - len(waiting)))
            if not waiting:
                return
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            # A job that failed ends the block: what the others found comes first.
            for future in sorted(done, key=lambda future: future.exception() is not None):
                yield future.result()


def _begin() -> None:
    """The first thing that a worker does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, WAITING)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    """Wait for the end of the parent, and go without a word: there is nobody to tell."""
    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(GONE)
