"""What ``docs/conic_set.md`` quotes."""

from __future__ import annotations

from studies.quoted.filling import Quoted
from studies.quoted.results import Line, Results, digits, word

LOOSE = 1e-6


def _left(results: Results) -> list[Line]:
    """Programs that QOCO leaves above 1e-6."""
    return [row for row in results.rows("conic_solved", solver="qoco") if float(row["residual"]) > LOOSE]


def _of_two_scenes(results: Results) -> bool:
    left = _left(results)
    return all(str(row["id"]).startswith(("wedge", "extrusion")) and "-dissipation-" in str(row["id"]) for row in left)


QUOTED = Quoted(
    values={
        "least_cones": lambda results: digits(min(results.column("conic_solved", "cones")), 6),
        "most_cones": lambda results: digits(max(results.column("conic_solved", "cones")), 6),
        "left": lambda results: word(len(_left(results))),
        "left_cones": lambda results: digits(min(float(row["cones"]) for row in _left(results)), 6),
    },
    claims={
        "Forty programs of": lambda results: len(results.rows("conic_set")) == 40,
        "`dissipation` programs of the wedge and of extrusion": _of_two_scenes,
    },
)
