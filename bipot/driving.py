"""What drives tools where no path does: forces."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bipot.errors import LARGEST_STRESS, require, require_magnitude, require_type
from bipot.paths import RAMP, Amplitude, vector
from bipot.typing import Floats


@dataclass(frozen=True)
class Force:
    """What drives a tool: the force ``vector`` (d,) times the ``amplitude``, on the whole tool.

    A force without a direction, or one that would let go of the body (an amplitude that comes back to zero) leaves
    the tool's place open: it is refused.
    """

    vector: tuple[float, ...]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", vector(self.vector, "force.vector"))
        require_type(self.amplitude, Amplitude, "force.amplitude")
        require(any(self.vector), "force.vector", self.vector, "not zero: without a force use the tool's path")
        for size in (self.size, self.size * self.amplitude.largest):
            require_magnitude(size, "force.vector, its amplitude with it", LARGEST_STRESS)
        allowed = "above zero after tau = 0, where it is not below: to let go, drive the tool by a path alone"
        later = all(multiple > 0 for tau, multiple in self.amplitude.points if tau > 0)
        require(later and self.amplitude.at(0.0) >= 0, "force.amplitude", self.amplitude.points, allowed)

    @property
    def size(self) -> float:
        """|vector|."""
        return math.hypot(*self.vector)

    @property
    def direction(self) -> Floats:
        """The unit vector (d,) of the force."""
        return np.array(self.vector) / self.size

    def at(self, tau: float) -> float:
        """The force along its direction at pseudo-time ``tau``."""
        return self.size * self.amplitude.at(tau)
