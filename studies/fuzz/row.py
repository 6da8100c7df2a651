"""One line of the fuzz study's table, and the table on disk."""

from __future__ import annotations

import csv
import errno
import io
import os
import time
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from enum import Enum
from pathlib import Path

from bipot.errors import ResultsError
from studies.files import replacing, require_writable, sentence
from studies.outputs import readable
from studies.stopping import checkpoint


class Outcome(Enum):
    """How a scene or problem ended. WRONG, RAW (an exception the library did not raise on purpose) and WARNING fail."""

    CERTIFIED = "certified"
    REFUSED = "refused"
    WRONG = "wrong"
    RAW = "raw exception"
    WARNING = "warning"


FAILURES = (Outcome.WRONG.value, Outcome.RAW.value, Outcome.WARNING.value)


@dataclass(frozen=True)
class Row:
    """One scene or problem. The worst numbers are those of the run as drawn, ``worst_disagreement`` of its variants."""

    seed: int
    kind: str
    form: str
    outcome: Outcome
    reason: str
    increments: int
    worst_residual: float
    worst_law: float
    worst_disagreement: float
    seconds: float


def ended(known: Iterator[Row]) -> Row:
    """The last row of those that tell ever more of one scene or problem, with its time; what is raised ends it."""
    began, row = time.perf_counter(), next(known)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for told in known:
                row = told
    except Exception as error:
        outcome = Outcome.WARNING if isinstance(error, Warning) else Outcome.RAW
        row = replace(row, outcome=outcome, reason=f"{type(error).__name__}: {error}")
    return replace(row, seconds=time.perf_counter() - began)


def concluded(
    row: Row,
    wrong: Sequence[str],
    refused: str,
    certified: str,
    *,
    increments: int,
    residuals: Iterable[float],
    laws: Iterable[float],
    disagreement: float,
) -> Row:
    """The row of a scene: by what is ``wrong``, why its march was ``refused``, or what is said of a certified one."""
    if wrong:
        outcome, reason = Outcome.WRONG, "; ".join(wrong[:6])
    elif refused:
        outcome, reason = Outcome.REFUSED, refused
    else:
        outcome, reason = Outcome.CERTIFIED, certified
    return replace(
        row,
        outcome=outcome,
        reason=reason,
        increments=increments,
        worst_residual=max(residuals, default=0.0),
        worst_law=max(laws, default=0.0),
        worst_disagreement=disagreement,
    )


HEADER = [f.name for f in fields(Row)]

TWO_WORDS = "solid shaped", "solid regional", "solid parts"
"""Kinds of which the first word is another's."""


def first(kind: str) -> str:
    """Of the words of a kind those that say what was drawn.

    >>> first("solid shaped h8 revolved"), first("solid h8")
    ('solid shaped', 'solid')
    """
    return next((words for words in TWO_WORDS if f"{kind} ".startswith(f"{words} ")), kind.split()[0])


class Table:
    """Rows appended to a file as they come; a file that exists is gone on with, unless ``afresh``.

    Raises:
        ResultsError: the file cannot be read or written, or is another table.
    """

    def __init__(self, path: Path, *, afresh: bool = False) -> None:
        self.path, self.outcomes = path, Counter[str]()
        self.done: set[tuple[str, int]] = set()
        require_writable(path.parent)
        with readable(path):
            held = path.read_bytes().decode("utf-8") if path.exists() and not afresh else ""
            # What a kill or a full disk has left of a last line is run again.
            kept = held[: held.rfind("\n") + 1] or _line(HEADER)
            self._read(kept)
        if kept != held:
            with replacing(path) as part:
                part.write_bytes(kept.encode("utf-8"))

    def _read(self, text: str) -> None:
        lines = csv.DictReader(io.StringIO(text, newline=""))
        if lines.fieldnames != HEADER:
            raise ResultsError(f"{self.path}: has other columns: give another --out")
        for line in lines:
            self.done.add((first(line["kind"]), int(line["seed"])))
            self.outcomes[line["outcome"]] += 1

    def add(self, row: Row) -> None:
        """Append a row, whole or not at all; none that was computed when the study had been stopped."""
        checkpoint()
        values = [v.value if isinstance(v, Enum) else v for v in astuple(row)]
        # A reason is one line of the table, whatever the exception wrote.
        line = _line([f"{v:.3g}" if isinstance(v, float) else " ".join(str(v).split()) for v in values])
        with sentence(self.path, "written"), self.path.open("ab", buffering=0) as file:
            end = file.tell()
            try:
                if file.write(line.encode("utf-8")) < len(line.encode("utf-8")):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            except BaseException:
                file.truncate(end)
                raise
        self.done.add((first(row.kind), row.seed))
        self.outcomes[row.outcome.value] += 1

    def has(self, seed: int, counts: Mapping[str, int]) -> int:
        """How many of the first ``counts`` of each kind from ``seed`` on are in the file."""
        return sum(0 <= number - seed < counts.get(kind, 0) for kind, number in self.done)

    @property
    def failed(self) -> bool:
        """Whether a row of the file is a wrong answer, a raw exception or a warning."""
        return any(self.outcomes[name] for name in FAILURES)


def _line(values: Sequence[str]) -> str:
    made = io.StringIO(newline="")
    csv.writer(made).writerow(values)
    return made.getvalue()
