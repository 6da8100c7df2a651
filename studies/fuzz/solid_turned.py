"""Tools, supports and loads of a body in space that is turned, or seen in a mirror."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from bipot.paths import Path
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.supports import Prescribed, Support
from bipot.tools.driving import Force
from bipot.tools.tool import FlatTool
from bipot.typing import Floats, Vector
from studies.fuzz.solid_held import direction_of


@dataclass(frozen=True)
class Turned:
    """x becomes ``turn`` x + ``shift``: a rotation or a reflection (3, 3), which may exchange axes."""

    turn: Floats
    shift: Floats = field(default_factory=lambda: np.zeros(3))

    @staticmethod
    def mirrored(way: Floats, at: float) -> Turned:
        """In the plane ``way`` . x = ``at`` of a unit normal."""
        return Turned(np.eye(3) - 2 * np.outer(way, way), 2 * at * way)

    @property
    def exchanges(self) -> bool:
        """Whether axes stay axes."""
        return bool((np.count_nonzero(self.turn, axis=0) == 1).all())

    def way(self, vector: Vector) -> Vector:
        """A vector."""
        return _plain(self.turn @ np.array(vector))

    def tool(self, tool: FlatTool) -> FlatTool:
        """A tool with what drives it."""
        drive, (travel, path) = tool.driven_by, self._gone(tool)
        force = None if drive is None else Force(self.way(drive.vector), drive.amplitude)
        point, normal = _plain(self.turn @ np.array(tool.point) + self.shift), _unit(self.way(tool.normal))
        return replace(tool, point=point, normal=normal, travel=travel, path=path, driven_by=force)

    def support(self, support: Support) -> Support:
        """A support, along an axis where that it is along stays one."""
        if not (self.exchanges and isinstance(support.direction, int)):
            return replace(support, direction=_unit(self.way(_plain(direction_of(support)))))
        own = self.turn[:, support.direction]
        if isinstance(support, Prescribed):
            far = support.displacement * float(own.sum()) + 0.0
            return replace(support, direction=int(np.argmax(np.abs(own))), displacement=far)
        return replace(support, direction=int(np.argmax(np.abs(own))))

    def load(self, load: Load) -> Load:
        """A load."""
        if isinstance(load, BodyForce | Traction | PointForce):
            return replace(load, vector=self.way(load.vector))
        assert isinstance(load, Pressure)
        return load

    def _gone(self, tool: FlatTool) -> tuple[Vector, Path]:
        """Travel and path: multiples of components change places, not signs, or are those of other components."""
        if all(np.size(multiple) == 1 for _, multiple in tool.path):
            return self.way(tool.travel), tool.path
        if self.exchanges:
            order = np.argmax(np.abs(self.turn), axis=1)
            return self.way(tool.travel), tuple((tau, _plain(np.broadcast_to(m, 3)[order])) for tau, m in tool.path)
        size = float(np.abs(tool.travel).max()) or 1.0
        path = ((tau, self.turn @ np.multiply(multiple, tool.travel) / size) for tau, multiple in tool.path)
        return (size, size, size), tuple((tau, _plain(multiple)) for tau, multiple in path)


def _plain(vector: Floats) -> Vector:
    """Numbers without signed zeros."""
    return tuple((vector + 0.0).tolist())


def _unit(vector: Vector) -> Vector:
    return _plain(np.array(vector) / np.linalg.norm(vector))
