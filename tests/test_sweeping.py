"""The sweep of any function of its points through any executor, and what becomes of points whose process dies."""

import os
import signal
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from functools import partial

import pytest

from benchmarks import sweep_jobs
from benchmarks.sweep_jobs import Row, ratio
from bipot.errors import NotConverged
from studies.pool import processes
from studies.sweeping import DIED, Here, Lost, lasting
from studies.sweeping import sweep as swept


def square(number):
    if number < 0:
        raise NotConverged("below zero")
    return number**2


def deadly(number, folder):
    """One ends its process, whenever it is tried; all leave a mark of each try."""
    with (folder / str(number)).open("a") as file:
        file.write("tried\n")
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


class Given(Executor):
    """Takes one job and gives the future that it was made with."""

    def __init__(self, failure):
        self.failure = failure

    def submit(self, job, /, *arguments, **named):
        future = Future()
        if self.failure is None:
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_exception(self.failure)
        return future


@pytest.mark.parametrize("executor", [Here(), ThreadPoolExecutor(2)], ids=["here", "threads"])
@pytest.mark.parametrize("ahead", [None, 1, 3])
def test_any_executor_takes_a_sweep(executor, ahead):
    found = dict(swept(range(-1, 6), executor, square, ahead))
    assert found == {-1: Lost("NotConverged: below zero")} | {k: k**2 for k in range(6)}


@pytest.mark.parametrize(
    ("failure", "words"),
    [(None, CancelledError.__name__), (OSError("gone"), "OSError: gone")],
    ids=["given up", "gone"],
)
def test_what_an_executor_raises_is_the_points_reason(failure, words):
    assert list(swept([1], Given(failure), square)) == [(1, Lost(words))]


@pytest.mark.slow
def test_a_process_that_is_killed_costs_no_point_but_the_one_that_kills_it_again(tmp_path):
    found = dict(lasting(range(6), partial(processes, 2), partial(deadly, folder=tmp_path), 2))
    assert found == {k: k**2 for k in range(6)} | {1: Lost(DIED)}
    tries = {int(path.name): len(path.read_text().split()) for path in tmp_path.iterdir()}
    assert tries[1] == 2
    assert max(tries.values()) <= 2


def test_the_ratio_is_that_of_the_best():
    rows = [Row(jobs, 2, 0, seconds) for jobs, seconds in ((1, 9.0), (1, 8.0), (2, 4.0), (2, 5.0))]
    assert ratio(rows) == 2.0


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="needs two cores")
def test_two_processes_are_faster_than_one(tmp_path):
    """The ratio of the benchmark's own limit needs a quiet machine: python -m benchmarks.sweep_jobs."""
    assert sweep_jobs.main(["--elements", "6", "--least", "1.3", "--out", str(tmp_path)]) == 0
