"""A reader in a process of its own: what comes of a file, in which time and memory, even if it ends the interpreter."""

from __future__ import annotations

import importlib
import multiprocessing
import sys
import time
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Self

HUNG = 20.0
"""Seconds after which a file that is still being read counts as never read."""


class Outcome(StrEnum):
    ACCEPTED = "accepted"
    REFUSED = "refused"
    RAW = "raw"
    DIED = "died"
    HUNG = "hung"


@dataclass(frozen=True)
class Answer:
    """Outcome, message of the error, seconds of the processor, and by how many megabytes the peak of memory rose."""

    path: Path
    outcome: Outcome
    message: str = ""
    seconds: float = 0.0
    megabytes: float = 0.0


class Child:
    """Reads files by ``reader``, ``"module:function"`` of a path, one by one; starts anew where one ended it.

    ``valid`` is a file that is read first, so that what imports and caches take is nobody's.
    """

    def __init__(self, reader: str, valid: Path) -> None:
        self.reader, self.valid = reader, valid

    def __enter__(self) -> Self:
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def ask(self, path: Path) -> Answer:
        """What comes of the file."""
        self._pipe.send(path)
        try:
            if self._pipe.poll(HUNG):
                return self._pipe.recv()
            outcome = Outcome.HUNG
        except EOFError:
            outcome = Outcome.DIED
        self.__exit__()
        code = self._process.exitcode
        self._start()
        return Answer(path, outcome, f"exit code {code}", HUNG if outcome is Outcome.HUNG else 0.0)

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, there = context.Pipe()
        self._process = context.Process(target=serve, args=(there, self.reader), daemon=True)
        self._process.start()
        there.close()
        self._pipe.send(self.valid)
        first = self._pipe.recv()
        assert first.outcome is Outcome.ACCEPTED, first


def serve(pipe, reader: str) -> None:
    """The child's side: paths in, answers out."""
    module, function = reader.split(":")
    read = getattr(importlib.import_module(module), function)
    while True:
        path = pipe.recv()
        before, start = peak(), time.process_time()
        outcome, message = _read(read, path)
        pipe.send(Answer(path, outcome, message, time.process_time() - start, peak() - before))


def _read(read, path: Path) -> tuple[Outcome, str]:
    from bipot.errors import BipotError

    try:
        read(path)
    except BipotError as error:
        return Outcome.REFUSED, f"{type(error).__name__}: {error}"
    except BaseException as error:
        return Outcome.RAW, f"{type(error).__name__}: {error}"
    return Outcome.ACCEPTED, ""


def peak() -> float:
    """Megabytes of memory that this process had at most."""
    import resource

    # Told in bytes on macOS, in kilobytes elsewhere.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
