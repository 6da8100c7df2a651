"""Where the points of a sweep are computed: in this process, in processes of its own, or on a cluster of Dask."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from importlib.util import find_spec

from bipot.errors import require
from studies.pool import processes
from studies.sweeping import Here

Executors = Callable[[], AbstractContextManager[Executor]]

DASK = "dask:"
PATIENCE = 10
"""Seconds in which a scheduler of Dask must answer."""


def chosen(jobs: int | None, text: str | None) -> tuple[Executors, int | None]:
    """How executors are made, and how many points one is handed at a time (None: all).

    ``jobs`` processes (None or 1: this one), or where a ``text`` is given what it names, ``dask:ADDRESS``.

    Raises:
        SceneError: both; another text; Dask is not installed.
    """
    if text is None:
        return (partial(processes, jobs), jobs) if jobs is not None and jobs > 1 else (partial(nullcontext, Here()), 1)
    require(jobs is None, "--jobs", jobs, "left out with --executor, whose workers compute")
    address = text.removeprefix(DASK)
    require(text.startswith(DASK) and bool(address), "--executor", text, f"{DASK}ADDRESS, as {DASK}tcp://HOST:8786")
    require(find_spec("distributed") is not None, "--executor", text, "of installed packages: pip install bipot[dask]")
    # The scheduler hands points out as workers are free, and again where one has died.
    return partial(_dask, address), None


@contextmanager
def _dask(address: str) -> Iterator[Executor]:
    """The workers of a scheduler; raises OSError where there is none. Jobs are given up where the block ends."""
    from distributed import Client

    with Client(address, timeout=PATIENCE, set_as_default=False) as client:
        # Each point is its own: none is taken for one that was computed before.
        yield client.get_executor(pure=False)
