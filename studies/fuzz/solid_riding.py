"""What tools in space take along of a body that supports leave free, as :mod:`studies.fuzz.riding`."""

from __future__ import annotations

import numpy as np

from bipot.control.accepted import Accepted
from bipot.scene.scene import Scene
from bipot.tools.surfaces import Plane
from bipot.typing import Floats
from studies.fuzz.solid_held import direction_of, planes_of, whole_size
from studies.fuzz.solid_movable import movable
from studies.fuzz.solid_placed import alone_gone, axis_of, cuts, pose, solid, way_along
from studies.fuzz.solid_points import Posed, posed
from studies.independent.riding import Ridden, Ride
from studies.independent.sampling import Parts
from studies.independent.solid_tools import about, turned_by

HALVED = 1e-9
"""A point has less than this left of the normal of a plane beyond which it goes on."""


def ridden(scene: Scene, accepted: Accepted) -> list[Ridden]:
    """How a body goes with the other tools in an increment, as each tool (k,) meets it."""
    every = [_of_tool(scene, accepted, k) for k in range(len(scene.tools))]
    sizes = [len(own.node) for own, _, _, _ in every]
    before = np.cumsum([0, *sizes])
    each = [(scene.tools[k], a) for k, (own, _, _, _) in enumerate(every) for a in own.node.tolist()]
    mu = np.array([tool.mu_at.get(a, tool.mu) for tool, a in each])
    shear = np.array([tool.shear_at.get(a, tool.shear) for tool, a in each])
    parts = [Parts.of(own.weights) for own, _, _, _ in every]
    way, tools = way_along(scene, accepted.start.tau, accepted.state.tau), range(len(scene.tools))
    nodes = np.concatenate([part.node for part in parts])

    def gaps(k: int, x: Floats) -> Floats:
        shape = solid(scene, k, accepted)
        return shape.near(shape.seen(x, pose(scene, k, accepted.start))).gap

    ride = Ride(
        tool=np.repeat(np.arange(len(every)), sizes),
        gap=np.concatenate([part.mean(gap) for part, (_, gap, _, _) in zip(parts, every, strict=True)]),
        mu=mu,
        welded=np.isinf(mu) & np.isinf(shear),
        r=accepted.start.forces,
        owner=np.concatenate([part.owner + first for part, first in zip(parts, before, strict=False)]),
        share=np.concatenate([part.share for part in parts]),
        normal=np.concatenate([normal for _, _, normal, _ in every]),
        goes=np.concatenate([goes for _, _, _, goes in every]) - way,
        part=np.concatenate([_part(scene, k, own) for k, (own, _, _, _) in enumerate(every)]),
        images=np.array([2.0 ** (len(planes_of(scene)) - len(cuts(scene, tool))) for tool in scene.tools]),
        held=np.array([(0.0, 0.0, 0.0), *(direction_of(support) for support in scene.supports)]),
        place=accepted.start.nodes[nodes],
        centre=np.array([solid(scene, k, accepted).centre + pose(scene, k, accepted.start)[:3] for k in tools]),
        turns=np.array([alone_gone(scene, k, accepted)[3] * axis_of(scene.tools[k]) for k in tools]),
        flat=np.array([isinstance(tool.face, Plane) for tool in scene.tools]),
        gaps=gaps,
    )
    return ride.ways(whole_size(scene))


def _part(scene: Scene, k: int, own: Posed) -> Floats:
    """What part (c,) of a point of the whole body each of the k-th tool is: a half in each plane that cuts the tool."""
    out = np.ones(len(own.node))
    for way, _ in cuts(scene, scene.tools[k]):
        out[np.linalg.norm(own.within @ way, axis=1) < HALVED] /= 2
    return out


def _of_tool(scene: Scene, accepted: Accepted, k: int) -> tuple[Posed, Floats, Floats, Floats]:
    """The candidates of the k-th tool, and gap (w,), normal and way (w, 3) of the tool at their nodes."""
    every, nodal, shape = posed(scene, k), movable(scene, k), solid(scene, k, accepted)
    own = every.only(((every.weights != 0)[:, :, None] & nodal).any(axis=1)[:, 0])
    x, at, by = (
        accepted.start.nodes[Parts.of(own.weights).node],
        pose(scene, k, accepted.start),
        alone_gone(scene, k, accepted),
    )
    seen, axis = shape.near(shape.seen(x, at)), axis_of(scene.tools[k])
    goes = by[:3] + (x - shape.centre - at[:3]) @ turned_by(axis, float(by[3])).T
    return own, seen.gap, seen.normal @ about(axis, float(at[3])).T, goes
