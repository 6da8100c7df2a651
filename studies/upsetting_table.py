"""The table that the study of the upsetting prints: a line a run, how far it is from the law, and what to warn of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bipot.results import History
from studies.run_names import element_of, side_of

ENERGY_WARNING = 0.01
"""Work and energies that differ by more than this fraction of the work are warned of."""

LINE = "{:>6} {:>8} {:>4} {:>10} {:>10} {:>10} {:>9} {:>6} {:>6} {:>5} {:>9} {:>9} {:>9} {:>9} {:>8}"
HEADER = (
    *("mu", "element", "side", "reduction", "force_N", "R_max_mm", "volume", "incr", "passes", "cuts"),
    *("equil.", "cone", "gap", "overlap", "seconds"),
)
MEANINGS = (
    "side: elements along a side of the modelled part",
    "equil., cone, gap: worst equilibrium, cone violation and relative bipotential gap of the run",
    "overlap: deepest that an edge goes into the punch, between its nodes too, over the body size",
    "seconds: of the increments",
)


@dataclass(frozen=True)
class Result:
    """A complete run: Coulomb coefficient, and what it left behind."""

    mu: float
    history: History

    @property
    def line(self) -> str:
        """Its line of the table."""
        history = self.history
        return LINE.format(
            f"{self.mu:g}",
            element_of(history),
            side_of(history) or "",
            f"{history['reduction'][-1]:.4f}",
            f"{history['force_N'][-1]:.2f}",
            f"{history['max_radius_mm'][-1]:.5f}",
            f"{history['volume_ratio'][-1]:.6f}",
            len(history),
            history["passes"].sum(),
            history["cuts"].sum(),
            *(f"{history[name].max():.1e}" for name in ("equilibrium", "cone_violation", "relative_gap", "overlap")),
            f"{history['seconds'].sum():.1f}",
        )

    @property
    def warning(self) -> str:
        """Run and worst ``energy_error`` in words where that is above :data:`ENERGY_WARNING`; else empty."""
        error = self.history["energy_error"]
        worst = int(np.abs(error).argmax())
        if abs(error[worst]) <= ENERGY_WARNING:
            return ""
        at = f"of the work at {100 * self.history['reduction'][worst]:.1f} % reduction, {element_of(self.history)}"
        return f"warning: mu = {self.mu:g}: energy_error = {100 * error[worst]:.2f} % {at}; use more increments"


def table(results: Sequence[Result]) -> str:
    """Header, a line a run, what the columns mean, and a line a warning."""
    warnings = [result.warning for result in results if result.warning]
    return "\n".join([LINE.format(*HEADER), *(result.line for result in results), *MEANINGS, *warnings])
