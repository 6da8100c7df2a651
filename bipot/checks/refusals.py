"""Refusal of increments that are inadmissible whatever their certificate, mostly by motions that gaps do not show."""

from __future__ import annotations

import numpy as np

from bipot.certificate import Bounds
from bipot.checks.passed import FINER
from bipot.contact.closeness import TOUCHES, carries
from bipot.contact.overlap import least_gap, tool_edges
from bipot.errors import NotConverged, Refused
from bipot.iterate import Increment, Iterate
from bipot.meshes.mesh import Mesh
from bipot.scene.between import DEPTH
from bipot.scene.symmetry import image_depth
from bipot.tensors import equivalent_strain, norm
from bipot.tools.deformable import DeformableTool
from bipot.tools.poses import angles_of
from bipot.tools.tool import Sampling
from bipot.typing import Floats, max_abs

MOST_TURNED = float(np.pi) / 6
"""The largest angle of a tool in an increment: a full turn looks like none, and large ones are far from straight."""

MOST_STRAINED = 1.0
"""The largest equivalent strain of an increment: the midpoint strain then has an error of a tenth. Beyond twice that
strain the equations have other solutions, in which a freely flowing body turns by a right angle and back."""

BOTH_HALVES = (
    "Model the whole body, or give the tool whole, with its own mirror image: it meets both halves of the body."
)

RUNAWAY = 10.0
"""Farthest motion of a node in an increment, over the size of the body and the tools' travel together."""


def refuse_blocked(increment: Increment, bounds: Bounds) -> None:
    """Refuse what no motion can resolve: a tool in a held node, a tool that turns too far, a weld torn by a support."""
    inside = increment.driven_into.depth / increment.system.body.scene.mesh.size
    if inside > bounds.penetration:
        raise NotConverged(f"a tool ends {inside:.2g} times the body's size inside a node that a support holds")
    angles = increment.tools.turned
    if max_abs(angles) > MOST_TURNED:
        tool = int(np.argmax(np.abs(angles)))
        said = f"tools[{tool}] turns by {angles[tool]:.3g} in one increment"
        raise Refused(said, f"Use more increments: a tool turns by no more than {MOST_TURNED:.3g} in one.")
    if increment.torn is not None:
        raise NotConverged(f"a support moves node {increment.torn} against the tool that it is welded to")


def refuse_motion(iterate: Iterate, r: Floats) -> None:
    """Refuse inadmissible motions, with the forces r (c, d) of all candidates.

    A body may not run away, strain too much at once, spin a tool, pass through a tool or let it in between nodes, touch
    a tool past its open end, meet the mirror image of a tool, or pass through itself.
    """
    _refuse_runaway(iterate)
    _refuse_strained(iterate)
    _refuse_spun(iterate)
    if iterate.increment.system.candidates.curved:
        _refuse_crossed(iterate)
        _refuse_beyond(iterate, r)
        _refuse_between(iterate)
    if iterate.increment.system.candidates.weighted:
        _refuse_unfelt(iterate, r)
    _refuse_image(iterate)
    _refuse_itself(iterate)


def _refuse_runaway(iterate: Iterate) -> None:
    """Refuse a motion so long that its round-off hides every strain."""
    body = iterate.increment.system.body
    size, moved = body.scene.mesh.size, float(norm(iterate.response.du).max())
    allowed = RUNAWAY * (size + iterate.increment.reach + float(norm(iterate.increment.tools.driven).max()))
    if moved > allowed:
        raise NotConverged(f"the body runs away by {moved / size:.2g} times its size: nothing holds it")


def _refuse_strained(iterate: Iterate) -> None:
    """Refuse an increment that strains an element by more than one increment can resolve."""
    strain = equivalent_strain(iterate.response.kinematics.strain)
    if strain.max() > MOST_STRAINED:
        element = int(np.unravel_index(np.argmax(strain), strain.shape)[0])
        said = f"element {element} is strained by {strain.max():.3g} in one increment"
        advice = f"Use more increments: an element is strained by no more than {MOST_STRAINED:g} in one."
        raise Refused(said, advice, too_far=True)


def _refuse_spun(iterate: Iterate) -> None:
    """Refuse a tool that its moment turns too far."""
    angles = norm(angles_of(iterate.advance))
    if angles.max(initial=0.0) > MOST_TURNED:
        tool = int(np.argmax(angles))
        said = f"tools[{tool}] spins: its moment turns it by {angles[tool]:.3g} in one increment"
        advice = (
            f"Use more increments, a tool turns by no more than {MOST_TURNED:.3g} in one, or a moment that is held."
        )
        raise Refused(said, advice, too_far=True)


def _refuse_crossed(iterate: Iterate) -> None:
    """Refuse nodes that pass through a tool, which gaps at the end do not detect."""
    contacts = iterate.increment.system.candidates
    crossed = np.flatnonzero(contacts.faces.crossed(iterate.meeting))
    if len(crossed):
        tool, node = contacts.tool[crossed[0]], contacts.node[crossed[0]]
        advice = "Use more increments: they are too long for the tool."
        raise Refused(f"tools[{tool}] goes through node {node}", advice, too_far=True)


def _refuse_beyond(iterate: Iterate, r: Floats) -> None:
    """Refuse nodes that touch a tool past an open end of it."""
    contacts = iterate.increment.system.candidates
    beyond = np.flatnonzero(contacts.faces.beyond(iterate.meeting) & carries(r))
    if len(beyond):
        tool, node = contacts.tool[beyond[0]], contacts.node[beyond[0]]
        advice = f"Continue the surface of tools[{tool}] to where the body does not come, or close it."
        raise Refused(f"node {node} would be touched past an open end of tools[{tool}]", advice)


def _refuse_between(iterate: Iterate) -> None:
    """Refuse tools that come into the body between two nodes, which do not touch them."""
    increment, scene = iterate.increment, iterate.increment.system.body.scene
    for k, tool in enumerate(scene.tools):
        start, poses = increment.start.nodes, np.stack([increment.tools.placed[k], iterate.placed[k]])
        passed = scene.surroundings.between(tool, start, iterate.nodes, poses)
        if passed is not None:
            feels = np.isin(passed[:2], scene.mesh.boundary_nodes(*tool.candidates)).all()
            otherwise = "round the tool more: it is small beside the edge" if feels else "make it a candidate"
            advice = f"Refine the boundary there, or {otherwise}. There it does not feel the tool."
            said = f"tools[{k}] comes into the body between {passed}"
            raise Refused(said, BOTH_HALVES if passed.mirrored and scene.planes else advice)


def _refuse_unfelt(iterate: Iterate, r: Floats) -> None:
    """Refuse tools deep in an edge of which no node is in a weighted mean that touches them, as at a corner."""
    contacts, nodes, scene = iterate.increment.system.candidates, iterate.nodes, iterate.increment.system.body.scene
    carrying, weights = carries(r), abs(contacts.means.weights)
    for k, tool in enumerate(scene.tools):
        if tool.sampling is not Sampling.WEIGHTED:
            continue
        felt = np.asarray(weights.T @ (carrying & (contacts.tool == k))) > 0
        edges = tool_edges(scene.mesh, tool)
        depth = -least_gap(tool, nodes[edges], iterate.placed[k])
        deep = depth > DEPTH * norm(nodes[edges[:, -1]] - nodes[edges[:, 0]])
        found = np.flatnonzero(deep & ~felt[edges].any(axis=1))
        if len(found):
            said = f"tools[{k}] is {depth[found[0]]:.2g} deep in an edge at node {edges[found[0], 0]} and feels nothing"
            advice = "Refine the boundary there, or meet it at its nodes (Sampling.NODES) if its element allows that."
            raise Refused(said, advice)


def _refuse_image(iterate: Iterate) -> None:
    """Refuse bodies in the mirror image of a tool that a plane of symmetry does not cut, which is not in the scene."""
    scene = iterate.increment.system.body.scene
    for plane in scene.planes:
        for k, tool in enumerate(scene.tools):
            depth = image_depth(plane, scene.mesh, tool, iterate.nodes, iterate.placed[k])
            if depth > TOUCHES * scene.size:
                said = f"the mirror image of tools[{k}] beyond {plane.words} comes {depth:.2g} deep into the body"
                raise Refused(said, BOTH_HALVES)


def _refuse_itself(iterate: Iterate) -> None:
    """Refuse bodies that go through themselves or their mirror images, with which there is no contact."""
    scene = iterate.increment.system.body.scene
    found = scene.itself.through(iterate.nodes)
    if found is None:
        return
    mesh, said = scene.mesh, f"the body goes through itself: {found.words}"
    advice = "End the path before: contact is known with tools alone, between parts with deformable ones."
    if found.element is not None:
        for k, tool in enumerate(scene.tools):
            if isinstance(tool, DeformableTool) and _both_in(mesh, tool, found.node, found.element):
                said = f"the sides of tools[{k}] overlap much beside their edges: {found.words}"
                raise Refused(said, FINER)
        part = mesh.connected
        if part[found.element] != part[np.flatnonzero((mesh.elements == found.node).any(axis=1))[0]]:
            advice = "Let the boundaries that meet there be surface and candidates of a deformable tool."
    raise Refused(said, advice)


def _both_in(mesh: Mesh, tool: DeformableTool, node: int, element: int) -> bool:
    """Whether a ``node`` is on one side of a tool, and one of an ``element`` on the other."""
    one, other = (mesh.boundary_nodes(*of) for of in (tool.candidates, tool.surface))
    own = mesh.elements[element]
    return bool((node in one and np.isin(own, other).any()) or (node in other and np.isin(own, one).any()))
