"""Tools, supports and loads of a body in space that is turned, or seen in a mirror."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from bipot.paths import Path
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.supports import Prescribed, Support
from bipot.tools.deformable import AnyTool, DeformableTool
from bipot.tools.poses import Force, Turn
from bipot.tools.profiles import Union
from bipot.tools.revolved import Revolved
from bipot.tools.surfaces import Plane, Surface
from bipot.tools.tool import FlatTool
from bipot.typing import Floats, Vector
from studies.fuzz.solid_held import direction_of
from studies.fuzz.surfaces import Seen


@dataclass(frozen=True)
class Turned:
    """x becomes (``turn`` x + ``shift``) ``length``: a rotation or a reflection (3, 3), which may exchange axes.

    Of supports and loads it is that without the length.
    """

    turn: Floats
    shift: Floats = field(default_factory=lambda: np.zeros(3))
    length: float = 1.0

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

    def place(self, point: Vector) -> Vector:
        """A place."""
        return _plain((self.turn @ np.array(point) + self.shift) * self.length)

    def surface(self, surface: Surface) -> Surface:
        """A surface, of which a meridian is no other one in a mirror."""
        if isinstance(surface, Plane):
            return Plane(self.place(surface.point), _unit(self.way(surface.normal)))
        if isinstance(surface, Union):
            return Union(tuple(map(self.surface, surface.surfaces)))
        assert isinstance(surface, Revolved)
        meridian = Seen.scaled(self.length).surface(surface.meridian)
        return Revolved(meridian, self.place(surface.point), _unit(self.way(surface.axis)))

    def tool(self, tool: AnyTool, force: float = 1.0) -> AnyTool:
        """A tool with what drives it, forces in units of which one has ``force`` more."""
        if isinstance(tool, DeformableTool):
            return tool
        drive, (travel, path) = tool.driven_by, self._gone(tool)
        push = None if drive is None else Force(_plain(force * self.turn @ np.array(drive.vector)), drive.amplitude)
        travel = _plain(np.array(travel) * self.length)
        if isinstance(tool, FlatTool):
            point, normal = self.place(tool.point), _unit(self.way(tool.normal))
            return replace(tool, point=point, normal=normal, travel=travel, path=path, driven_by=push)
        turn = None if tool.turn is None else self._turn(tool.turn, force)
        return replace(tool, surface=self.surface(tool.face), travel=travel, path=path, driven_by=push, turn=turn)

    def _turn(self, turn: Turn, force: float) -> Turn:
        """A turn, which in a mirror is the other way about the image of its axis."""
        way, moment = float(np.sign(np.linalg.det(self.turn))), turn.driven_by
        assert turn.axis is not None
        if moment is not None:
            moment = replace(moment, value=way * moment.value * force * self.length + 0.0)
        axis = _unit(self.way(turn.axis))
        return replace(turn, angle=way * turn.angle + 0.0, centre=self.place(turn.centre), axis=axis, driven_by=moment)

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

    def _gone(self, tool: AnyTool) -> tuple[Vector, Path]:
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
