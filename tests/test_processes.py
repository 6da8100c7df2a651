"""However a study ends, its processes end with it: one sentence, an exit code, and what was computed stays."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from bipot.undisturbed import undisturbed
from studies import pool

ROOT = Path(__file__).parents[1]
STOPPED = "stopped; what was computed is on disk\n"
DEADLINE = 120.0
"""Seconds that nothing here takes, however loaded the machine is."""
NEVER = 10**9
STUDIES = [
    f"{folder}.{path.stem}"
    for folder in ("studies", "benchmarks")
    for path in sorted((ROOT / folder).glob("*.py"))
    if "__main__" in path.read_text(encoding="utf-8") and path.stem != "paired_tasks"
]

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks the system who is alive")


def until(condition):
    """Wait for a condition; its value."""
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.02)
    raise AssertionError("waited in vain")


def parent_of(pid):
    """Of a process that lives, else None: one that has ended and waits to be counted lives no more."""
    try:
        state, parent = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:2]
    except (FileNotFoundError, ProcessLookupError):
        return None
    return None if state in "ZX" else int(parent)


def alive(pids):
    return {pid for pid in pids if parent_of(pid) is not None}


def children_of(pid):
    numbers = [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]
    return {number for number in numbers if parent_of(number) == pid}


def hearing():
    """A shell that runs these tests in the background lets its jobs ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def running(*command, **more):
    """A command in a session of its own, as a terminal would run it; killed at the end if it still runs."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    started = {"cwd": ROOT, "start_new_session": True, "preexec_fn": hearing}
    with subprocess.Popen([sys.executable, "-m", *map(str, command)], **started, **pipes, **more) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)


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


@pytest.mark.parametrize(("number", "to_all"), [(signal.SIGINT, True), (signal.SIGINT, False), (signal.SIGTERM, False)])
def test_a_stopped_study_says_so_keeps_its_rows_and_leaves_no_process(number, to_all, tmp_path):
    with tiny_study(tmp_path) as process:
        theirs = children_of(process.pid) | workers_of(tmp_path)
        assert len(theirs) >= 2
        (os.killpg if to_all else os.kill)(process.pid, number)
        _, said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, said) == (130, STOPPED)
        until(lambda: not alive(theirs))
    assert rows_of(tmp_path) == [0, 1, 2]


def test_signals_that_come_twice_are_one(tmp_path):
    """A terminal's Ctrl-C reaches all, and ``timeout`` sends its signal twice."""
    with tiny_study(tmp_path) as process:
        for _ in range(3):
            os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, said) == (130, STOPPED)


def test_workers_die_with_a_parent_that_is_killed(tmp_path):
    with tiny_study(tmp_path) as process:
        theirs = children_of(process.pid) | workers_of(tmp_path)
        process.kill()
        until(lambda: not alive(theirs))
        assert "Traceback" not in process.communicate(timeout=DEADLINE)[1]
    assert rows_of(tmp_path) == [0, 1, 2]


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


def test_all_results_come_once_from_more_jobs_than_are_handed_out(tmp_path):
    with running("tests.tiny_study", tmp_path, 2, 50, NEVER) as process:
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (0, "done\n", "")
    assert rows_of(tmp_path) == list(range(50))


def test_jobs_are_taken_as_they_are_needed():
    """Any number may be given: few more are taken than are done."""
    taken = []
    with pool.processes(2) as processes:
        assert processes.submit(abs, -1).result() == 1
    results = pool.completed(abs, (taken.append(k) or k for k in range(10**12)), 2)
    assert len([next(results) for _ in range(20)]) == 20
    results.close()
    assert len(taken) <= 20 + 2 * pool.AHEAD


@pytest.mark.parametrize("study", STUDIES)
def test_ctrl_c_while_a_study_imports_is_a_sentence(study, tmp_path):
    """A numpy that takes for ever to import stands for a slow disk."""
    (tmp_path / "numpy.py").write_text(
        f"import pathlib, time\npathlib.Path({str(tmp_path)!r}, 'x').touch()\ntime.sleep(1e9)"
    )
    with running(study, "--help", env=os.environ | {"PYTHONPATH": str(tmp_path)}) as process:
        until((tmp_path / "x").exists)
        os.killpg(process.pid, signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)


@pytest.fixture
def planted(tmp_path):
    """Starts a study of these lines, and waits until it says that it is there by a file."""

    @contextmanager
    def start(*lines, **modules):
        for name, text in modules.items():
            (tmp_path / f"{name}.py").write_text(text)
        head = "import pathlib, sys, time\nfrom studies.command import command\n@command\ndef main():\n"
        code = head + "".join(f"    {line}\n" for line in lines) + "if __name__ == '__main__':\n    sys.exit(main())\n"
        (tmp_path / "planted.py").write_text(code)
        with running("planted", env=os.environ | {"PYTHONPATH": str(tmp_path)}) as process:
            until((tmp_path / "there").exists)
            yield process

    return start


def test_ctrl_c_in_an_import_of_a_study_that_runs_waits_for_its_end(planted, tmp_path):
    """A compiled module would make an ImportError of it, or forget it."""
    slow = f"""
import pathlib, time
folder = pathlib.Path({str(tmp_path)!r})
(folder / "there").touch()
try:
    while not (folder / "go").exists():
        time.sleep(0.02)
except KeyboardInterrupt:
    (folder / "disturbed").touch()
"""
    with planted("import slow", "time.sleep(1e9)", slow=slow) as process:
        process.send_signal(signal.SIGINT)
        time.sleep(0.2)
        (tmp_path / "go").touch()
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)
    assert not (tmp_path / "disturbed").exists()


def test_ctrl_c_that_is_swallowed_ends_the_study_all_the_same(planted, tmp_path):
    there = f"pathlib.Path({str(tmp_path)!r}, 'there').touch()"
    lines = ["try:", f"    {there}", "    time.sleep(1e9)", "except KeyboardInterrupt:", "    time.sleep(1e9)"]
    with planted(*lines) as process:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)


def test_ctrl_c_in_a_destructor_is_no_traceback_and_comes_again(planted, tmp_path):
    """Python tells of it as an exception that is ignored."""
    lines = [
        "class Slow:",
        "    def __del__(self):",
        f"        pathlib.Path({str(tmp_path)!r}, 'there').touch()",
        "        time.sleep(1e9)",
        "slow = Slow()",
        "del slow",
        f"pathlib.Path({str(tmp_path)!r}, 'gone on').touch()",
        "time.sleep(1e9)",
    ]
    with planted(*lines) as process:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)
    assert (tmp_path / "gone on").exists()


def test_what_becomes_another_exception_of_ctrl_c_is_no_traceback(planted, tmp_path):
    there = f"pathlib.Path({str(tmp_path)!r}, 'there').touch()"
    lines = [
        "try:",
        f"    {there}",
        "    time.sleep(1e9)",
        "except KeyboardInterrupt:",
        "    raise ImportError('half')",
    ]
    with planted(*lines) as process:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)


def test_a_row_that_an_interrupt_may_have_spoiled_is_not_kept(planted, tmp_path):
    """Compiled code makes a TypeError of an interrupt, and a study takes that for what is wrong with a case."""
    there = f"pathlib.Path({str(tmp_path)!r}, 'there').touch()"
    row = "hard_cases.Row('case', 'form', 'crashed', False, 0, 0, 0, 0, 0.0, 0.0)"
    lines = [
        "from studies import hard_cases, outputs",
        f"folder = pathlib.Path({str(tmp_path)!r})",
        "table = outputs.opened(folder, 'x', hard_cases.Row, hard_cases.key, outputs.Existing.REFUSE, parameters={})",
        "try:",
        f"    {there}",
        "    time.sleep(1e9)",
        "except KeyboardInterrupt:",
        f"    table.add({row})",
    ]
    with planted(*lines) as process:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)
    assert not (tmp_path / "x.csv").exists()


def test_who_imports_library_or_studies_keeps_the_handlers_of_signals():
    code = (
        "import signal; both = signal.SIGINT, signal.SIGTERM; before = [signal.getsignal(n) for n in both];"
        "import bipot, studies.fuzz, benchmarks; assert before == [signal.getsignal(n) for n in both]"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_a_study_that_is_called_leaves_the_handlers_as_they_were(tmp_path):
    before = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    from studies import fuzz

    assert fuzz.main(["--scenes", "0", "--coulomb", "0", "--out", str(tmp_path)]) == 0
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] == before


def test_a_real_study_in_processes_stops_at_ctrl_c_and_goes_on(tmp_path):
    command = ["studies.fuzz", "--scenes", "0", "--jobs", "2", "--out", tmp_path, "--coulomb"]
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


def test_a_signal_waits_for_the_end_of_what_is_undisturbed():
    came = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: came.append(number))
    try:
        with undisturbed():
            with undisturbed():
                # To this thread: one that another takes, such as that of a test runner, is not kept.
                signal.pthread_kill(threading.get_ident(), signal.SIGTERM)
            inside = list(came)
        assert (inside, came) == ([], [signal.SIGTERM])
    finally:
        signal.signal(signal.SIGTERM, before)
