"""Checks of tools against a body: they may touch its surface, a node can move away, and none is inside it at rest."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bipot.errors import SceneError, require
from bipot.fem.elements import facet
from bipot.fem.reduction import Geometry
from bipot.fem.surface import outward_area
from bipot.laws.material import Materials
from bipot.meshes.mesh import Mesh
from bipot.paths import require_components
from bipot.scene.agreeing import require_agreeing
from bipot.scene.between import Surroundings
from bipot.scene.between_faces import Skin, require_thick
from bipot.scene.holding import Holding
from bipot.scene.symmetry import PLANAR
from bipot.tensors import norm
from bipot.tools.extruded import Extruded
from bipot.tools.poses import pose_size
from bipot.tools.profiles import Profile
from bipot.tools.revolved import Revolved
from bipot.tools.surfaces import Plane, Surface, coordinates
from bipot.tools.tool import FlatTool, Sampling, Tool
from bipot.typing import Floats, Vector

INSIDE = 1e-9
"""Depth, over the body's size, of a driven tool in the body at rest that counts as round-off."""

SIDE = 0.5
"""Cosine of the least angle, 60 degrees, between a flat tool and a side of the body, which may roll onto it."""

ROUND_OFF = 1e-12
"""Round-off of the nodes' shares of the reference face."""


SWALLOWED = "all of the body is inside it"
"""What is wrong with a tool on the wrong side of its surface."""


class Fitted(NamedTuple):
    """The body at rest that tools must fit, with its supports and its whole surface."""

    mesh: Mesh
    geometry: Geometry
    material: Materials
    holding: Holding
    surroundings: Surroundings | Skin


def require_fitting(body: Fitted, tool: Tool, label: str) -> None:
    """Refuse a tool that does not fit the body, naming its field by the ``label``.

    Raises:
        SceneError: a surface whose methods do not agree; candidates that are no edges of the surface, or none of which
            can move along the normal; a tool that is in the body at rest, that moves off or across the axis of a ring,
            or turns around one; coefficients at nodes that are no candidates; a cap with a material that does not
            flow; contact at nodes with negative shares of faces.
    """
    nodes, names = body.mesh.boundary_nodes(*tool.candidates), tool.candidates
    x = body.mesh.nodes[nodes]
    body.mesh.require_outer(f"{label}.candidates", *names)
    d = body.mesh.dimension
    require_components(tool.travel, d, f"{label}.travel")
    kind = "a plane, or what is Revolved or Extruded" if d == 3 else "of a plane"
    same = coordinates(tool.face, f"{label}.surface") == d
    require(same, f"{label}.surface", tool.face, f"{kind}, as the nodes of the mesh have {d} coordinates")
    if tool.turn is not None:
        require_components(tool.turn.centre, d, f"{label}.turn")
    if d == 3:
        require_thick(body.mesh, tool, label)
    normal = require_agreeing(tool.face, x, f"{label}.surface").normal
    _require_shares(body.mesh, tool, normal[0], label)
    # The normal of a curved tool may turn to any direction.
    holding = body.holding
    movable = bool(holding.free_along(nodes, normal).any() if tool.flat else not holding.held[nodes].all())
    require(movable, f"{label}.candidates", names, "boundaries of which a node can move along its normal")
    _require_outside(body, tool, label)
    if body.geometry.reduction.ring and not tool.flat:
        _require_revolved(body, tool, label)
    if tool.turn is not None:
        require(not body.geometry.reduction.ring, f"{label}.turn", tool.turn, "None where a tool is all around an axis")
    _require_driven(body, tool, x, label)
    require_coefficients(body, tool, label)


def _require_shares(mesh: Mesh, tool: Tool, normal: Vector, label: str) -> None:
    """Require means where nodes have negative shares int N_k dA of a face: a pressure pulls there, contact cannot.

    Sides beside a flat tool of this ``normal`` are exempt: when a side rolls onto the tool its rim touches first, which
    nodes feel at once and means around corners late.
    """
    faces = mesh.around(*tool.candidates)
    table = facet(faces.shape[1], mesh.dimension)
    if tool.sampling is not Sampling.NODES or (table.weights @ table.values).min() >= -ROUND_OFF:
        return
    outward = outward_area(mesh.nodes, faces, Geometry.SOLID).sum(axis=1)
    faced = not tool.flat or bool((outward @ normal < -SIDE * norm(outward)).any())
    allowed = (
        f"Sampling.WEIGHTED on faces of {mesh.element.name}: their corners have negative shares of the area, where a "
        "pressure pulls and contact at nodes cannot. Sides that roll onto a flat tool may be met at nodes, by a tool "
        "of their own"
    )
    require(not faced, f"{label}.sampling", tool.sampling, allowed)


def _require_outside(body: Fitted, tool: Tool, label: str) -> None:
    """Require that no part of a tool is in the body at rest, nor the whole body in the tool, as in a reversed one."""
    wrong = inside(body.surroundings, tool, body.mesh.nodes, PLANAR * body.mesh.size)
    if wrong is None:
        return
    if isinstance(tool, FlatTool):
        raise SceneError(f"{label}.normal = {tool.normal}: must point from the tool into the body: {wrong}")
    if wrong != SWALLOWED:
        wrong += "; let its way begin farther off"
    other = _followed_back(tool.face)
    if other is not None and other.distance(body.mesh.nodes).gap.min() >= -PLANAR * body.mesh.size:
        wrong += "; with its points in the other order the tool, on the right of its line, is off the body"
    whole = "the body at rest and its mirror images" if body.surroundings.planes else "the body at rest"
    raise SceneError(f"{label}.surface = {tool.face!r}: must be off {whole}: {wrong}")


def inside(surroundings: Surroundings | Skin, tool: Tool, nodes: Floats, roundoff: float) -> str | None:
    """The overlap of a body at ``nodes`` (a, d) and the tool at rest, in words, None where there is none."""
    pose = np.zeros(pose_size(nodes.shape[1]))
    if tool.distance(nodes, pose).max() <= roundoff:
        return SWALLOWED
    deep = surroundings.inside(tool, nodes, pose)
    return None if deep is None else f"a part of it is behind {deep}, between which no candidate feels it"


def _followed_back(surface: Surface) -> Surface | None:
    """The surface with its line followed in the other direction, None if it is not made of a line."""
    if isinstance(surface, Revolved):
        meridian = _followed_back(surface.meridian)
        return None if meridian is None else replace(surface, meridian=meridian)
    if isinstance(surface, Extruded):
        section = _followed_back(surface.section)
        return None if section is None else replace(surface, section=section)
    return surface.followed_back() if isinstance(surface, Profile) else None


def _require_revolved(body: Fitted, tool: Tool, label: str) -> None:
    """Require that a tool of revolution stays on the axis, or beside it."""
    roundoff = PLANAR * body.mesh.size
    on_axis = tool.face.mirrored((1.0, 0.0), 0.0, roundoff)
    require(not on_axis or tool.travel[0] == 0, f"{label}.travel", tool.travel, "along the axis, which it is on")
    tips = tool.face.tips()
    for tau, _ in tool.path:
        r = tips.centre[:, 0] + tool.moved(0.0, tau)[0]
        over = (r < -roundoff) & (r + tips.radius > 0)
        require(on_axis or not over.any(), f"{label}.surface", tool.face, "of parts around centres at r >= 0")


def _require_driven(body: Fitted, tool: Tool, x: Floats, label: str) -> None:
    """Require a force along the axis of a ring, and a driven tool that starts outside of the candidates at x (a, d)."""
    force = tool.driven_by
    if force is not None:
        along = not body.geometry.reduction.ring or force.vector[0] == 0
        require(along, f"{label}.driven_by", force.vector, "along the axis of an axisymmetric body")
    if force is not None or tool.turned_by is not None:
        at_rest = np.zeros(pose_size(x.shape[1]))
        gap = tool.distance(x, at_rest)
        depth = -float(gap[~tool.face.beyond(tool.own(x, at_rest))].min(initial=0.0))
        off = f"off the body, not inside it by {depth:.3g}: a {'force' if force is not None else 'moment'} drives it"
        field, value = ("point", tool.face.point) if isinstance(tool.face, Plane) else ("surface", tool.face)
        require(depth <= INSIDE * body.mesh.size, f"{label}.{field}", value, off)


def require_coefficients(body: Fitted, tool: Tool, label: str) -> None:
    """Require coefficients at candidates only, and caps only with materials that flow."""
    edges = body.mesh.edges(*tool.candidates)
    points = np.unique(edges if tool.sampling is Sampling.NODES else edges[:, body.mesh.element.ends])
    for name in ("mu_at", "shear_at"):
        for node in getattr(tool, name):
            allowed = "one of the tool's candidates (ends of edges, corners of faces, if weighted)"
            require(node in points, f"{name} node", node, allowed)
    owners = body.mesh.owners(*tool.candidates)
    flows = bool(np.isfinite(body.material.yield_stress(np.zeros((len(body.mesh.elements), 1)))[owners]).all())
    allowed = "inf where the material does not flow: it is a part of the yield stress"
    require(flows or not tool.capped, f"{label}.shear", tool.shear, allowed)
