"""A study in a process of its own, which reports its increments and may be killed or cut short on its way."""

from __future__ import annotations

import contextlib
import io
import os
import resource
import signal
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bipot.results import Recorder
from studies import upsetting

RUN = ("--mu", "0.3", "--elements", "2", "--increments", "6", "--form", "newton")
FOLDER = "mu0.3"
LONGEST = 60
"""Seconds that a study is waited for; one that takes longer counts as crashed."""


@dataclass(frozen=True)
class Ended:
    """How a study ended: its wait status, the increments it had reported on disk, what it said."""

    status: int
    reported: int
    said: str

    @property
    def killed(self) -> bool:
        """By SIGKILL, as asked."""
        return os.WIFSIGNALED(self.status) and os.WTERMSIG(self.status) == signal.SIGKILL

    @property
    def crashed(self) -> bool:
        """By another signal."""
        return os.WIFSIGNALED(self.status) and not self.killed

    def refused(self, code: int) -> bool:
        """In words, with the exit code."""
        ended = os.WIFEXITED(self.status) and os.WEXITSTATUS(self.status) == code
        return ended and "Traceback" not in self.said


class Study:
    """A study in a process of its own, forked from this one, which has imported everything."""

    def __init__(self, out: Path, *options: str, before: Callable[[], None] | None = None) -> None:
        self._reports, reporting = os.pipe()
        self._words, saying = os.pipe()
        self._reported = 0
        self.process = os.fork()
        if self.process == 0:
            try:
                _child([*RUN, *options, "--out", str(out)], saying, reporting, before)
            finally:
                os._exit(1)
        os.close(reporting)
        os.close(saying)

    def report(self) -> bool:
        """Wait for the next increment to be reported; False where the study has ended."""
        told = os.read(self._reports, 1)
        self._reported += len(told)
        return bool(told)

    def ended(self) -> Ended:
        """Wait for its end."""
        while self.report():
            pass
        os.close(self._reports)
        with os.fdopen(self._words) as words:
            said = words.read()
        return Ended(os.waitpid(self.process, 0)[1], self._reported, said)


def _child(arguments: list[str], saying: int, reporting: int, before: Callable[[], None] | None) -> None:
    """The study, and the end of its process with its exit code."""
    with os.fdopen(saying, "w") as words, contextlib.redirect_stderr(words), contextlib.redirect_stdout(io.StringIO()):
        code = 1
        try:
            signal.alarm(LONGEST)
            _report(reporting)
            if before is not None:
                before()
            code = upsetting.main(arguments)
        except BaseException:
            traceback.print_exc()
        words.flush()
        os._exit(code)


def _report(reports: int) -> None:
    """From now on every increment is told when it is on disk; every other one waits for the next."""
    real, write = Recorder.record, os.write

    def record(self: Recorder, accepted: Any) -> None:
        before = self.on_disk
        self.patience = LONGEST if accepted.number % 2 else 0.0
        real(self, accepted)
        write(reports, b"." * (self.on_disk - before))

    Recorder.record = record  # type: ignore[method-assign]


def killing(number: int) -> Callable[[], None]:
    """SIGKILL at that system call of the writing; half a write is done."""

    def before() -> None:
        done = 0

        def stepping(real: Callable[..., Any], *, halved: bool = False) -> Callable[..., Any]:
            def step(*arguments: Any, **named: Any) -> Any:
                nonlocal done
                done += 1
                if done == number:
                    if halved:
                        real(arguments[0], arguments[1][: len(arguments[1]) // 2])
                    os.kill(os.getpid(), signal.SIGKILL)
                return real(*arguments, **named)

            return step

        os.write = stepping(os.write, halved=True)  # type: ignore[assignment]
        for name in ("replace", "open"):
            setattr(os, name, stepping(getattr(os, name)))
        for name in ("unlink", "open"):
            setattr(Path, name, stepping(getattr(Path, name)))

    return before


def limited(size: int) -> Callable[[], None]:
    """Files of so many bytes at most, as of a disk that is full."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
