"""What ``docs/scenes.md`` quotes."""

from __future__ import annotations

import math
import statistics

from studies.quoted.filling import Quoted
from studies.quoted.results import Results, digits

COARSE, LINEAR = "coarse", "q4p0"
"""How names of scenes begin."""


def _over_asked(results: Results, *kinds: str) -> list[float]:
    """True error over what was asked, in scenes whose names begin so; of the paper's element on its mesh where ""."""
    found = results.rows("paced")
    own = [next((kind for kind in (COARSE, LINEAR) if str(row["scene"]).startswith(kind)), "") for row in found]
    return [
        float(row["true_error"]) / float(row["accuracy"]) for row, kind in zip(found, own, strict=True) if kind in kinds
    ]


def _has_an_error_of_its_own(results: Results) -> bool:
    """At an accuracy of 1e-4 some scenes keep more than twice that."""
    return max(results.column("paced", "true_error", accuracy=1e-4)) > 2e-4


def _ratios(results: Results, accuracy: float) -> list[float]:
    """Passes over those of the cheapest equal increments, where there are any."""
    ratios = results.column("paced", "ratio", accuracy=accuracy)
    return [ratio for ratio in ratios if not math.isnan(ratio)]


def _near(results: Results, accuracy: float) -> list[float]:
    """Passes over those of equal increments about as many as the cheapest, where there are any."""
    own, near = (results.column("paced", name, accuracy=accuracy) for name in ("passes", "near_passes"))
    return [a / b for a, b in zip(own, near, strict=True) if not math.isnan(b)]


def _scatter(results: Results) -> list[float]:
    """Passes of equal increments about as many as the cheapest, over those of the cheapest."""
    rows = [row for row in results.rows("paced") if not math.isnan(float(row["ratio"]))]
    return [float(row["near_passes"]) / float(row["uniform_passes"]) for row in rows]


QUOTED = Quoted(
    values={
        "over_asked_least": lambda results: digits(min(_over_asked(results, "", LINEAR)), 1),
        "over_asked_most": lambda results: digits(max(_over_asked(results, "", LINEAR)), 1),
        "over_asked_coarse": lambda results: digits(min(_over_asked(results, COARSE)), 1),
        "paced_mean_coarse": lambda results: digits(statistics.geometric_mean(_ratios(results, 1e-3)), 2),
        "paced_most_coarse": lambda results: digits(max(_ratios(results, 1e-3)), 3),
        "paced_mean_fine": lambda results: digits(statistics.geometric_mean(_ratios(results, 1e-4)), 3),
        "paced_most_fine": lambda results: digits(max(_ratios(results, 1e-4)), 3),
        "paced_scatter": lambda results: digits(statistics.geometric_mean(_scatter(results)), 3),
        "paced_scatter_most": lambda results: digits(max(_scatter(results)), 3),
        "paced_near_coarse": lambda results: digits(statistics.geometric_mean(_near(results, 1e-3)), 2),
        "paced_near_coarse_most": lambda results: digits(max(_near(results, 1e-3)), 3),
        "paced_near_fine": lambda results: digits(statistics.geometric_mean(_near(results, 1e-4)), 2),
        "paced_near_fine_most": lambda results: digits(max(_near(results, 1e-4)), 3),
    },
    claims={"the first point past first yield has an error of about that size": _has_an_error_of_its_own},
)
