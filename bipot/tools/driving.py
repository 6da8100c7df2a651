"""Driving forces and moments of tools."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bipot.errors import LARGEST_STRESS, require
from bipot.paths import RAMP, Amplitude, require_bounded, vector
from bipot.typing import Floats, make_floats


@dataclass(frozen=True)
class Force:
    """A force that drives a tool: ``vector`` (d,) times the ``amplitude``, on the whole tool.

    A zero force, or one whose amplitude returns to zero, would leave the position of the tool undetermined: it is
    refused.
    """

    vector: tuple[float, ...]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", vector(self.vector, "force.vector"))
        require(any(self.vector), "force.vector", self.vector, "not zero: without a force use the tool's path")
        require_bounded(self.size, self.amplitude, "force.vector", LARGEST_STRESS)
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


@dataclass(frozen=True)
class Moment:
    """A moment that turns a tool: ``value``, anticlockwise on it, times the ``amplitude``; with zero it rolls freely.

    It acts about the centre of the tool's turn, in plane strain per unit of thickness (in units of force). The tool
    exerts it on the body, :meth:`bipot.control.accepted.Accepted.tool_moment`.

    Raises:
        SceneError: a value that is no finite number, or whose magnitude requires other units.
    """

    value: float
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        make_floats(self, "value", of="moment.")
        require_bounded(self.value, self.amplitude, "moment.value", LARGEST_STRESS)

    def at(self, tau: float) -> float:
        """The moment at pseudo-time ``tau``."""
        return self.value * self.amplitude.at(tau)
