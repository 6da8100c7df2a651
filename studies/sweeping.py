"""Points of a sweep computed by any executor, none lost with a worker that dies.

An executor of processes is of no use once one of them was killed: every job that it held fails, whether the dead
process was at it or not. What was in flight is then done again in a new executor, one job at a time: the one with which
this breaks as well has killed its worker, and is told so. Executors that replace their workers themselves, as Dask's
does, never break.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, TypeVar

Point = TypeVar("Point")
Result = TypeVar("Result")

DIED = "the process that computed it died, and another one as well: was it killed, or out of memory?"


@dataclass(frozen=True)
class Lost:
    """Why there is no result of a point: what the executor raised, in words."""

    reason: str


class Here(Executor):
    """Computes in the process that asks."""

    def submit(self, job: Callable[..., Result], /, *arguments: Any, **named: Any) -> Future[Result]:
        """The job, done: its result or what it raised."""
        done: Future[Result] = Future()
        try:
            done.set_result(job(*arguments, **named))
        except Exception as failure:
            done.set_exception(failure)
        return done


class Broken(Exception):
    """An executor broke: the ``suspects`` were in flight, what is ``left`` was not handed out yet."""

    def __init__(self, suspects: list[Any], left: list[Any]) -> None:
        super().__init__(suspects, left)
        self.suspects, self.left = suspects, left


def sweep(
    points: Iterable[Point], executor: Executor, job: Callable[[Point], Result], ahead: int | None = None
) -> Generator[tuple[Point, Result | Lost], None, None]:
    """Yield each point with its result, or why there is none, as they come.

    ``ahead`` is how many are handed out at a time, by default all.

    Raises:
        Broken: the executor is of no more use; names the points without result.
    """
    left, held = deque(points), dict[Future[Result], Point]()
    try:
        while left or held:
            while left and (ahead is None or len(held) < ahead):
                held[executor.submit(job, left[0])] = left[0]
                left.popleft()
            done, _ = wait(held, return_when=FIRST_COMPLETED)
            # What was computed before an executor broke comes first.
            for future in sorted(done, key=lambda future: isinstance(_failure(future), BrokenExecutor)):
                yield held[future], _outcome(future)
                del held[future]
    except BrokenExecutor as broken:
        raise Broken(list(held.values()), list(left)) from broken


def lasting(
    points: Iterable[Point],
    executors: Callable[[], AbstractContextManager[Executor]],
    job: Callable[[Point], Result],
    ahead: int | None = None,
) -> Generator[tuple[Point, Result | Lost], None, None]:
    """As :func:`sweep`, with a new one of the ``executors`` wherever one broke."""
    left = list(points)
    while left:
        try:
            with executors() as executor:
                yield from sweep(left, executor, job, ahead)
            return
        except Broken as broken:
            suspects, left = broken.suspects, broken.left
        while suspects:
            try:
                with executors() as executor:
                    yield from sweep(suspects, executor, job, 1)
                break
            except Broken as broken:
                yield from ((guilty, Lost(DIED)) for guilty in broken.suspects)
                suspects = broken.left


def _failure(future: Future[Any]) -> BaseException | None:
    return CancelledError() if future.cancelled() else future.exception()


def _outcome(future: Future[Result]) -> Result | Lost:
    """Raises BrokenExecutor; what else the executor or the job raised is the point's own."""
    failure = _failure(future)
    if isinstance(failure, BrokenExecutor) or (failure is not None and not isinstance(failure, Exception)):
        raise failure
    return future.result() if failure is None else Lost(f"{type(failure).__name__}: {failure}".rstrip(": "))
