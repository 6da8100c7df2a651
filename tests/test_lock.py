"""One writer a folder: a living owner is named and keeps others out, a dead one does not."""

import json
import os
import signal
import socket
import subprocess
import sys

import pytest

from bipot.errors import ResultsError
from bipot.results.lock import NAME, locked

HOLD = """
import sys, time
from pathlib import Path
from bipot.results.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def owner(tmp_path):
    """Another process that holds the folder."""
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def held(folder):
    with locked(folder):
        return json.loads((folder / NAME).read_text())


def test_a_lock_names_its_owner_and_is_gone_after_it(tmp_path):
    assert held(tmp_path) == {"host": socket.gethostname(), "process": os.getpid()}
    assert list(tmp_path.iterdir()) == []


def test_a_second_writer_is_refused_and_told_who_is_the_first(tmp_path, owner):
    with pytest.raises(ResultsError, match=rf"process {owner.pid} on {socket.gethostname()} is writing a run there"):
        held(tmp_path)


def test_a_second_writer_of_the_same_process_is_refused(tmp_path):
    with locked(tmp_path), pytest.raises(ResultsError, match=f"process {os.getpid()} on .* is writing"):
        held(tmp_path)
    held(tmp_path)


def test_what_a_killed_owner_left_is_taken_over(tmp_path, owner):
    os.kill(owner.pid, signal.SIGKILL)
    owner.wait()
    assert json.loads((tmp_path / NAME).read_text())["process"] == owner.pid
    assert held(tmp_path)["process"] == os.getpid()
    assert list(tmp_path.iterdir()) == []


def test_a_living_process_of_the_number_of_a_dead_owner_keeps_nobody_out(tmp_path):
    (tmp_path / NAME).write_text(json.dumps({"host": socket.gethostname(), "process": 1}))
    assert held(tmp_path)["process"] == os.getpid()


def test_of_another_host_nothing_is_known(tmp_path):
    (tmp_path / NAME).write_text(json.dumps({"host": "elsewhere", "process": 7}))
    with pytest.raises(ResultsError, match=r"process 7 on elsewhere may be writing .* delete .*run\.lock"):
        held(tmp_path)
    (tmp_path / NAME).unlink()
    held(tmp_path)


@pytest.mark.parametrize("text", ["", "nothing", "[1]", "{}", "\x00" * 5000])
def test_a_lock_that_says_nothing_was_never_finished(tmp_path, text):
    (tmp_path / NAME).write_text(text)
    held(tmp_path)


@pytest.mark.parametrize("text", ["[" * 1000, '{"host": ' * 100])
def test_a_lock_that_is_nested_too_deep_says_nothing(tmp_path, text):
    (tmp_path / NAME).write_text(text)
    assert held(tmp_path)["process"] == os.getpid()


@pytest.mark.skipif(not hasattr(os, "O_NOFOLLOW"), reason="the system tells no links from files")
def test_what_a_lock_links_to_is_left_alone(tmp_path):
    precious = tmp_path / "precious"
    precious.write_text("mine")
    (tmp_path / NAME).symlink_to(precious)
    with pytest.raises(OSError, match="symbolic link"):
        held(tmp_path)
    assert precious.read_text() == "mine"


@pytest.mark.slow
def test_of_four_at_once_one_gets_it(tmp_path):
    code = HOLD.replace("time.sleep(60)", "sys.stdin.read()")
    command = [sys.executable, "-c", code, str(tmp_path)]
    piped = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    every = [subprocess.Popen(command, **piped) for _ in range(4)]
    said = []
    for process in every:
        line = process.stdout.readline()
        said.append(line)
    assert said.count("held\n") == 1
    for process in every:
        process.communicate("")
    held(tmp_path)
