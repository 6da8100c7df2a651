r"""Coordinates of driven tools: displacements along driving forces, and turns by moments.

Each coordinate x is an unknown of the increment and a length: a tool moves by x along the direction of its force, or
turns by x / L about its centre under its moment, with the lever L. Dual to x is the force, or the moment M as the force
M / L. The lever is the distance of the centre from the tool's surface at rest, or the body's size if that is larger, so
that x is about the arc by which the surface moves, and L is never zero.

Per unit of its coordinate a point of a tool at a from its centre moves by w = e along a force, and by w = z x a / L
about the centre, in space about the axis z through it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.symmetry import Mirror, share
from bipot.tensors import norm
from bipot.tools.poses import Force, Moment, Turn, angles_of, crossed, pose_size
from bipot.tools.surfaces import Surface
from bipot.tools.tool import Tool
from bipot.typing import Floats, Ints


@dataclass(frozen=True)
class Drives:
    """The forces or moments (``by``) that drive m coordinates of the tools numbered ``tool`` (m,).

    ``ways`` (m, p) is the change of the tool's pose per unit of a coordinate. ``dual`` (m,) is the dual force on the
    modelled part over the force or moment on the whole tool.
    """

    by: tuple[Force | Moment, ...]
    tool: Ints
    ways: Floats
    dual: Floats

    @staticmethod
    def of(tools: Sequence[Tool], planes: Sequence[Mirror], mesh: Mesh) -> Drives:
        """The drives of the tools, tool by tool, of a body with this ``mesh`` that ``planes`` of symmetry cut."""
        d = mesh.dimension
        angles, found = np.zeros(pose_size(d) - d), list[tuple[Force | Moment, int, Floats, float]]()
        for k, tool in enumerate(tools):
            if tool.driven_by is not None:
                found.append((tool.driven_by, k, np.append(tool.driven_by.direction, angles), share(planes, tool)))
            if tool.turn is not None and tool.turned_by is not None:
                spin = 1.0 / lever(tool.face, tool.turn, mesh.size)
                way = np.append(np.zeros(d), spin * tool.turn.about)
                found.append((tool.turned_by, k, way, spin * share(planes, tool)))
        by, owner, ways, dual = zip(*found, strict=True) if found else ((), (), (), ())
        return Drives(by, np.array(owner, np.intp), np.array(ways).reshape(-1, pose_size(d)), np.array(dual))

    def __len__(self) -> int:
        return len(self.by)

    def at(self, tau: float) -> Floats:
        """Forces (m,) dual to the coordinates at pseudo-time ``tau``."""
        return self.dual * np.array([drive.at(tau) for drive in self.by])

    def poses(self, coordinates: Floats, count: int) -> Floats:
        """The change of the poses (k, p) of ``count`` tools for these ``coordinates`` (m,)."""
        out = np.zeros((count, self.ways.shape[1]))
        np.add.at(out, self.tool, coordinates[:, None] * self.ways)
        return out

    def motion(self, number: Ints, arm: Floats) -> Floats:
        """w (…, d) of points at ``arm`` (…, d) from their tool's centre, for the coordinates ``number`` (…)."""
        along, spin = self.ways[number, : arm.shape[-1]], angles_of(self.ways[number])
        return along + crossed(spin, arm) if spin.any() else along

    def along(self, tool: int, arm: Floats) -> Floats:
        """w (i, a, d) of points at ``arm`` (a, d) from the centre of a ``tool``, for each of its i coordinates."""
        own = np.flatnonzero(self.tool == tool)
        return self.motion(np.repeat(own[:, None], len(arm), axis=1), np.broadcast_to(arm, (len(own), *arm.shape)))

    @property
    def spins(self) -> Floats:
        """1/L (m,) of turns, 0 of translations."""
        return norm(angles_of(self.ways))


def lever(surface: Surface, turn: Turn, size: float) -> float:
    """The length L that makes the angle of a turn a coordinate (module docstring), in a body of that ``size``."""
    return max(abs(float(surface.distance(np.array(turn.centre)).gap)), size)
