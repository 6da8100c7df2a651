"""What a page quotes: values behind numbers, claims in words, and the page with its values made anew."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from bipot.errors import ResultsError
from studies.quoted.results import Results

QUOTED = re.compile(r"([\w.+-]*)<!-- =(\w+) -->")
"""A number, or a word for one, and the name of its value."""


@dataclass(frozen=True)
class Quoted:
    """Of one page: the values by name, and the ``claims``, words of the page that hold by the results."""

    values: Mapping[str, Callable[[Results], str]] = field(default_factory=dict)
    claims: Mapping[str, Callable[[Results], bool]] = field(default_factory=dict)


def written(page: str, quoted: Quoted, results: Results) -> str:
    """The page with its values made anew.

    Raises:
        ResultsError: a marker has no value or no number, a value no marker, or a value is no word that could be one.
    """
    made = {name: value(results) for name, value in quoted.values.items()}
    found = {name for _, name in QUOTED.findall(page)}
    if unknown := sorted(found ^ set(made)):
        raise ResultsError(f"values {unknown}: must be in the page, as <!-- =NAME -->, and in its module")
    for was, name in QUOTED.findall(page):
        if not was or not QUOTED.fullmatch(f"{made[name]}<!-- ={name} -->"):
            raise ResultsError(
                f"value {name}, {made[name]!r} for {was!r}: must be one number or word behind which it is"
            )
    return QUOTED.sub(lambda match: f"{made[match[2]]}<!-- ={match[2]} -->", page)


def broken(page: str, quoted: Quoted, results: Results) -> list[str]:
    """Claims that are not in the page, or that the results do not show."""
    words = " ".join(QUOTED.sub(r"\1", page).split())
    return [claim for claim, holds in quoted.claims.items() if claim not in words or not holds(results)]
