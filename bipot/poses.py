r"""Where a tool is: a pose (3,) is how far it has gone since rest, and by what angle (radians, anticlockwise) turned.

A point X of the tool at rest, which turns about the point C of it, is at

    x = C + a + Q(theta) (X - C),     Q = ((cos, -sin), (sin, cos)),

in the pose (a_1, a_2, theta). Points of the body are seen from the tool where they would be if it rested.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.driving import Moment
from bipot.errors import require, require_number, require_type
from bipot.paths import RAMP, Amplitude
from bipot.surfaces import place
from bipot.typing import Floats

LARGEST_ANGLE, SMALLEST_ANGLE = 1e6, 1e-60
"""In radians: what is smaller takes no point along, however far it is from the centre."""


@dataclass(frozen=True)
class Turn:
    """A tool turns by ``angle`` (radians, anticlockwise) times the ``amplitude`` about ``centre``, which goes with it.

    ``driven_by`` a moment, of which the angle is an unknown, it turns as that asks for: the ``angle`` here is zero.

    Raises:
        SceneError: a centre that is not two finite numbers, an angle that is none, an amplitude that begins elsewhere,
            an angle beside a moment.
    """

    angle: float
    centre: tuple[float, float]
    amplitude: Amplitude = RAMP
    driven_by: Moment | None = None

    def __post_init__(self) -> None:
        require_number(self.angle, "turn.angle")
        object.__setattr__(self, "angle", float(self.angle))
        require_type(self.amplitude, Amplitude, "turn.amplitude")
        for size in (self.angle, self.angle * self.amplitude.largest):
            known = f"of at most {LARGEST_ANGLE:g} radians, and 0 or at least {SMALLEST_ANGLE:g}"
            fits = size == 0 or SMALLEST_ANGLE <= abs(size) <= LARGEST_ANGLE
            require(fits, "turn.angle, its amplitude with it", size, known)
        object.__setattr__(self, "centre", place(self.centre, "turn.centre"))
        require(self.amplitude.at(0.0) == 0, "turn.amplitude", self.amplitude.points, "zero at tau = 0")
        require_type(self.driven_by, Moment, "turn.driven_by", optional=True)
        free = self.driven_by is None or self.angle == 0
        require(free, "turn.angle", self.angle, f"zero where a moment turns the tool, {self.driven_by}")

    def at(self, tau: float) -> float:
        """The angle at pseudo-time ``tau``."""
        return self.angle * self.amplitude.at(tau)

    def arm(self, x: Floats, pose: Floats) -> Floats:
        """Points x (…, d) seen from the centre."""
        return x - self.centre - pose[:2]

    def own(self, x: Floats, pose: Floats) -> Floats:
        """Points x (…, d) as the tool sees them: what the turn takes them along is added, for the centre may be far."""
        return x - pose[:2] + self.arm(x, pose) @ _turned_back(pose[2])

    def going(self, x: Floats, by: Floats, pose: Floats, advance: Floats) -> Floats:
        """What points x (…, d) that go ``by`` (…, d) go by as the tool sees it, while that goes on by ``advance`` (3,).

        To round-off of the motions, not of the places.
        """
        moved = (by - advance[:2]) @ rotation(pose[2] + advance[2])
        return moved + self.arm(x, pose) @ rotation(pose[2]) @ _turned_back(advance[2])

    def carried(self, x: Floats, pose: Floats, advance: Floats) -> Floats:
        """How far (…, d) the turn alone takes the tool's points at x (…, d), half the way from ``pose`` on."""
        return 2 * np.sin(advance[2] / 2) * across(self.arm(x, pose) - advance[:2] / 2)


def _turned_back(angle: float) -> Floats:
    """Q - 1 (d, d), by which vectors v as rows change as v @ Q turns them back: no difference of numbers about one."""
    less = -2 * np.sin(angle / 2) ** 2
    return np.array([[less, -np.sin(angle)], [np.sin(angle), less]])


def across(vectors: Floats) -> Floats:
    """Vectors (…, d) turned by a right angle anticlockwise.

    >>> across(np.array([2.0, 1.0])).tolist()
    [-1.0, 2.0]
    """
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def pose_size(dimension: int) -> int:
    """How many numbers a pose has: a displacement and the angles about the axes there are.

    >>> pose_size(2), pose_size(3)
    (3, 6)
    """
    return dimension * (dimension + 1) // 2


def rotation(angle: float) -> Floats:
    """Q(theta) (d, d): vectors v as rows are v @ Q' turned, and v @ Q turned back.

    >>> (np.array([1.0, 0.0]) @ rotation(np.pi / 2).T).round(12).tolist()
    [0.0, 1.0]
    """
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
