"""What ``docs/benchmarks.md`` quotes."""

from __future__ import annotations

from studies.quoted.filling import Quoted
from studies.quoted.results import Results, digits, percent

AIM = 3.0
"""How many times faster than CalculiX at equal error a body in space should be."""


def _increments(results: Results, mu: float) -> str:
    (count,) = set(results.column("bench_errors", "increments", mu=mu))
    return digits(count, 6)


def _over(results: Results, name: str, other: str) -> str:
    """Seconds of one row of the dissipation form over those of another."""
    one, two = (results.one("bench", "seconds", name=f"dissipation {which}") for which in (name, other))
    return digits(one / two)


def _kappa(results: Results) -> list[float]:
    """Milliseconds of kappa at 10 x 10, one a march."""
    return [1e3 * value for value in results.column("bench", "kappa_s", elements=10.0) if value > 0]


def _passes_fall(results: Results) -> bool:
    """A pass of newton costs more than the unit on 10 x 10, and the less the larger the mesh is."""
    passes = results.column("bench", "ratio", name="pass", form="newton", elements=(10.0, 40.0, 80.0))
    return passes[0] > 1 > passes[1] and sorted(passes, reverse=True) == passes


def _coarse(results: Results, name: str) -> str:
    """Of newton on 10 x 10 once yield has spread."""
    return digits(results.one("bench", "ratio", name=name, form="newton", elements=10.0))


def _exceeded(results: Results) -> bool:
    """Both histories of newton, and its pass on 10 x 10, are above the limits in the page's table."""
    histories = results.column("bench", "ratio", name="history", form="newton")
    limits = zip([*histories, float(_coarse(results, "pass"))], (60.0, 130.0, 0.9), strict=True)
    return all(measured > most for measured, most in limits)


def _met(results: Results, ratio: str = "ratio") -> list[float]:
    return [float(row["error"]) for row in results.rows("block_ratio") if float(row[ratio]) >= AIM]


def _alone(results: Results) -> float:
    """Seconds of the quicker run of the block with a single element of H20."""
    return min(results.column("block_total", "seconds", element="h20", elements=1.0))


def _theirs(results: Results) -> float:
    """Seconds of CalculiX's quickest run of the block."""
    return min(float(row["foreign_seconds"]) for row in results.rows("block_ratio"))


def _error(results: Results, element: str, elements: float) -> str:
    """Of the better run of the block with so many elements a side."""
    return percent(min(results.column("block_total", "force_error", element=element, elements=elements)))


def _few(results: Results) -> bool:
    """At mu = 0.3, 8, 12 and 16 elements a side."""
    passes = results.column("space", "passes_an_increment", mu=0.3, elements=(8.0, 12.0, 16.0))
    return len(passes) == 3 and max(passes) <= 5


def _once(results: Results) -> bool:
    """At mu = 0.1 increments take one pass, which costs most of kappa on eight elements a side, within the limit."""
    passes, ratios = (results.column("space", name, mu=0.1) for name in ("passes_an_increment", "pass_over_kappa"))
    return max(passes) == 1 and ratios[0] == max(ratios) <= 1.3


QUOTED = Quoted(
    values={
        "increments_01": lambda results: _increments(results, 0.1),
        "increments_03": lambda results: _increments(results, 0.3),
        "kappa_least": lambda results: digits(min(_kappa(results))),
        "kappa_most": lambda results: digits(max(_kappa(results))),
        "pass_coarse": lambda results: _coarse(results, "pass"),
        "build_coarse": lambda results: _coarse(results, "split build"),
        "increment_coarse": lambda results: _coarse(results, "increment"),
        "passes_coarse": lambda results: _coarse(results, "passes an increment"),
        "update": lambda results: _over(results, "transfer", "transfer, new object"),
        "deviator": lambda results: _over(results, "solve", "solve, plastic variable"),
        "met_most": lambda results: percent(max(_met(results))),
        "met_least": lambda results: percent(min(_met(results))),
        "met_process": lambda results: percent(max(_met(results, "process_ratio"))),
        "one_pass": lambda results: digits(results.one("space", "pass_over_kappa", mu=0.1, elements=8.0), 3),
        "whole_per_cent": lambda results: digits(
            results.one("block_pressure", "passes_an_increment", mu=0.3, layout="fanned", elements=16.0)
        ),
        "alone": lambda results: digits(_alone(results), 1),
        "theirs": lambda results: digits(_theirs(results), 1),
        "quadratic": lambda results: _error(results, "h20p1", 3.0),
        "linear": lambda results: _error(results, "h8p0", 12.0),
        "band": lambda results: percent(max(results.column("block_total", "band"))),
    },
    claims={
        "where a factorisation costs least beside all else": _once,
        "all meshes take at most the five passes that are asked": _few,
        "units on 10 x 10, and less than one on larger meshes": _passes_fall,
        "**Three limits are exceeded** in this table": _exceeded,
        "% alone), not above: there a march": lambda results: (
            _met(results) == [0.005, 0.0025, 0.001]
            and _met(results, "process_ratio") == [0.001]
            and _theirs(results) < _alone(results)
        ),
    },
)
