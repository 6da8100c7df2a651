r"""Planes of symmetry: what they ask of a scene, and what they make of the forces on the whole body.

A plane x_d = const cuts the body, and one side of it is modelled. Supports, tools and loads of a scene are those on the
modelled part; their mirror images act on its mirror image. A flat tool whose normal has no component along d is its own
mirror image, and so is a circle around a point of the plane: the plane *cuts* it. From f, its force on the modelled
part, such a plane makes that on the whole body,

    F = 2 (f - f_d e_d),

one plane after the other. The mirror image of any other tool is another tool, with a force of its own, which meets the
mirror images of the candidates alone: where it meets the modelled part too (:func:`image_depth`), the scene is refused,
or the increment. In a point of the plane a force and its mirror image act both: of a point force
there the whole body bears twice what the scene is given. Parts of the body that meet their mirror image do not feel it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bipot.errors import require
from bipot.fem.reduction import Geometry
from bipot.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.mesh import Mesh
from bipot.poses import pose_size
from bipot.supports import Support, Symmetry
from bipot.tools import Tool
from bipot.typing import Bools, Floats

PLANAR = 1e-9
"""Over the body's size: what round-off may take nodes off their plane, however far from the origin a mesh may be."""


@dataclass(frozen=True)
class Plane:
    """The plane x_direction = ``position`` that cut the body; nodes within ``roundoff`` (a length) are on it."""

    direction: int
    position: float
    roundoff: float

    def holds(self, points: Floats) -> Bools:
        """Which of the points (..., d) are on the plane."""
        return np.abs(points[..., self.direction] - self.position) <= self.roundoff

    def cuts(self, tool: Tool) -> bool:
        """Whether the tool is its own mirror image."""
        return tool.face.mirrored(self.direction, self.position, self.roundoff)


def planes_of(mesh: Mesh, geometry: Geometry, supports: Sequence[Support]) -> tuple[Plane, ...]:
    """The planes of symmetry, one for each direction that has some.

    Raises:
        SceneError: a boundary that is not in one plane, a plane that has the body on both sides, two planes across one
            direction, a plane across the radius.
    """
    planes = dict[int, Plane]()
    for support in supports:
        if isinstance(support, Symmetry):
            plane = _plane(mesh, geometry, support)
            other = planes.setdefault(plane.direction, plane)
            once = f"in the plane of the other, x_{plane.direction} = {other.position:g}: two make a periodic array"
            same = abs(plane.position - other.position) <= plane.roundoff
            require(same, f"symmetry.boundary along {plane.direction}", support.boundary, once)
    return tuple(planes.values())


def _plane(mesh: Mesh, geometry: Geometry, support: Symmetry) -> Plane:
    """The plane of one boundary."""
    d, field, roundoff = support.direction, "symmetry.boundary", PLANAR * mesh.size
    whole = "1 in an axisymmetric scene: a ring is whole around its axis, which takes a Support"
    require(not (d == 0 and geometry is Geometry.AXISYMMETRIC), "symmetry.direction", d, whole)
    x = mesh.nodes[mesh.boundary_nodes(support.boundary), d]
    flat = f"one whose nodes have one coordinate {d}: they spread from {x.min():g} to {x.max():g}"
    require(float(np.ptp(x)) <= roundoff, field, support.boundary, flat)
    plane = Plane(d, float(x.mean()), roundoff)
    side = mesh.nodes[:, d] - plane.position
    beside = f"one with the body on one side of its plane x_{d} = {plane.position:g}"
    require(bool((side >= -roundoff).all() or (side <= roundoff).all()), field, support.boundary, beside)
    return plane


def require_mirrored(planes: Sequence[Plane], mesh: Mesh, tools: Sequence[Tool], loads: Sequence[Load]) -> None:
    """Refuse what is no body, tool or load together with its mirror images.

    Raises:
        SceneError: a load or a tool on an edge in a plane, which lies inside the whole body; a tool cut by a plane
            that travels off it or turns, or whose mirror image is in the modelled part; a body force along the normal
            of a plane, or a point force in it along that.
    """
    for plane in planes:
        d = plane.direction
        for k, tool in enumerate(tools):
            _require_outer(plane, mesh, tool.candidates, f"tools[{k}].candidates")
            halves = f"without a component along {d}: a plane of symmetry cuts the tool, and its halves would part"
            cut, force = plane.cuts(tool), tool.driven_by
            require(not cut or tool.travel[d] == 0, f"tools[{k}].travel", tool.travel, halves)
            whole = force is None or force.vector[d] == 0 or not cut
            require(whole, f"tools[{k}].driven_by", force and force.vector, halves)
            rests = not cut or tool.turn is None
            require(rests, f"tools[{k}].turn", tool.turn, "None: a plane of symmetry cuts the tool")
            depth = image_depth(plane, mesh, tool, mesh.nodes, np.zeros(pose_size(mesh.dimension)))
            apart = (
                f"such that its mirror image beyond x_{d} = {plane.position:g} is off the body, not {depth:.3g} in it"
            )
            require(depth <= plane.roundoff, f"tools[{k}]", tool.face, apart)
        for k, load in enumerate(loads):
            _require_mirrored_load(plane, mesh, load, f"scene.loads[{k}]")


def image_depth(plane: Plane, mesh: Mesh, tool: Tool, nodes: Floats, pose: Floats) -> float:
    """How deep candidates of ``nodes`` (a, d) are in the mirror image of a tool in the ``pose`` (3,).

    Of a tool that the plane cuts it is the tool itself, and the depth zero.
    """
    if plane.cuts(tool):
        return 0.0
    own = mesh.boundary_nodes(*tool.candidates)
    # Who is in the plane is its own mirror image.
    x = nodes[own[~plane.holds(mesh.nodes[own])]]
    x[:, plane.direction] = 2 * plane.position - x[:, plane.direction]
    gap = tool.distance(x, pose)
    return max(0.0, -float(gap[~tool.face.beyond(tool.own(x, pose))].min(initial=0.0)))


def _require_mirrored_load(plane: Plane, mesh: Mesh, load: Load, label: str) -> None:
    d = plane.direction
    if isinstance(load, Traction | Pressure):
        _require_outer(plane, mesh, (load.boundary,), f"{label}.boundary")
    elif isinstance(load, BodyForce):
        turned = f"without a component along {d}: beyond the plane of symmetry it would turn round"
        require(load.vector[d] == 0, f"{label}.vector", load.vector, turned)
    elif isinstance(load, PointForce) and plane.holds(mesh.nodes[load.node]):
        cancelled = f"without a component along {d} at a node of a plane of symmetry: its mirror image cancels it"
        require(load.vector[d] == 0, f"{label}.vector", load.vector, cancelled)


def _require_outer(plane: Plane, mesh: Mesh, names: tuple[str, ...], label: str) -> None:
    """No edge of the boundaries lies in the plane."""
    edges = mesh.edges(*names)
    inside = edges[plane.holds(mesh.nodes[edges]).all(axis=1)][:1].tolist()
    surface = f"on the surface of the whole body: {inside} lies in a plane of symmetry, inside it"
    require(not inside, label, names, surface)


def share(planes: Sequence[Plane], tool: Tool) -> float:
    """What a force on the whole tool is on its modelled part, over that: a half for each plane that cuts it."""
    return 0.5 ** sum(plane.cuts(tool) for plane in planes)


def whole_force(planes: Sequence[Plane], geometry: Geometry, tool: Tool, force: Floats) -> Floats:
    """Force (d,) of a tool on the whole body from its ``force`` (d,) on the modelled part.

    Around an axis the radial components are a force all around, which is none as a vector.

    >>> from bipot.tools import FlatTool
    >>> tool = FlatTool((0, 1), (0, -1), (0, -1), ("top",), 0.1)
    >>> whole_force((Plane(0, 0.0, 1e-9),), Geometry.PLANE_STRAIN, tool, np.array([3.0, -7.0]))
    array([  0., -14.])
    """
    out = np.array(force, dtype=np.float64)
    for plane in planes:
        if plane.cuts(tool):
            out *= 2
            out[plane.direction] = 0.0
    if geometry is Geometry.AXISYMMETRIC:
        out[0] = 0.0
    return out
