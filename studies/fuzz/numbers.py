"""Numbers that scenes of the fuzz study share: coefficients of friction and gaps at rest, from ordinary to extreme."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from studies.fuzz.meshes import Rng


def friction(rng: Rng, shares: Sequence[float]) -> float:
    """None, ordinary, of any size or welded, with probabilities ``shares`` (4)."""
    ordinary, wide = rng.uniform(0.05, 0.6), 10.0 ** rng.uniform(-3, np.log10(3))
    return float(rng.choice([0.0, ordinary, wide, np.inf], p=shares))


def gap_at_rest(rng: Rng, size: float, travel: float, shares: Sequence[float]) -> float:
    """Touching, apart, apart by round-off or inside, with probabilities ``shares`` (4)."""
    choices = [0.0, travel * rng.uniform(0, 0.9), 1e-14 * size, -size * 10.0 ** rng.uniform(-6, -2.5)]
    return float(rng.choice(choices, p=shares))
