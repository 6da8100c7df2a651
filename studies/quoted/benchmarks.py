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
    """A pass of newton costs at most a tenth more than the unit on 10 x 10, and less on larger meshes."""
    passes = results.column("bench", "ratio", name="pass", form="newton", elements=(10.0, 40.0, 80.0))
    return passes[0] < 1.1 and sorted(passes, reverse=True) == passes


def _met(results: Results) -> list[float]:
    return [float(row["error"]) for row in results.rows("block_ratio") if float(row["ratio"]) >= AIM]


def _finest(results: Results, program: str, column: str) -> str:
    """Of the most accurate run on the finest mesh of a program."""
    rows = results.rows("block_total", program=program, outcome="solved")
    unknowns = max(float(row["unknowns"]) for row in rows)
    best = min((row for row in rows if row["unknowns"] == unknowns), key=lambda row: float(row["force_error"]))
    return digits(float(best[column]), 6)


QUOTED = Quoted(
    values={
        "increments_01": lambda results: _increments(results, 0.1),
        "increments_03": lambda results: _increments(results, 0.3),
        "kappa_least": lambda results: digits(min(_kappa(results))),
        "kappa_most": lambda results: digits(max(_kappa(results))),
        "update": lambda results: _over(results, "transfer", "transfer, new object"),
        "deviator": lambda results: _over(results, "solve", "solve, plastic variable"),
        "met": lambda results: percent(_met(results)[0]),
        "own_increments": lambda results: _finest(results, "bipot", "increments"),
        "own_passes": lambda results: _finest(results, "bipot", "passes"),
        "foreign_increments": lambda results: _finest(results, "CalculiX", "increments"),
        "foreign_passes": lambda results: _finest(results, "CalculiX", "passes"),
    },
    claims={
        "costs about the unit on 10 x 10 and less on larger meshes": _passes_fall,
        "% alone: H8/P0 takes more elements": lambda results: len(_met(results)) == 1,
    },
)
