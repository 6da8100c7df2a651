"""What holds a body: supports that rest, supports that are driven, and planes of symmetry that cut the body.

What planes of symmetry ask of the rest of a scene, and what they make of a tool's force, is in :mod:`bipot.symmetry`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_count, require_magnitude, require_number, require_type
from bipot.mesh import Mesh
from bipot.paths import RAMP, Amplitude
from bipot.typing import Bools, Floats, Ints


@dataclass(frozen=True)
class Support:
    """The displacement along ``direction`` (0, 1, in space 2) is zero on the mesh boundary ``boundary``."""

    boundary: str
    direction: int

    def __post_init__(self) -> None:
        require_type(self.boundary, str, "support.boundary")
        require_count(self.direction, "support.direction", 0)
        require(self.direction in (0, 1, 2), "support.direction", self.direction, "0, 1 or, in space, 2")

    def dofs(self, mesh: Mesh) -> Ints:
        """The displacements it holds, among those (a d,) of all nodes.

        Raises:
            SceneError: an unknown boundary, a direction that the mesh has not.
        """
        d = mesh.dimension
        require(self.direction < d, "support.direction", self.direction, f"one of {list(range(d))}, as the mesh has")
        return d * mesh.boundary_nodes(self.boundary) + self.direction


@dataclass(frozen=True)
class Prescribed(Support):
    """A support that moves: the displacement along ``direction`` is ``displacement`` times the ``amplitude``."""

    displacement: float = 0.0
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.displacement, "prescribed.displacement")
        object.__setattr__(self, "displacement", float(self.displacement))
        require(bool(np.isfinite(self.displacement)), "prescribed.displacement", self.displacement, "finite")
        require_type(self.amplitude, Amplitude, "prescribed.amplitude")
        for size in (self.displacement, self.displacement * self.amplitude.largest):
            require_magnitude(size, "prescribed.displacement, its amplitude with it", LARGEST_LENGTH)
        require(self.amplitude.at(0.0) == 0, "prescribed.amplitude", self.amplitude.points, "zero at tau = 0")

    def at(self, tau: float) -> float:
        """The displacement at pseudo-time ``tau``."""
        return self.displacement * self.amplitude.at(tau)


@dataclass(frozen=True)
class Symmetry(Support):
    """The mesh boundary ``boundary`` lies in a plane x_direction = const beyond which the mirror image was cut away.

    The displacement along ``direction`` is zero there, as at a support. Supports, tools and loads of a scene are those
    on the modelled part, and their mirror images act on its mirror image.
    """


def free_along(free: Bools, direction: Floats) -> Bools:
    """Which nodes with free components (c, d) can move along ``direction`` (d,) or (c, d)."""
    return np.asarray((free & (np.abs(direction) > 1e-12)).any(axis=1))


def require_agreeing(supports: Sequence[Support], mesh: Mesh) -> None:
    """Refuse supports that prescribe two displacements of one node along one axis.

    Raises:
        SceneError: names the node and the axis.
    """
    said = dict[int, tuple[float, Amplitude]]()
    for support in supports:
        own = (0.0, RAMP)
        if isinstance(support, Prescribed) and support.displacement != 0:
            own = support.displacement, support.amplitude
        for dof in support.dofs(mesh).tolist():
            node, axis = divmod(dof, mesh.dimension)
            once = f"such that node {node} has one displacement along {axis}"
            require(said.setdefault(dof, own) == own, "scene.supports", supports, once)
