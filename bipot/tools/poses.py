r"""Poses of tools: displacement since rest, and angles of rotation (radians, anticlockwise).

A point X at rest of a tool that turns about its point C is at

    x = C + a + Q(theta) (X - C),     Q = ((cos, -sin), (sin, cos)),

in the pose (a_1, a_2, theta). In space a tool turns about an axis through C, the unit vector e: its pose is
(a, theta e), of six numbers, and Q = 1 + sin(theta) E + (1 - cos(theta)) E^2 with E v = e x v. In the tool's own frame
points of the body are where they would be if the tool rested.

A pose has p numbers, (p,) in shapes and (k, p) for k tools: three in a plane and six in space. Forces and moments may
drive a tool: part of its pose is then unknown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bipot.errors import LARGEST_LENGTH, LARGEST_STRESS, require, require_type
from bipot.paths import RAMP, Amplitude, require_bounded, require_components, vector
from bipot.tensors import norm
from bipot.tools.plane import leftwards
from bipot.tools.surfaces import direction
from bipot.typing import Floats, make_floats

LARGEST_ANGLE, SMALLEST_ANGLE = 1e6, 1e-60
"""In radians; an angle below the second moves no point, however far it is from the centre."""


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

    @property
    def size(self) -> float:
        """|value|."""
        return abs(self.value)

    def at(self, tau: float) -> float:
        """The moment at pseudo-time ``tau``."""
        return self.value * self.amplitude.at(tau)


@dataclass(frozen=True)
class Turn:
    """A turn by ``angle`` (radians, anticlockwise) times the ``amplitude`` about ``centre``, which moves with the tool.

    In space the centre is three numbers and the ``axis`` through it a unit vector, about which the tool turns by the
    right-hand rule. A turn ``driven_by`` a moment has an unknown angle, and the ``angle`` here is zero.

    Raises:
        SceneError: a centre that is not two finite numbers, or three in space, an axis in a plane, none in space or no
            unit vector, an angle out of range, an amplitude that is not zero at tau = 0, an angle beside a moment.
    """

    angle: float
    centre: tuple[float, ...]
    amplitude: Amplitude = RAMP
    driven_by: Moment | None = None
    axis: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        make_floats(self, "angle", of="turn.")
        require_type(self.amplitude, Amplitude, "turn.amplitude")
        for size in (self.angle, self.angle * self.amplitude.largest):
            allowed = f"of at most {LARGEST_ANGLE:g} radians, and 0 or at least {SMALLEST_ANGLE:g}"
            fits = size == 0 or SMALLEST_ANGLE <= abs(size) <= LARGEST_ANGLE
            require(fits, "turn.angle, its amplitude with it", size, allowed)
        object.__setattr__(self, "centre", vector(self.centre, "turn.centre", LARGEST_LENGTH))
        self._check_axis()
        require(self.amplitude.at(0.0) == 0, "turn.amplitude", self.amplitude.points, "zero at tau = 0")
        require_type(self.driven_by, Moment, "turn.driven_by", optional=True)
        free = self.driven_by is None or self.angle == 0
        require(free, "turn.angle", self.angle, f"zero where a moment turns the tool, {self.driven_by}")

    def _check_axis(self) -> None:
        if len(self.centre) == 2:
            require(self.axis is None, "turn.axis", self.axis, "None in a plane, which is turned in itself")
            return
        axis = direction(self.axis, "turn.axis")
        require_components(axis, 3, "turn.axis")
        object.__setattr__(self, "axis", axis)

    @property
    def about(self) -> Floats:
        """The angles of a pose, (1,) or (3,), of a turn by one radian."""
        return np.array(self.axis or (1.0,))

    def at(self, tau: float) -> float:
        """The angle at pseudo-time ``tau``."""
        return self.angle * self.amplitude.at(tau)

    def arm(self, x: Floats, pose: Floats) -> Floats:
        """Points x (…, d) seen from the centre."""
        return x - self.centre - pose[: len(self.centre)]

    def own(self, x: Floats, pose: Floats) -> Floats:
        """Points x (…, d) in the tool's frame; the effect of the turn is added, because the centre may be far away."""
        return x - pose[: len(self.centre)] + self.arm(x, pose) @ _turned_by(angles_of(pose))

    def going(self, x: Floats, by: Floats, pose: Floats, advance: Floats, part: float | Floats = 1.0) -> Floats:
        """The motion in the tool's frame of points x (…, d) that move ``by`` (…, d) as it moves by ``advance`` (p,).

        While the points do so, the tool makes only a ``part`` (…) of the advance, which translates and turns evenly.
        The result is exact to the round-off of the motions, not of the positions.
        """
        part = np.asarray(part, dtype=np.float64)[..., None]
        Q, angle = rotation(angles_of(pose)), part * float(angles_of(advance) @ self.about)
        moved = (by - part * advance[: len(self.centre)]) @ Q
        return moved + turned_on(self.about, -angle, self.arm(x, pose) @ Q + moved)

    def swept(self, x: Floats, pose: Floats, advance: Floats) -> Floats:
        """The displacement (…, d) by the turn alone of the tool's points at x (…, d) in the ``pose``."""
        return self.arm(x, pose) @ _turned_by(angles_of(advance)).T

    def carried(self, middle: Floats, pose: Floats, advance: Floats) -> Floats:
        """The displacement (…, d) by the turn alone of tool points whose path from ``pose`` has the ``middle`` (…, d).

        (Q - 1) v = 2 tan(theta/2) e x (Q + 1) v/2 of a turn Q by theta < pi about the axis e.
        """
        chord = 2 * np.tan(float(angles_of(advance) @ self.about) / 2)
        return chord * self.swirl(self.arm(middle, pose) - advance[: len(self.centre)] / 2)

    def swirl(self, arm: Floats) -> Floats:
        """The velocity (…, d), per unit of angle, of points at ``arm`` (…, d) from the centre as the tool turns."""
        return crossed(self.about, arm)


def crossed(spin: Floats, vectors: Floats) -> Floats:
    """spin x v (…, d) of vectors v (…, d), the ``spin`` of one number in a plane (…, 1), of three in space (…, 3).

    >>> crossed(np.array([3.0]), np.array([2.0, 1.0])).tolist()
    [-3.0, 6.0]
    """
    return spin * leftwards(vectors) if vectors.shape[-1] == 2 else np.cross(spin, vectors)


def turned_on(axis: Floats, angle: Floats, arm: Floats) -> Floats:
    """(Q - 1) v (…, d) of the ``arm`` v (…, d) for turns by ``angle`` (…, 1) about ``axis`` (…, 1), or (…, 3) in space.

    >>> turned_on(np.ones(1), np.array([np.pi / 2]), np.array([2.0, 1.0])).round(12).tolist()
    [-3.0, 1.0]
    """
    around = crossed(axis, arm)
    return np.sin(angle) * around + 2 * np.sin(angle / 2) ** 2 * crossed(axis, around)


def pose_size(dimension: int) -> int:
    """How many numbers a pose has: a displacement and the angles about the axes there are.

    >>> pose_size(2), pose_size(3)
    (3, 6)
    """
    return dimension * (dimension + 1) // 2


def rotation(angles: Floats) -> Floats:
    """Q (d, d) of the angles of a pose, one or three: vectors v as rows are v @ Q' turned, and v @ Q turned back.

    >>> (np.array([1.0, 0.0]) @ rotation(np.array([np.pi / 2])).T).round(12).tolist()
    [0.0, 1.0]
    >>> (np.array([1.0, 0.0, 0.0]) @ rotation(np.array([0.0, 0.0, np.pi / 2])).T).round(12).tolist()
    [0.0, 1.0, 0.0]
    """
    return np.eye(2 if len(angles) == 1 else 3) + _turned_by(angles)


def _turned_by(angles: Floats) -> Floats:
    """Q - 1 (d, d) of :func:`rotation`, without the round-off of one."""
    angle = float(norm(angles)) if len(angles) == 3 else float(angles[0])
    half = np.sin(angle / 2)
    if len(angles) == 1:
        return np.array([[-2 * half**2, -np.sin(angle)], [np.sin(angle), -2 * half**2]])
    e = angles / angle if angle else angles
    E = np.array([[0.0, -e[2], e[1]], [e[2], 0.0, -e[0]], [-e[1], e[0], 0.0]])
    return np.sin(angle) * E + 2 * half**2 * E @ E


def angles_of(poses: Floats) -> Floats:
    """The angles (…, 1) of poses (…, 3) in a plane, or (…, 3) of poses (…, 6) in space."""
    return poses[..., 2:] if poses.shape[-1] == 3 else poses[..., 3:]
