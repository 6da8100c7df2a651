"""Supports of a body: fixed ones, driven ones, and planes of symmetry that cut the body.

Each holds the displacement along one direction, an axis or any unit vector. :mod:`bipot.scene.holding` combines several
at one node, and :mod:`bipot.scene.symmetry` checks the rest of a scene against planes of symmetry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.errors import LARGEST_LENGTH, is_whole, require, require_type
from bipot.paths import RAMP, Amplitude, require_bounded, require_components
from bipot.tools import surfaces
from bipot.typing import Vector, make_floats


@dataclass(frozen=True)
class Support:
    """The displacement along ``direction`` is zero on the mesh boundary ``boundary``; nodes are free to move across it.

    A direction is the number of an axis, 0, 1 or, in space, 2, or a unit vector, in a plane (cos a, sin a).
    """

    boundary: str
    direction: int | Vector

    def __post_init__(self) -> None:
        require_type(self.boundary, str, "support.boundary")
        if isinstance(self.direction, tuple | list | np.ndarray):
            object.__setattr__(self, "direction", surfaces.direction(self.direction, "support.direction"))
        else:
            known = "0, 1 or, in space, 2, or a unit vector"
            right = is_whole(self.direction) and self.direction in (0, 1, 2)
            require(right, "support.direction", self.direction, known)
            object.__setattr__(self, "direction", int(self.direction))

    def at(self, tau: float) -> float:
        """The displacement at pseudo-time ``tau``."""
        return 0.0

    def along(self, dimension: int) -> Vector:
        """The direction as a unit vector in this dimension, exactly along an axis if it is so to round-off.

        Raises:
            SceneError: an axis that does not exist, or a vector with another number of components.

        >>> Support("top", 1).along(2), Support("top", (-0.6, 0.8)).along(2), Support("top", (6e-17, -1.0)).along(2)
        ((0.0, 1.0), (-0.6, 0.8), (0.0, -1.0))
        """
        if isinstance(self.direction, tuple):
            require_components(self.direction, dimension, "support.direction")
            parts = np.where(np.abs(self.direction) <= surfaces.ACROSS, 0.0, self.direction)
            return tuple((np.sign(parts) if np.count_nonzero(parts) == 1 else parts).tolist())
        axes = list(range(dimension))
        require(self.direction < dimension, "support.direction", self.direction, f"one of {axes}, as the mesh has")
        return tuple(float(self.direction == k) for k in axes)


@dataclass(frozen=True)
class Prescribed(Support):
    """A support that moves: the displacement along ``direction`` is ``displacement`` times the ``amplitude``."""

    displacement: float = 0.0
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        super().__post_init__()
        make_floats(self, "displacement", of="prescribed.")
        require(bool(np.isfinite(self.displacement)), "prescribed.displacement", self.displacement, "finite")
        require_bounded(self.displacement, self.amplitude, "prescribed.displacement", LARGEST_LENGTH)
        require(self.amplitude.at(0.0) == 0, "prescribed.amplitude", self.amplitude.points, "zero at tau = 0")

    def at(self, tau: float) -> float:
        """The displacement at pseudo-time ``tau``."""
        return self.displacement * self.amplitude.at(tau)


@dataclass(frozen=True)
class Symmetry(Support):
    """The mesh boundary ``boundary`` is in a plane across ``direction``, beyond which the mirror image was cut away.

    The displacement along ``direction`` is zero there, as at a support. Supports, tools and loads of a scene are those
    on the modelled part, and their mirror images act on its mirror image.
    """


def named(vector: Vector) -> str:
    """A unit vector in words: the number of its axis, or its components.

    >>> named((0.0, 1.0)), named((0.6, -0.8)), named((0.0, 0.6, -0.8))
    ('1', '(0.6, -0.8)', '(0, 0.6, -0.8)')
    """
    if 1.0 in vector:
        return str(vector.index(1.0))
    return f"({', '.join(f'{part:g}' for part in vector)})"
