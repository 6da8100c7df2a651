r"""The threshold's fixed point s <- mu r_n(s), damped when it oscillates.

Undamped it contracts by about 0.1 to 0.2 a pass in upsetting, but it can cycle although the solution is unique. A
component oscillates when its last two steps have opposite signs and the later is not clearly the smaller.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SHRINK = 0.7
LEAST = 0.1


@dataclass(frozen=True)
class Threshold:
    """Current threshold s (f,), its last step (f,), and the damping factor in (0, 1] of the next."""

    value: Floats
    step: Floats
    damping: float = 1.0

    @staticmethod
    def start(value: Floats) -> Threshold:
        """From the forces of the last accepted state."""
        return Threshold(value, np.zeros_like(value))

    def update(self, target: Floats) -> Threshold:
        """Move towards ``target`` = mu r_n of the last pass; welded points stay at inf."""
        finite = np.isfinite(self.value)
        step = np.where(finite, target - np.where(finite, self.value, 0.0), 0.0)
        damping = self.damping
        if step @ self.step < 0 and np.linalg.norm(step) > SHRINK * np.linalg.norm(self.step):
            damping = max(damping / 2, LEAST)
        return Threshold(np.where(finite, self.value + damping * step, self.value), step, damping)
