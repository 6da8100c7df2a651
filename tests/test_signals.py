"""Ctrl-C at any moment of a study is one sentence and an exit code, and who imports studies keeps its handlers."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from bipot.basics.undisturbed import undisturbed
from tests.commands import DEADLINE, ROOT, STOPPED, running, until

STUDIES = [
    f"{folder}.{path.stem}"
    for folder in ("studies", "benchmarks")
    for path in sorted((ROOT / folder).glob("*.py"))
    if "__main__" in path.read_text(encoding="utf-8") and path.stem != "paired_tasks"
]

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks the system who is alive")


@pytest.mark.parametrize("study", STUDIES)
def test_ctrl_c_while_a_study_imports_is_a_sentence(study, tmp_path):
    """A numpy that takes for ever to import stands for a slow disk.

    It sleeps by short turns: a signal between the last step of the interpreter and a sleep does not end that.
    """
    (tmp_path / "numpy.py").write_text(
        f"import pathlib, time\npathlib.Path({str(tmp_path)!r}, 'x').touch()\nwhile True: time.sleep(0.1)"
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


@pytest.mark.slow
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
    with planted("import slow", "while True: time.sleep(0.1)", slow=slow) as process:
        process.send_signal(signal.SIGINT)
        time.sleep(0.2)
        (tmp_path / "go").touch()
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)
    assert not (tmp_path / "disturbed").exists()


@pytest.mark.slow
def test_ctrl_c_that_is_swallowed_ends_the_study_all_the_same(planted, tmp_path):
    there = f"pathlib.Path({str(tmp_path)!r}, 'there').touch()"
    lines = [
        "try:",
        f"    {there}",
        "    while True: time.sleep(0.1)",
        "except KeyboardInterrupt:",
        "    while True: time.sleep(0.1)",
    ]
    with planted(*lines) as process:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)


@pytest.mark.slow
def test_ctrl_c_in_a_destructor_is_no_traceback_and_comes_again(planted, tmp_path):
    """Python tells of it as an exception that is ignored."""
    lines = [
        "class Slow:",
        "    def __del__(self):",
        f"        pathlib.Path({str(tmp_path)!r}, 'there').touch()",
        "        while True: time.sleep(0.1)",
        "slow = Slow()",
        "del slow",
        f"pathlib.Path({str(tmp_path)!r}, 'gone on').touch()",
        "while True: time.sleep(0.1)",
    ]
    with planted(*lines) as process:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)
    assert (tmp_path / "gone on").exists()


@pytest.mark.slow
def test_what_becomes_another_exception_of_ctrl_c_is_no_traceback(planted, tmp_path):
    there = f"pathlib.Path({str(tmp_path)!r}, 'there').touch()"
    lines = [
        "try:",
        f"    {there}",
        "    while True: time.sleep(0.1)",
        "except KeyboardInterrupt:",
        "    raise ImportError('half')",
    ]
    with planted(*lines) as process:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, *said) == (130, "", STOPPED)


@pytest.mark.slow
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
        "    while True: time.sleep(0.1)",
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
    from studies.fuzz import __main__ as fuzz

    assert (
        fuzz.main(
            [
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
                "--coulomb",
                "0",
                "--out",
                str(tmp_path),
            ]
        )
        == 0
    )
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] == before


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
