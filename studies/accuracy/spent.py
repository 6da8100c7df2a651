"""What a command says, and the processor time that its whole process took."""

from __future__ import annotations

import os
import resource
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

LONGEST = 600.0
"""Seconds that a command is waited for."""

COMPILED = {"PYTHONDONTWRITEBYTECODE": ""}
"""Environment in which Python keeps what it compiles, as it does where nobody says otherwise: a process that is
measured starts as a user's does."""


@dataclass(frozen=True)
class Ended:
    """Output of a command and its processor seconds; ``code`` is None where it took more than :data:`LONGEST`."""

    said: str
    seconds: float
    code: int | None


def ended(command: Sequence[str], folder: Path | None = None) -> Ended:
    """Run a command in a folder (default: this one); no other child of this process may end meanwhile."""
    before = _children()
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=os.environ | COMPILED,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=LONGEST,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Ended("", _children() - before, None)
    return Ended(done.stdout, _children() - before, done.returncode)


def _children() -> float:
    """Processor seconds of all children that have ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime
