r"""Why an increment could not be solved, where the scene is the cause, as a body inside a tool, or held by nothing.

At a sharp corner of a tool the law has no unique normal, and the body may have no equilibrium there.
"""

from __future__ import annotations

import numpy as np

from bipot.certificate import Bounds
from bipot.checks.determinacy import ROUND_OFF
from bipot.checks.free import free, neutral, rubs
from bipot.checks.jammed import jammed
from bipot.contact.closeness import carries, touches
from bipot.iterate import Increment
from bipot.tensors import norm
from bipot.tools.tool import FlatTool, Tool
from bipot.typing import Bools, Floats, max_abs, vdot

FAR, STEPS, AIR = 100.0, 200, 1e-9
"""A tool is followed so FAR, over the size and the largest gap, in at most STEPS; a gap up to AIR sizes is touched."""

SPINS = 0.95
"""Fraction of the moment that friction holds above which a tool may spin: normal forces change in an increment."""

SHARP = 0.5
"""Angle (radians) between normals within the increment's lengths around a node from which it is at a sharp corner."""


LEVEL = 0.1
"""Slope to a flat tool below which a side that was steeper at rest has come to lie on it."""


def diagnosis(increment: Increment) -> str | None:
    """A sentence that says why the ``increment`` failed, None where the scene is not the cause."""
    causes = (_blocked, _torn, _inside, jammed, _unheld, _aloft, _past, _spun)
    return next((found for cause in causes if (found := cause(increment))), None)


def _blocked(increment: Increment) -> str | None:
    """A tool driven into a node that is held along its normal."""
    rows, contacts, (tool, node, depth) = increment.rows, increment.system.candidates, increment.driven_into
    # Supports may hold a node along the normal of a curved tool where it is now, and not elsewhere on the tool.
    held = np.where(abs(rows.G_n) @ np.ones(rows.size) > ROUND_OFF, 0.0, -rows.gap)
    if held.max(initial=0.0) > depth:
        worst = int(held.argmax())
        tool, node, depth = contacts.tool[worst], contacts.node[worst], held[worst]
    if depth <= Bounds().penetration * increment.system.body.scene.mesh.size:
        return None
    return (
        f"tools[{tool}] is driven into node {node}, which a support holds, by {depth:.3g}: "
        "stop the tool before it, or let the node go."
    )


def _torn(increment: Increment) -> str | None:
    """A weld that a support tears."""
    if (node := increment.torn) is None:
        return None
    return f"Node {node} cannot go with the tool that it is welded to: let it go there, or give the tool friction."


def _inside(increment: Increment) -> str | None:
    """A body without contact forces yet that is inside a tool, by more than tools travel in the increment."""
    system, state = increment.system, increment.start
    if state.forces.any() or touches(-state.gap, system.body.scene.size).all():
        return None
    worst = int(np.argmin(state.gap))
    depth = -float(state.gap[worst])
    if depth < increment.reach:
        return None
    number, node = system.candidates.tool[worst], system.candidates.node[worst]
    tool, pose = system.body.scene.tools[number], increment.tools.placed[number]
    if tool.face.beyond(tool.own(system.candidates.means.places(state.nodes)[worst], pose)):
        return (
            f"Node {node} starts behind an open end of tools[{number}], by {depth:.3g}: "
            "continue the surface to where the body does not come, or close it."
        )
    return (
        f"The body starts inside tools[{number}], node {node} by {depth:.3g}: move the tool off the body, or the mesh."
    )


def _unheld(increment: Increment) -> str | None:
    """A body that is free to move, unless its loads press it back, or friction holds what they push."""
    system, state = increment.system, increment.start
    forces = system.loading.forces(state.nodes, increment.tau)
    v = free(increment, forces)
    if v is None:
        return None
    motion = system.body.space.spread(v)
    # Loads that do no work on the motion may press the contacts that it opens, as on a slope.
    if forces.any() and (vdot(forces, motion) <= ROUND_OFF * float(np.linalg.norm(forces)) or rubs(increment, v)):
        return None
    return f"Nothing holds {_moving(increment, motion)}: add a support, or friction at a contact that stays closed."


def wavering(increment: Increment) -> str | None:
    """Advice where at rest nothing would hold a part, and under load nothing but how contacts are deformed."""
    v = neutral(increment) if increment.system.candidates.deformable else None
    if v is None:
        return None
    moving = _moving(increment, increment.system.body.space.spread(v))
    return f"Nothing but the dents in its contacts holds {moving}: add a support, or friction."


def _moving(increment: Increment, motion: Floats) -> str:
    """What the ``motion`` (a, d) moves, and how, in words."""
    mesh = increment.system.body.scene.mesh
    own = mesh.part[np.argmax(norm(motion))]
    motion, whole = motion[mesh.part == own], not mesh.part.any()
    who = "the body" if whole else f"the part of element {int(np.argmax(mesh.connected == own))}"
    mean = motion.mean(axis=0)
    shift = np.where(np.abs(mean) > ROUND_OFF, mean, 0.0)
    turns = " with a turn" if float(norm(motion - mean).max()) > ROUND_OFF else ""
    what = f"moving along ({', '.join(f'{part:.3g}' for part in shift)}){turns}" if shift.any() else "turning"
    return f"{who} against {what}"


def _aloft(increment: Increment) -> str | None:
    """A tool that a moment turns in the air, where its path does not bring it to the body."""
    scene, gap = increment.system.body.scene, np.minimum(increment.rows.gap, increment.start.gap)
    for k, tool in enumerate(scene.tools):
        if tool.turned_by is None or tool.driven_by is not None:
            continue
        moment = tool.turned_by.at(increment.tau)
        if moment != 0 and not touches(gap[increment.system.candidates.tool == k], scene.size).any():
            return (
                f"tools[{k}] touches nothing that would hold its moment of {moment:.4g}: "
                "bring it to the body before it has one."
            )
    return None


def _past(increment: Increment) -> str | None:
    """A tool that a force drives past the body, or off it."""
    scene, contacts, start = increment.system.body.scene, increment.system.candidates, increment.start
    places, poses = contacts.means.places(start.nodes), scene.placed(increment.tau, start.translation)
    for k, (tool, pose) in enumerate(zip(scene.tools, poses, strict=True)):
        if tool.driven_by is not None and _goes_past(tool, places[contacts.tool == k], pose, scene.mesh.size):
            return (
                f"tools[{k}] meets none of its candidates on its way along its force: "
                "bring it to where the body is, or drive it by a path."
            )
    return None


def _goes_past(tool: Tool, places: Floats, pose: Floats, size: float) -> bool:
    """Whether a tool in the ``pose`` (p,) that goes along its force certainly meets none of the ``places`` (c, d).

    Gaps change by no more than the tool goes, so that each step may be as long as the least of them.
    """
    assert tool.driven_by is not None
    way, gone = np.append(tool.driven_by.direction, np.zeros(len(pose) - places.shape[1])), 0.0
    gap = tool.distance(places, pose)
    far = FAR * (size + max_abs(gap))
    for _ in range(STEPS):
        least = float(gap.min(initial=np.inf))
        if least <= AIR * size:
            return False
        gone += least
        if gone > far:
            return True
        gap = tool.distance(places, pose + gone * way)
    return False


def _spun(increment: Increment) -> str | None:
    """A tool whose moment exceeds, or nearly equals, what its friction holds with the present normal forces.

    A tool that is still to be pressed, by its path or a force, has no normal forces to judge from.
    """
    scene, contacts, state = increment.system.body.scene, increment.system.candidates, increment.start
    drives, tau = scene.drives, increment.tau
    if not drives.spins.any():
        return None
    here = increment.unmoved.at(np.zeros(increment.size))
    # Moments (c, d) of unit forces on candidates about the axes of turning tools; 0 for others.
    swirls = contacts.faces.swirls(here.meeting.arm)
    levers = contacts.parts.motion(np.vecdot(here.frames, swirls[:, None]))
    by_normal = contacts.driven_sums(levers[:, 0] * state.forces[:, 0])
    lever, held = norm(levers[:, 1:]), here.rows.limit(state.forces)
    # A weld holds any moment of its own tool if it has a lever.
    ties = np.isinf(held)
    by_friction = contacts.driven_sums(lever * np.where(ties, 0.0, held))
    by_friction[contacts.driven_sums(ties * lever) > 0] = np.inf
    asked = drives.at(tau) / np.where(drives.spins > 0, drives.spins, np.inf)
    coming = scene.travel(state.tau, tau).any(axis=1) | np.array([tool.driven_by is not None for tool in scene.tools])
    judged = (contacts.driven_sums(state.forces[:, 0]) > 0) | ~coming[drives.tool]
    spun = np.flatnonzero((drives.spins > 0) & judged & (np.abs(asked - by_normal) > SPINS * by_friction))
    if not len(spun):
        return None
    k = int(spun[0])
    return (
        f"tools[{drives.tool[k]}] spins: by the normal forces of tau = {state.tau:.6g} friction holds a moment of at "
        f"most {by_friction[k]:.4g}, and {asked[k] - by_normal[k]:.4g} is asked of it: press the tool harder, turn it "
        "by a smaller moment, or by an angle."
    )


def cornered(increment: Increment) -> str | None:
    """The sentence on a node that pushes against a tool next to a sharp corner of it, None if there is none.

    A node is next to a corner if it may reach it by the motions of the increment, which has failed; not in a plane of
    symmetry or on an axis, where a corner and its mirror image push along one direction together.
    """
    start, contacts = increment.start, increment.system.candidates
    if not contacts.curved:
        return None
    drift = increment.past.quicker * float(norm(start.velocity).max()) * (increment.tau - start.tau)
    turned, scene = _turned(increment, increment.reach + drift) * carries(start.forces), contacts.scene
    for plane in scene.mirrors:
        turned[plane.holds(scene.mesh.nodes[contacts.node])] = 0.0
    worst = int(np.argmax(turned))
    if turned[worst] < SHARP:
        return None
    return (
        f"Node {contacts.node[worst]} is at a sharp corner of tools[{contacts.tool[worst]}], which pushes along one "
        "normal alone there: give the corner a fillet, or make its sides tools of their own."
    )


def level(increment: Increment) -> str | None:
    """The sentence on a side that comes to lie on a flat tool which does not feel it, None if there is none.

    It is beside candidates that push. What was level with them at rest, as the face beside a punch, is no such side.
    """
    start, contacts = increment.start, increment.system.candidates
    mesh, pushing = contacts.scene.mesh, carries(start.forces)
    facets = mesh.outline[:, mesh.element.ends]
    for k, (tool, pose) in enumerate(zip(contacts.scene.tools, increment.tools.placed, strict=True)):
        if not isinstance(tool, FlatTool):
            continue
        foreign = ~np.isin(facets, mesh.boundary_nodes(*tool.candidates))
        beside = np.isin(facets, contacts.node[pushing & (contacts.tool == k)]).any(axis=1) & foreign.any(axis=1)
        slopes = [_slopes(tool, pose, x[facets], foreign) for x in (mesh.nodes, start.nodes)]
        if not (found := facets[beside & (slopes[0] > LEVEL) & (slopes[1] < LEVEL)]).size:
            continue
        names = [name for name in mesh.boundaries if np.isin(found[0], mesh.boundary_nodes(name)).all()]
        what = repr(names[0]) if names else f"what is between nodes {found[0].tolist()}"
        return f"Or make {what} a candidate of tools[{k}], on which it comes to lie."
    return None


def _slopes(tool: FlatTool, pose: Floats, x: Floats, foreign: Bools) -> Floats:
    """How steeply facets with ends at x (f, n, d) leave the tool (f,), from the others to those ``foreign`` (f, n)."""
    gap = tool.distance(x, pose)
    rise = np.where(foreign, gap, -np.inf).max(axis=1) - np.where(foreign, np.inf, gap).min(axis=1)
    return rise / norm(x[:, :, None] - x[:, None]).max(axis=(1, 2))


def _turned(increment: Increment, length: float) -> Floats:
    """The largest angle (c,) between a candidate's normal and those at ``length`` from it along the axes; 0 if flat."""
    contacts, scene = increment.system.candidates, increment.system.body.scene
    places, out = contacts.means.places(increment.start.nodes), np.zeros(len(contacts.tool))
    around = length * np.vstack([np.eye(scene.mesh.dimension), -np.eye(scene.mesh.dimension)])
    for k, (tool, pose) in enumerate(zip(scene.tools, increment.tools.placed, strict=True)):
        own = contacts.tool == k
        if tool.flat or not own.any():
            continue
        x = tool.own(places[own], pose)
        cosines = np.vecdot(tool.face.distance(x[:, None] + around).normal, tool.face.distance(x).normal[:, None])
        out[own] = np.arccos(np.clip(cosines.min(axis=1), -1.0, 1.0))
    return out
