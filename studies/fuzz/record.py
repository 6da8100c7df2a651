"""The one place where the fuzz study reads the library's results: accepted increments as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bipot.certificate import Bounds
from bipot.checks.determinacy import branches
from bipot.control.accepted import Accepted
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.scene.loads import BodyForce, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.typing import Bools, Floats, Ints
from studies.fuzz.contacts import contacts, facing, shaped
from studies.fuzz.metals import moduli, yield_stress_of
from studies.fuzz.placed import held_by, led_of, planes, prescribed_at, tools_gone
from studies.fuzz.points import held_nodes, posed
from studies.independent.between import surface_of
from studies.independent.candidates import Contacts
from studies.independent.contact import TOUCHING
from studies.independent.data import Moment, Setting, Step, mandel_to_full
from studies.independent.loads import Applied, nodal_loads
from studies.independent.tools import Rigid

TOGETHER = 1e-9
"""A slip below this fraction of what tool and support move by is none."""

IN_PLANE = 1e-9
"""Of the body's size: who is no farther from a plane is in it."""


def setting_of(scene: Scene) -> Setting:
    """What stays the same in a run."""
    axes, held = held_by(scene)
    young, poisson = moduli(scene)
    x, size = scene.mesh.nodes, float(np.ptp(scene.mesh.nodes, axis=0).max())
    mirrors = planes(scene)
    beside = [np.flatnonzero(np.abs(x[:, d] - position) <= IN_PLANE * size) for d, position in mirrors]
    if scene.geometry is Geometry.AXISYMMETRIC:
        mirrors.append((0, 0.0))
        beside.append(np.flatnonzero(np.abs(x[:, 0]) <= IN_PLANE * size))
    return Setting(
        elements=scene.mesh.elements,
        axisymmetric=scene.geometry is Geometry.AXISYMMETRIC,
        midpoint=scene.configuration is Configuration.MIDPOINT,
        quadrature=scene.rule.value,
        young=young,
        poisson=poisson,
        yield_stress=yield_stress_of(scene),
        held=held,
        size=size,
        rest=scene.mesh.nodes,
        small=scene.configuration is Configuration.SMALL,
        volume=scene.volume_change.value,
        surface=surface_of(scene.mesh.elements, beside),
        mirrors=tuple(mirrors),
        axes=axes if (axes != np.eye(2)).any() else None,
    )


def step_of(scene: Scene, setting: Setting, accepted: Accepted, largest: float) -> Step:
    """The increment as stored; ``largest`` is the largest contact force of the run up to its end."""
    points = posed(scene, setting)
    start, end = accepted.start, accepted.state
    if len(points.node) != len(end.forces):
        raise ValueError(f"{len(end.forces)} contact forces for {len(points.node)} candidates")
    held = facing(scene, setting, held_nodes(scene, setting), start, end)
    at = contacts(scene, setting, points, start, end), held, shaped(scene, start, end)
    return step_at(scene, setting, accepted, largest, *at)


def step_at(
    scene: Scene,
    setting: Setting,
    accepted: Accepted,
    largest: float,
    candidates: Contacts,
    held: Contacts,
    tools: tuple[Rigid, ...] = (),
) -> Step:
    """The increment as stored, with these ``candidates`` and ``held`` nodes at its tools."""
    start, end = accepted.start, accepted.state
    stored: Any = getattr(end, "du", None)
    flow = start.flow
    return Step(
        start=_moment(start),
        end=_moment(end),
        displacement=end.nodes - start.nodes if stored is None else stored,
        by_difference=stored is None,
        contacts=candidates,
        held=held,
        gap=getattr(end, "gap", None),
        flow=None if flow is None else (mandel_to_full(flow.strain), flow.peeq),
        largest=largest,
        loads=_loads(scene, setting, start, end),
        prescribed=(prescribed_at(scene, start.tau), prescribed_at(scene, end.tau)),
        led=led_of(scene, end.tau, start, end),
        balanced=_balanced(scene, setting, start),
        tools=tools,
    )


def reported_unique(accepted: Accepted) -> bool:
    """Whether the library says that the answer is the only one and is resolved, and sees no branch."""
    solved = accepted.solved
    blurred = solved.certificate.below_resolution(Bounds())
    return accepted.unique and not blurred and not branches(solved.iterate, solved.r)


def is_round_off(accepted: Accepted, asked: float) -> bool:
    """Whether what is ``asked`` of a tool is nothing, and the library says that contact forces are below resolution."""
    return not asked and "law" in accepted.solved.certificate.below_resolution(Bounds())


def idle(scene: Scene, setting: Setting, accepted: Accepted, share: float) -> tuple[bool, bool]:
    """Whether stress, and contact forces, are below a ``share`` of what the motion would make as elastic strain."""
    state, size = accepted.state, setting.size
    tools = tools_gone(scene, accepted.start, state)
    moved = max(float(np.abs(state.du).max()), float(np.abs(tools).max()))
    stress = share * float((3 * setting.bulk + 2 * setting.shear).max()) * moved / size
    force = stress * (size**2 if setting.axisymmetric else size)
    return bool(np.abs(state.stress).max() < stress), bool(np.abs(state.forces).max(initial=0.0) < force)


@dataclass(frozen=True)
class Pushed:
    """Contact forces (w, d) of the tools ``tool`` (w,) on a ``node`` (w,) at the end, with what rubs on supports.

    They are the nodes' shares of forces on candidates, ``nodal`` (a, d) their sums.

    A candidate that supports hold along the tangent takes friction too where the tool moves along it (``rubs``).
    """

    node: Ints
    tool: Ints
    forces: Floats
    nodal: Floats
    rubs: bool


def pushed_by(scene: Scene, setting: Setting, accepted: Accepted) -> Pushed:
    """The forces of an accepted increment."""
    start, end, points = accepted.start, accepted.state, posed(scene, setting)
    c, r = contacts(scene, setting, points, start, end), end.forces
    asked = (prescribed_at(scene, end.tau) - prescribed_at(scene, start.tau))[c.parts.node]
    slip = c.parts.mean(np.vecdot(c.tangent, c.motion - asked))
    # That support and tool go together is a difference of round-off.
    together = np.abs(slip) <= TOGETHER * c.parts.most(np.linalg.norm(c.motion, axis=1) + np.linalg.norm(asked, axis=1))
    held = points.fixed & ~together
    rubbed = np.where(held & ~c.welded, c.most(r), 0.0) * np.sign(slip)
    friction = r[:, 1] + rubbed
    forces = c.vectors(np.column_stack([r[:, 0], friction]))
    return Pushed(c.parts.node, c.met, forces, c.on_nodes(forces), bool(rubbed.any()))


def forces_by_node(scene: Scene, setting: Setting, state: State) -> Floats:
    """Contact forces as vectors (tools, a, d) on nodes: those of means are as unique as these."""
    c = contacts(scene, setting, posed(scene, setting), state, state)
    mine = c.met == np.arange(len(scene.tools))[:, None]
    return np.stack([c.on_nodes(own[:, None] * c.vectors(state.forces)) for own in mine])


def _balanced(scene: Scene, setting: Setting, start: State) -> Floats:
    """Where a state that an increment starts from is in equilibrium (a, 2)."""
    if setting.small:
        return setting.rest
    return start.nodes - start.du if scene.configuration is Configuration.PAPER else start.nodes


def _loads(scene: Scene, setting: Setting, start: State, end: State) -> tuple[Floats, Floats, Floats]:
    """Nodal forces at start and end, each where equilibrium is asked, and the sizes of those at the end."""
    s, paper = setting, scene.configuration is Configuration.PAPER
    begun, ended = _balanced(scene, s, start), s.rest if s.small else start.nodes if paper else end.nodes
    at = [loads_at(scene, s, nodes, tau) for tau, nodes in ((start.tau, begun), (end.tau, ended))]
    return carried(start, at[0][0]), *at[1]


def carried(start: State, loads: Floats) -> Floats:
    """What of the ``loads`` (a, d) at the start of an increment a body carries there: at rest none."""
    return loads if start.tau > 0 or start.stress.any() else np.zeros_like(loads)


def loads_at(scene: Scene, s: Setting, nodes: Floats, tau: float) -> tuple[Floats, Floats]:
    """Nodal forces (a, d) of the loads at a time on the configuration ``nodes`` (a, d), and the sizes (a,) of those."""
    return nodal_loads(_applied(scene, tau), s.rest, nodes, s.elements, s.quadrature, s.axisymmetric)


def candidates_at(scene: Scene, setting: Setting, state: State) -> tuple[Contacts, Bools]:
    """The candidates at a state that a next increment starts from, and which (c,) of them touch a tool, not past it."""
    there = contacts(scene, setting, posed(scene, setting), state, state)
    return there, (there.gap(state.nodes) <= TOUCHING * setting.whole) & ~there.past


def _applied(scene: Scene, tau: float) -> Applied:
    """The loads at a time, in plain numbers."""
    nodes, body, edges, traction, pressure = scene.mesh.nodes, np.zeros(2), list[Ints](), list[Floats](), list[float]()
    point = np.zeros(nodes.shape)
    for load in scene.loads:
        taus, multiples = np.transpose(load.amplitude.points)
        now = float(np.interp(tau, taus, multiples))
        if isinstance(load, BodyForce):
            body += now * np.array(load.vector)
        elif isinstance(load, PointForce):
            point[load.node] += now * np.array(load.vector)
        elif isinstance(load, Traction | Pressure):
            mine = scene.mesh.boundaries[load.boundary]
            pushes = isinstance(load, Pressure)
            edges += list(mine)
            traction += [np.zeros(2) if pushes else now * np.array(load.vector)] * len(mine)
            pressure += [now * load.pressure if pushes else 0.0] * len(mine)
    holders = [int(np.flatnonzero(np.isin(scene.mesh.elements, edge).sum(axis=1) == len(edge))[0]) for edge in edges]
    return Applied(
        body=body,
        edges=np.array(edges, dtype=np.intp).reshape(-1, scene.mesh.element.edges.shape[1]),
        owner=np.array(holders, dtype=np.intp),
        traction=np.array(traction).reshape(-1, 2),
        pressure=np.array(pressure),
        point=point,
    )


def _moment(state: State) -> Moment:
    stress, plastic = mandel_to_full(state.stress), mandel_to_full(state.plastic_strain)
    return Moment(state.nodes, stress, plastic, state.peeq, state.forces)
