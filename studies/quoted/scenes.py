"""What ``docs/scenes.md`` quotes."""

from __future__ import annotations

from studies.quoted.filling import Quoted
from studies.quoted.results import Results, digits


def _over_asked(results: Results) -> list[float]:
    """True error over what was asked."""
    return [float(row["true_error"]) / float(row["accuracy"]) for row in results.rows("paced")]


def _has_an_error_of_its_own(results: Results) -> bool:
    """At an accuracy of 1e-4 some scenes keep more than twice that."""
    return max(results.column("paced", "true_error", accuracy=1e-4)) > 2e-4


QUOTED = Quoted(
    values={
        "over_asked_least": lambda results: digits(min(_over_asked(results)), 1),
        "over_asked_most": lambda results: digits(max(_over_asked(results)), 1),
    },
    claims={"the first point past first yield has an error of about that size": _has_an_error_of_its_own},
)
