"""What the benchmarks must show: limits on the rows of bench.csv and bench_errors.csv, in their own units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.rows import Row


@dataclass(frozen=True)
class Limit:
    """Largest ratio allowed to the row of this name, form, coefficient and size."""

    name: str
    form: str
    mu: float
    elements: int
    most: float


LIMITS = (
    Limit("history", "newton", 0.1, 10, 60.0),
    Limit("history", "tangent", 0.1, 10, 250.0),
    Limit("history", "newton", 0.3, 10, 130.0),
    Limit("history", "tangent", 0.3, 10, 600.0),
    *(Limit("worst error", form, 0.1, 10, 1e-3) for form in ("newton", "tangent")),
    *(Limit("worst error", form, 0.3, 10, 2e-3) for form in ("newton", "tangent")),
    *(Limit("rms error", form, 0.3, 10, 1e-3) for form in ("newton", "tangent")),
    Limit("pass", "newton", 0.1, 10, 0.9),
    Limit("pass", "newton", 0.1, 40, 1.2),
    Limit("pass", "newton", 0.1, 80, 1.2),
    Limit("pass", "tangent", 0.1, 10, 2.5),
    Limit("pass", "tangent", 0.1, 40, 3.0),
    Limit("passes an increment", "newton", 0.1, 10, 3.0),
    Limit("passes an increment", "newton", 0.1, 40, 4.0),
    Limit("fine passes an increment", "newton", 0.3, 40, 6.0),
    Limit("fine fallbacks", "newton", 0.3, 40, 2.0),
    Limit("growth over factorisation", "newton", 0.1, 80, 1.0),
    Limit("growth over factorisation", "tangent", 0.1, 80, 1.0),
    Limit("dissipation overhead", "dissipation", 0.3, 10, 0.2),
    Limit("peak memory in GB", "newton", 0.1, 80, 1.0),
    Limit("memory growth in GB", "newton", 0.1, 80, 0.05),
)


def verdicts(rows: Sequence[Row]) -> list[tuple[Limit, float | None]]:
    """Each limit with what was measured, None where nothing was."""
    found = {(row.name, row.form, row.mu, row.elements): row.ratio for row in rows}
    return [(limit, found.get((limit.name, limit.form, limit.mu, limit.elements))) for limit in LIMITS]
