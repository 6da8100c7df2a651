r"""Planes of symmetry: their requirements on a scene, and the forces on the whole body.

A plane m . x = const cuts the body, and one side of it is modelled. Supports, tools and loads of a scene are those on
the modelled part; their mirror images act on its mirror image. A flat tool whose normal has no component along m is its
own mirror image, and so is a circle around a point of the plane: the plane *cuts* it. If f is its force on the modelled
part, its force on the whole body is

    F = 2 (f - (f . m) m),

for one plane after the other; all are at right angles. The mirror image of any other tool is another tool with a force
of its own, which may touch the mirror images of the candidates only. If it meets the modelled part too
(:func:`image_depth`), the scene or the increment is refused. At a point of the plane a force and its mirror image both
act, so that the whole body bears twice a point force given there. A body that penetrates its mirror image is refused
(:mod:`bipot.scene.itself`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from bipot.errors import require
from bipot.fem.reduction import Geometry
from bipot.meshes.mesh import Mesh
from bipot.scene.agreeing import told
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.supports import Support, Symmetry, named
from bipot.tensors import norm
from bipot.tools.deformable import DeformableTool
from bipot.tools.halves import halved_at
from bipot.tools.poses import Turn, pose_size
from bipot.tools.surfaces import ACROSS, across, frames, imaged
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Vector, max_abs

PLANAR = 1e-9
"""Distance of nodes from their plane, over the body's size, that counts as round-off, wherever the origin is."""

MEANT = 1e3
"""A tool that is its own mirror image, or ends in its plane, to this many times the round-off was meant to do so."""

LOOKED = 101
"""How often on its way a tool is looked at that its mirror image may leave."""


@dataclass(frozen=True)
class Mirror:
    """The plane m . x = ``position`` with the unit ``normal`` m; points within ``roundoff`` of it are on it."""

    normal: Vector
    position: float
    roundoff: float

    def side(self, points: Floats) -> Floats:
        """The distance (...) of points (..., d) from the plane, positive on the side of its normal."""
        return points @ np.array(self.normal) - self.position

    def holds(self, points: Floats) -> Bools:
        """Which of the points (..., d) are on the plane."""
        return np.abs(self.side(points)) <= self.roundoff

    def images(self, points: Floats) -> Floats:
        """The mirror images of points (..., d)."""
        return imaged(points, self.normal, self.position)

    def contains(self, vector: Vector) -> bool:
        """Whether a vector has no component along the normal, up to round-off of its direction."""
        return abs(float(np.dot(vector, self.normal))) <= ACROSS * math.hypot(*vector)

    def cuts(self, tool: Tool) -> bool:
        """Whether the tool is its own mirror image."""
        return tool.face.mirrored(self.normal, self.position, self.roundoff)

    @property
    def words(self) -> str:
        """The plane's equation."""
        name = named(self.normal)
        return f"{f'x_{name}' if name.isdigit() else f'{name} . x'} = {self.position:g}"


def planes_of(mesh: Mesh, geometry: Geometry, supports: Sequence[Support]) -> tuple[Mirror, ...]:
    """The planes of symmetry, one for each direction that has any.

    Raises:
        SceneError: a boundary that is not in one plane, a plane that has the body on both sides, two planes across one
            direction or not at a right angle, a plane of a meridian that is not across its axis.
    """
    planes = list[Mirror]()
    for support in supports:
        if isinstance(support, Symmetry):
            plane = _plane(mesh, geometry, support)
            alike = [other for other in planes if not other.contains(plane.normal)]
            for other in alike:
                _require_one(plane, other, support)
            planes += [] if alike else [plane]
    return tuple(planes)


def _require_one(plane: Mirror, other: Mirror, support: Symmetry) -> None:
    """Require that two planes are at a right angle or the same."""
    field = f"symmetry.boundary along {named(plane.normal)}"
    right = f"in the plane of the other, {other.words}, or across it at a right angle: images of images would overlap"
    parallel = max_abs(frames(np.array(other.normal))[1:] @ np.array(plane.normal)) <= ACROSS
    require(parallel, field, support.boundary, right)
    once = f"in the plane of the other, {other.words}: two make a periodic array"
    sign = float(np.sign(np.dot(plane.normal, other.normal)))
    require(abs(sign * plane.position - other.position) <= plane.roundoff, field, support.boundary, once)


def _plane(mesh: Mesh, geometry: Geometry, support: Symmetry) -> Mirror:
    """The plane of one boundary."""
    normal, field, roundoff = support.along(mesh.dimension), "symmetry.boundary", PLANAR * mesh.size
    whole = "1 in an axisymmetric scene: a ring is whole around its axis, which takes a Support"
    along = geometry is not Geometry.AXISYMMETRIC or normal[0] == 0
    require(along, "symmetry.direction", support.direction, whole)
    x = mesh.nodes[mesh.boundary_nodes(support.boundary)] @ np.array(normal)
    flat = f"one whose nodes have one coordinate {named(normal)}: they spread from {x.min():g} to {x.max():g}"
    require(float(np.ptp(x)) <= roundoff, field, support.boundary, flat)
    plane = Mirror(normal, float(x.mean()), roundoff)
    side = plane.side(mesh.nodes)
    beside = f"one with the body on one side of its plane {plane.words}"
    require(bool((side >= -roundoff).all() or (side <= roundoff).all()), field, support.boundary, beside)
    return plane


def require_outer(mirrors: Sequence[Mirror], mesh: Mesh, tools: Sequence[Tool], loads: Sequence[Load]) -> None:
    """Refuse tools and loads on edges in planes of symmetry or on the axis of a ring, inside the whole body."""
    given = {f"tools[{k}].candidates": tool.candidates for k, tool in enumerate(tools)}
    spread = {k: load.boundary for k, load in enumerate(loads) if isinstance(load, Traction | Pressure)}
    given |= {f"scene.loads[{k}].boundary": (name,) for k, name in spread.items()}
    for plane, (field, names) in product(mirrors, given.items()):
        edges = mesh.edges(*names)
        inside = edges[plane.holds(mesh.nodes[edges]).all(axis=1)][:1].tolist()
        surface = f"on the surface of the whole body: {inside} lies in a plane of symmetry, or on an axis, inside it"
        require(not inside, field, names, surface)


def require_mirrored(
    planes: Sequence[Mirror], mesh: Mesh, geometry: Geometry, tools: Sequence[Tool], loads: Sequence[Load]
) -> None:
    """Refuse tools and loads that are inconsistent with their mirror images.

    Raises:
        SceneError: half a tool, which ends in a plane; a tool that is its own mirror image but for a little more than
            round-off, or as far as candidates tell though its surface denies it, or not though it says so; a tool cut
            by a plane that travels off it, or turns about another direction than its normal; a tool whose mirror image
            is in the modelled part; a body force along the normal of a plane, or a point force in the plane along it.
    """
    for plane in planes:
        for k, tool in enumerate(tools):
            if isinstance(tool, DeformableTool):
                # Its mirror image is the image of the boundary.
                continue
            _require_mirrored_tool(plane, mesh, geometry is Geometry.AXISYMMETRIC, tool, f"tools[{k}]")
        for k, load in enumerate(loads):
            _require_mirrored_load(plane, mesh, load, f"scene.loads[{k}]")


def _require_mirrored_tool(plane: Mirror, mesh: Mesh, ring: bool, tool: Tool, label: str) -> None:
    """Require that a tool is its own mirror image and stays so, or is off the modelled part's mirror image."""
    cut, force = plane.cuts(tool), tool.driven_by
    near = replace(plane, roundoff=MEANT * plane.roundoff)
    off = f"one that does not end in the plane of symmetry {plane.words}: give it whole"
    half = not cut and any(near.holds(points).all() for points in halved_at(tool.face, ring))
    require(not half, f"{label}.surface", tool.face, off)
    own = (
        f"its own mirror image in {plane.words} to {plane.roundoff:.2g}, as it is to {near.roundoff:.2g}, or not nearly"
    )
    x = _candidates(plane, mesh, tool)
    off, sizes = _unlike(plane, mesh, tool, tool.pose(0.0)), tool.face.size(x, np.zeros(mesh.dimension))
    # To what gaps of candidates and of their images are told in numbers of their size.
    alike = told(tool.face, x, float(np.max(sizes)))
    # Of a tool so far off that its gaps say nothing of the body's places it is not known.
    denies = not cut and off <= plane.roundoff and alike <= mesh.size and not _parts(plane, mesh, tool)
    require(cut or not near.cuts(tool), f"{label}.surface", tool.face, own)
    seen = f"its own mirror image in {plane.words}, as far as gaps of candidates and of their images tell, or unlike it"
    require(not denies, f"{label}.surface", tool.face, seen)
    said = f"its own mirror image in {plane.words}, as its methods say: gaps of candidates and their images differ"
    require(not cut or off <= max(near.roundoff, alike), f"{label}.surface", tool.face, said)
    d = named(plane.normal)
    halves = f"without a component along {d}: a plane of symmetry cuts the tool, and its halves would part"
    require(not cut or tool.goes_across(np.array(plane.normal)), f"{label}.travel", tool.travel, halves)
    whole = force is None or plane.contains(force.vector) or not cut
    require(whole, f"{label}.driven_by", force and force.vector, halves)
    about = "None, or about the normal of the plane of symmetry that cuts the tool"
    require(not cut or _turns_in(plane, tool.turn), f"{label}.turn", tool.turn, about)
    depth = image_depth(plane, mesh, tool, mesh.nodes, np.zeros(pose_size(mesh.dimension)))
    apart = f"such that its mirror image beyond {plane.words} is off the body, not {depth:.3g} in it"
    require(depth <= plane.roundoff, label, tool.face, apart)


def _candidates(plane: Mirror, mesh: Mesh, tool: Tool) -> Floats:
    """The tool's candidates at rest and their mirror images (2, a, d)."""
    x = mesh.nodes[mesh.boundary_nodes(*tool.candidates)]
    return np.stack([x, plane.images(x)])


def _unlike(plane: Mirror, mesh: Mesh, tool: Tool, pose: Floats) -> float:
    """By how much gaps of candidates and of their images differ where the tool is in the ``pose`` (p,).

    Where they do not, the tool's mirror image meets all that it meets.
    """
    one, other = tool.distance(_candidates(plane, mesh, tool), pose)
    return max_abs(one - other)


def _parts(plane: Mirror, mesh: Mesh, tool: Tool) -> bool:
    """Whether a tool that meets what its mirror image meets at rest parts from it on its way: they are two tools.

    So do those that turn towards each other. A motion within the plane is that of the image too.
    """
    force, turn = tool.driven_by, tool.turn
    if not ((force is None or plane.contains(force.vector)) and (tool.turned_by is None or _turns_in(plane, turn))):
        return True
    normal, poses = np.array(plane.normal), np.array([tool.pose(tau) for tau in np.linspace(0.0, 1.0, LOOKED)])
    poses[:, : len(normal)] = np.outer(poses[:, : len(normal)] @ normal, normal)
    return any(_unlike(plane, mesh, tool, pose) > plane.roundoff for pose in poses)


def _turns_in(plane: Mirror, turn: Turn | None) -> bool:
    """Whether a tool that the plane cuts stays its own mirror image: it does not turn, or about the plane's normal."""
    if turn is None or turn.axis is None:
        return turn is None
    return float(norm(np.cross(turn.axis, plane.normal))) <= ACROSS


def image_depth(plane: Mirror, mesh: Mesh, tool: Tool, nodes: Floats, pose: Floats) -> float:
    """How deep candidates of ``nodes`` (a, d) are in the mirror image of a tool in the ``pose`` (p,).

    The depth is zero for a tool that the plane cuts, which is its own mirror image.
    """
    if plane.cuts(tool):
        return 0.0
    candidates = mesh.boundary_nodes(*tool.candidates)
    # A point in the plane is its own mirror image.
    x = plane.images(nodes[candidates[~plane.holds(mesh.nodes[candidates])]])
    gap = tool.distance(x, pose)
    return max(0.0, -float(gap[~tool.face.beyond(tool.own(x, pose))].min(initial=0.0)))


def _require_mirrored_load(plane: Mirror, mesh: Mesh, load: Load, label: str) -> None:
    """Require that a body force, or a point force in the plane, has no component along the plane's normal."""
    d = named(plane.normal)
    if isinstance(load, BodyForce):
        turned = f"without a component along {d}: beyond the plane of symmetry it would turn round"
        require(plane.contains(load.vector), f"{label}.vector", load.vector, turned)
    elif isinstance(load, PointForce) and plane.holds(mesh.nodes[load.node]):
        cancelled = f"without a component along {d} at a node of a plane of symmetry: its mirror image cancels it"
        require(plane.contains(load.vector), f"{label}.vector", load.vector, cancelled)


def share(planes: Sequence[Mirror], tool: Tool) -> float:
    """The force on a tool's modelled part over that on the whole tool: a half for each plane that cuts it."""
    return 0.5 ** sum(plane.cuts(tool) for plane in planes)


def own_share(planes: Sequence[Mirror], points: Floats) -> Floats:
    """The part (n,) of each node, edge or face, ``points`` (n, k, d), that is modelled: a half per plane that holds it.

    The whole body has such a one once, and any other once beyond each plane.

    >>> left, base = (Mirror(normal, 0.0, 1e-9) for normal in ((1.0, 0.0), (0.0, 1.0)))
    >>> own_share((left, base), np.array([[[0.0, 0.0]], [[0.0, 2.0]], [[3.0, 2.0]]]))
    array([0.25, 0.5 , 1.  ])
    """
    held = np.zeros(len(points))
    for plane in planes:
        held += plane.holds(points).all(axis=1)
    return 0.5**held


def whole_force(planes: Sequence[Mirror], geometry: Geometry, tool: Tool, force: Floats) -> Floats:
    """Force (d,) of a tool on the whole body from its ``force`` (d,) on the modelled part.

    Around an axis the vectors of radial components sum to zero.

    >>> from bipot.tools.tool import FlatTool
    >>> tool = FlatTool((0, 1), (0, -1), (0, -1), ("top",), 0.1)
    >>> whole_force((Mirror((1.0, 0.0), 0.0, 1e-9),), Geometry.PLANE_STRAIN, tool, np.array([3.0, -7.0]))
    array([  0., -14.])
    """
    out = np.array(force, dtype=np.float64)
    for plane in planes:
        if plane.cuts(tool):
            out = 2 * across(out, plane.normal)
    if geometry is Geometry.AXISYMMETRIC:
        out[0] = 0.0
    return out
