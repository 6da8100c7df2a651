"""What ``docs/coulomb.md`` quotes."""

from __future__ import annotations

from studies.quoted.filling import Quoted
from studies.quoted.results import Results, digits


def _problems(results: Results) -> str:
    return digits(len({row["id"] for row in results.rows("coulomb/solved")}), 6)


QUOTED = Quoted(values={"problems": _problems, "of_these": _problems})
