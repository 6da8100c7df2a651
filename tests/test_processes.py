"""However a study ends, its processes end with it: one sentence, an exit code, and what was computed stays."""

import os
import signal
from contextlib import contextmanager
from pathlib import Path

import pytest

from studies import pool
from tests.commands import DEADLINE, STOPPED, alive, children_of, running, until

NEVER = 10**9

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks the system who is alive")


def workers_of(folder):
    return {int(path.stem) for path in folder.glob("*.pid")}


def rows_of(folder):
    return sorted(map(int, (folder / "rows").read_text().split())) if (folder / "rows").exists() else []


@contextmanager
def tiny_study(folder, workers=2, jobs=NEVER, waiting=3):
    """Two workers that have finished three jobs and are at the next ones."""
    with running("tests.tiny_study", folder, workers, jobs, waiting) as process:
        until(lambda: len(rows_of(folder)) >= waiting and len(workers_of(folder)) == workers)
        yield process


@pytest.mark.parametrize(
    ("number", "to_all"),
    [
        (signal.SIGINT, True),
        pytest.param(signal.SIGINT, False, marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, False, marks=pytest.mark.slow),
    ],
)
def test_a_stopped_study_says_so_keeps_its_rows_and_leaves_no_process(number, to_all, tmp_path):
    with tiny_study(tmp_path) as process:
        theirs = children_of(process.pid) | workers_of(tmp_path)
        assert len(theirs) >= 2
        (os.killpg if to_all else os.kill)(process.pid, number)
        _, said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, said) == (130, STOPPED)
        until(lambda: not alive(theirs))
    assert rows_of(tmp_path) == [0, 1, 2]


@pytest.mark.slow
def test_signals_that_come_twice_are_one(tmp_path):
    """A terminal's Ctrl-C reaches all, and ``timeout`` sends its signal twice."""
    with tiny_study(tmp_path) as process:
        for _ in range(3):
            os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, said) == (130, STOPPED)


@pytest.mark.slow
def test_workers_die_with_a_parent_that_is_killed(tmp_path):
    with tiny_study(tmp_path) as process:
        theirs = children_of(process.pid) | workers_of(tmp_path)
        process.kill()
        until(lambda: not alive(theirs))
        assert "Traceback" not in process.communicate(timeout=DEADLINE)[1]
    assert rows_of(tmp_path) == [0, 1, 2]


@pytest.mark.slow
def test_a_worker_that_dies_ends_the_study_with_a_sentence(tmp_path):
    with tiny_study(tmp_path) as process:
        theirs = workers_of(tmp_path)
        os.kill(min(theirs), signal.SIGKILL)
        _, said = process.communicate(timeout=DEADLINE)
        assert process.returncode == 2
        assert said == "error: a process of the study died: was it killed, or out of memory?\n"
        until(lambda: not alive(theirs))


@pytest.mark.parametrize("workers", [0, 2])
def test_a_job_that_fails_ends_the_study_with_its_own_sentence(workers, tmp_path):
    with running("tests.tiny_study", tmp_path, workers, 20, -1) as process:
        _, said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, said) == (2, "error: job refused\n")
    # Results that came with the failure are kept, and nothing was handed out twice.
    assert len(set(rows_of(tmp_path))) == len(rows_of(tmp_path)) > 10


@pytest.mark.slow
def test_all_results_come_once_from_more_jobs_than_are_handed_out(tmp_path):
    with running("tests.tiny_study", tmp_path, 2, 50, NEVER) as process:
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (0, "done\n", "")
    assert rows_of(tmp_path) == list(range(50))


@pytest.mark.slow
def test_jobs_are_taken_as_they_are_needed():
    """Any number may be given: few more are taken than are done."""
    taken = []
    with pool.processes(2) as processes:
        assert processes.submit(abs, -1).result() == 1
    results = pool.completed(abs, (taken.append(k) or k for k in range(10**12)), 2)
    assert len([next(results) for _ in range(20)]) == 20
    results.close()
    assert len(taken) <= 20 + 2 * pool.AHEAD


@pytest.mark.slow
def test_a_real_study_in_processes_stops_at_ctrl_c_and_goes_on(tmp_path):
    command = [
        "studies.fuzz",
        "--scenes",
        "0",
        "--shaped",
        "0",
        "--solid",
        "0",
        "--solid-shaped",
        "0",
        "--regional",
        "0",
        "--solid-regional",
        "0",
        "--parts",
        "0",
        "--solid-parts",
        "0",
        "--jobs",
        "2",
        "--out",
        tmp_path,
        "--coulomb",
    ]
    table = tmp_path / "fuzz.csv"
    with running(*command, NEVER) as process:
        until(lambda: table.exists() and table.read_text().count("\n") > 3)
        theirs = children_of(process.pid)
        os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, said) == (130, STOPPED)
        until(lambda: not alive(theirs))
    kept = table.read_text().splitlines()
    with running(*command, 3) as process:
        assert process.communicate(timeout=DEADLINE)[1] == ""
    assert table.read_text().splitlines()[: len(kept)] == kept
