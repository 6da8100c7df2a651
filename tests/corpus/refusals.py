"""What holds of every damaged file: refused in words that name it, within limits."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tests.corpus.case import Case
from tests.corpus.child import Answer, Child, Outcome

SECONDS, MEGABYTES, CHARACTERS = 1.0, 100.0, 600
"""What the refusal of any file may take, and say."""


def refused(reader: str, valid: Path, cases: Sequence[Case]) -> dict[Case, Answer]:
    """Asserts that the reader refuses every case, by file and field; gives its answers."""
    with Child(reader, valid) as child:
        answers = {case: child.ask(case.path) for case in cases}
    wrong = {case.kind: answer for case, answer in answers.items() if not _clear(case, answer)}
    assert not wrong, wrong
    assert sum(answer.megabytes for answer in answers.values()) < MEGABYTES
    return answers


def _clear(case: Case, answer: Answer) -> bool:
    named = case.path.name in answer.message and case.field in answer.message
    small = answer.seconds < SECONDS and answer.megabytes < MEGABYTES and len(answer.message) < CHARACTERS
    return answer.outcome is Outcome.REFUSED and named and small
