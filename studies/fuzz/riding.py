"""What tools of a drawn scene take along of a body that supports leave free, in plain arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.tools.poses import Turn
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from studies.fuzz.placed import across_what_holds, along_path, planes, poses, way_along
from studies.fuzz.points import ON_AXIS, Points, posed
from studies.fuzz.solid_held import multiple
from studies.fuzz.surfaces import cut
from studies.independent.data import Setting
from studies.independent.riding import Ridden, Ride
from studies.independent.sampling import Parts
from studies.independent.tools import Rigid, turning


def ridden(scene: Scene, setting: Setting, ends: tuple[State, State], shapes: Sequence[Rigid | None]) -> list[Ridden]:
    """How a body goes with the other tools between both ``ends``, as each tool (k,) meets it.

    ``shapes`` are the tools that are not flat.
    """
    points, (start, end) = posed(scene, setting), ends
    parts = Parts.of(points.weights)
    tool, x, pose = points.tool[parts.owner], start.nodes[parts.node], poses(scene, start)
    normal, gap, goes, gone = np.zeros_like(x), np.zeros(len(x)), np.zeros_like(x), _gone(scene, start, end)

    def near(k: int, x: Floats) -> tuple[Floats, Floats]:
        own, shape = scene.tools[k], shapes[k]
        if isinstance(own, FlatTool):
            return np.array(own.normal), (x - np.array(own.point) - pose[k, :2]) @ np.array(own.normal)
        assert shape is not None
        found, _ = shape.near(shape.seen(x, pose[k]))
        return found.normal @ turning(pose[k, 2]).T, found.gap

    for k, (own, by) in enumerate(zip(scene.tools, gone, strict=True)):
        mine = tool == k
        normal[mine], gap[mine] = near(k, x[mine])
        arm = x[mine] - pose[k, :2] - (0.0 if own.turn is None else np.array(own.turn.centre))
        back, across = 2 * np.sin(by[2] / 2) ** 2, np.sin(by[2])
        goes[mine] = by[:2] - back * arm + across * np.column_stack([-arm[:, 1], arm[:, 0]])
    each = list(zip([scene.tools[k] for k in points.tool.tolist()], points.node.tolist(), strict=True))
    mu = np.array([own.mu_at.get(a, own.mu) for own, a in each])
    shear = np.array([own.shear_at.get(a, own.shear) for own, a in each])
    ride = Ride(
        tool=points.tool,
        gap=parts.mean(gap),
        mu=mu,
        welded=np.isinf(mu) & np.isinf(shear),
        r=start.forces,
        owner=parts.owner,
        share=parts.share,
        normal=normal,
        goes=goes - way_along(scene, start.tau, end.tau),
        part=_part(scene, setting, points),
        images=np.array([2.0 ** sum(not cut(own, *plane) for plane in planes(scene)) for own in scene.tools]),
        held=across_what_holds(scene, np.ones(len(scene.supports), dtype=bool)),
        place=x,
        centre=pose[:, :2] + [(0.0, 0.0) if turn is None else turn.centre for turn in _turns(scene)],
        turns=gone[:, 2:] * (0.0, 0.0, 1.0),
        flat=np.array([isinstance(own.face, Plane) for own in scene.tools]),
        gaps=lambda k, x: near(k, x)[1],
    )
    return ride.ways(setting.whole)


def _part(scene: Scene, setting: Setting, points: Points) -> Floats:
    """What part (c,) of a point of the whole body each is: a half in a plane of symmetry that cuts its tool."""
    out = np.ones(len(points.node))
    for d, position in planes(scene):
        inside = np.abs(setting.rest[points.node, d] - position) <= ON_AXIS * setting.size
        out[inside & np.array([cut(tool, d, position) for tool in scene.tools])[points.tool]] /= 2
    return out


def _gone(scene: Scene, start: State, end: State) -> Floats:
    """What poses (k, 3) change by along paths and by prescribed turns alone, whatever forces and moments make."""
    turns = [0.0 if turn is None else turn.angle * _grown(turn.amplitude, start, end) for turn in _turns(scene)]
    return np.column_stack([along_path(scene, start.tau, end.tau), turns])


def _turns(scene: Scene) -> list[Turn | None]:
    return [tool.turn for tool in scene.tools]


def _grown(amplitude: Amplitude, start: State, end: State) -> float:
    return multiple(amplitude, end.tau) - multiple(amplitude, start.tau)
