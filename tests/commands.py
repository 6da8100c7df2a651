"""Commands in sessions of their own, as a terminal runs them, and which processes live."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[1]
STOPPED = "stopped; what was computed is on disk\n"
DEADLINE = 120.0
"""Seconds that nothing here takes, however loaded the machine is."""


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
