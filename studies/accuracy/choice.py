"""What the study of the total error runs, and by what it tells one run from another."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

OWN, FOREIGN = "bipot", "CalculiX"
ACCURACY, INCREMENTS, PLAIN = "accuracy", "increments", "plain"


class Pace(NamedTuple):
    """Increments of ``bipot``: by ``accuracy``, or where it is zero so many after a start-up, or without if ``plain``.

    >>> str(Pace(accuracy=1e-3)), str(Pace(increments=40)), Pace.of("4 plain increments")
    ('accuracy 0.001', '40 increments', Pace(accuracy=0.0, increments=4, plain=True))
    """

    accuracy: float = 0.0
    increments: int = 0
    plain: bool = False

    def __str__(self) -> str:
        if self.accuracy:
            return f"{ACCURACY} {self.accuracy:g}"
        return f"{self.increments} {PLAIN + ' ' if self.plain else ''}{INCREMENTS}"

    @classmethod
    def of(cls, words: str) -> Pace:
        """The one of which these are the words."""
        first, *rest = words.split()
        return cls(accuracy=float(rest[0])) if first == ACCURACY else cls(increments=int(first), plain=PLAIN in rest)


@dataclass(frozen=True)
class Choice:
    """A run: program, form, discretisation and schedule by their names; of ``bipot`` the words of a :class:`Pace`."""

    mu: float
    program: str
    form: str
    element: str
    quadrature: str
    layout: str
    contact: str
    elements: int
    schedule: str


def job_of(name: str, argv: Sequence[str] | None) -> tuple[Choice, list[float]]:
    """The choice and the marks that the command line of ``studies.accuracy.NAME`` asks for."""
    parser = argparse.ArgumentParser(
        prog=f"studies.accuracy.{name}", description="One run in a process of its own.", allow_abbrev=False
    )
    parser.add_argument("job", metavar="JOB", type=_job, help="a choice and the marks, as JSON: [{...}, 0.1, ...]")
    return parser.parse_args(argv).job


def _job(text: str) -> tuple[Choice, list[float]]:
    try:
        choice, *marks = json.loads(text)
        return Choice(**choice), [float(mark) for mark in marks]
    except (TypeError, ValueError) as error:
        raise argparse.ArgumentTypeError(f"{text!r} must be a choice and marks, as JSON ({error})") from error
