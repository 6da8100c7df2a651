"""The one place where the fuzz study reads the library's results: accepted increments as plain arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bipot.accepted import Accepted
from bipot.certificate import Bounds
from bipot.determinacy import branches
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.hardening import Hardening, Linear, Perfect, Tabulated, Voce
from bipot.laws.von_mises import VonMises
from bipot.loads import BodyForce, PointForce, Pressure, Traction
from bipot.response import State
from bipot.scene import Scene
from bipot.tools import FlatTool
from bipot.typing import Floats, Ints
from studies.independent_contact import FREE
from studies.independent_data import Contacts, Moment, Setting, Step, mandel_to_full
from studies.independent_loads import Applied, nodal_loads


def setting_of(scene: Scene) -> Setting:
    """What stays the same in a run."""
    held = np.zeros(scene.mesh.nodes.shape, dtype=bool)
    for support in scene.supports:
        held[np.unique(scene.mesh.boundaries[support.boundary]), support.direction] = True
    assert isinstance(scene.material, VonMises)
    return Setting(
        elements=scene.mesh.elements,
        axisymmetric=scene.geometry is Geometry.AXISYMMETRIC,
        midpoint=scene.configuration is Configuration.MIDPOINT,
        quadrature=scene.rule.value,
        young=scene.material.elasticity.young,
        poisson=scene.material.elasticity.poisson,
        yield_stress=_curve(scene.material.hardening),
        held=held,
        size=float(np.ptp(scene.mesh.nodes, axis=0).max()),
        rest=scene.mesh.nodes,
        small=scene.configuration is Configuration.SMALL,
    )


def nodes_of(scene: Scene, setting: Setting, movable: bool = True) -> tuple[Ints, Ints]:
    """Node and tool (c,) of every candidate, a node of a tool's boundaries that can move along its normal.

    Of the others, which supports hold along it, if not ``movable``.
    """
    nodes, tools = [], []
    for k, tool in enumerate(scene.tools):
        mine = np.unique(np.concatenate([scene.mesh.boundaries[name].ravel() for name in tool.candidates]))
        asked = (~setting.held[mine] & (np.abs(tool.normal) > FREE)).any(axis=1) == movable
        nodes.append(mine[asked])
        tools.append(np.full(int(asked.sum()), k))
    return np.concatenate(nodes), np.concatenate(tools)


def step_of(scene: Scene, setting: Setting, accepted: Accepted, largest: float) -> Step:
    """The increment as stored; ``largest`` is the largest contact force of the run up to its end."""
    node, tool = nodes_of(scene, setting)
    start, end = accepted.start, accepted.state
    if len(node) != len(end.forces):
        raise ValueError(f"{len(end.forces)} contact forces for {len(node)} candidate nodes")
    stored: Any = getattr(end, "du", None)
    flow = start.flow
    return Step(
        start=_moment(start),
        end=_moment(end),
        displacement=end.nodes - start.nodes if stored is None else stored,
        by_difference=stored is None,
        contacts=_contacts(scene, node, tool, start.tau, end.tau),
        held=_contacts(scene, *nodes_of(scene, setting, movable=False), start.tau, end.tau),
        gap=getattr(end, "gap", None),
        flow=None if flow is None else (mandel_to_full(flow.strain), flow.peeq),
        largest=largest,
        loads=_loads(scene, setting, start, end),
    )


def reported_unique(accepted: Accepted) -> bool:
    """Whether the library says that the answer is the only one and is resolved, and sees no branch."""
    solved = accepted.solved
    blurred = solved.certificate.below_resolution(Bounds())
    return accepted.unique and not blurred and not branches(solved.iterate, solved.r)


def idle(scene: Scene, setting: Setting, accepted: Accepted, share: float) -> bool:
    """Whether stress and contact forces are below a ``share`` of what the motion would make as elastic strain."""
    state, size = accepted.state, setting.size
    tools = [_moved(t, state.tau) - _moved(t, accepted.start.tau) for t in scene.tools]
    moved = max(float(np.abs(state.du).max()), float(np.abs(tools).max()))
    stress = share * (3 * setting.bulk + 2 * setting.shear) * moved / size
    force = stress * (size**2 if setting.axisymmetric else size)
    return bool(np.abs(state.stress).max() < stress and np.abs(state.forces).max(initial=0.0) < force)


@dataclass(frozen=True)
class Pushed:
    """Contact forces (c, d) of the tools ``tool`` (c,) on candidates at the end, with what rubs on supports.

    A candidate that supports hold along the tangent takes friction too where the tool moves along it (``rubs``).
    """

    tool: Ints
    forces: Floats
    rubs: bool


def pushed_by(scene: Scene, setting: Setting, accepted: Accepted) -> Pushed:
    """The forces of an accepted increment."""
    node, tool = nodes_of(scene, setting)
    c, r = _contacts(scene, node, tool, accepted.start.tau, accepted.state.tau), accepted.state.forces
    held = ~(~setting.held[node] & (np.abs(c.tangent) > FREE)).any(axis=1)
    rubbed = np.where(held & np.isfinite(c.mu), c.mu, 0.0) * np.sign(np.vecdot(c.tangent, c.motion))
    friction = r[:, 1] + rubbed * r[:, 0]
    return Pushed(tool, r[:, :1] * c.normal + friction[:, None] * c.tangent, bool(rubbed.any()))


def forces_by_node(scene: Scene, setting: Setting, state: State) -> Floats:
    """Contact forces as vectors (tools, a, d)."""
    node, tool = nodes_of(scene, setting)
    normal = np.array([t.normal for t in scene.tools])[tool]
    tangent = np.column_stack([normal[:, 1], -normal[:, 0]])
    out = np.zeros((len(scene.tools), *scene.mesh.nodes.shape))
    out[tool, node] = state.forces[:, :1] * normal + state.forces[:, 1:] * tangent
    return out


def _loads(scene: Scene, setting: Setting, start: State, end: State) -> tuple[Floats, Floats, Floats]:
    """Nodal forces at start and end, each where equilibrium is asked, and the sizes of those at the end."""
    s, paper = setting, scene.configuration is Configuration.PAPER
    begun, ended = (s.rest, s.rest) if s.small else (start.nodes, start.nodes if paper else end.nodes)
    at = [
        nodal_loads(_applied(scene, state.tau), s.rest, nodes, s.elements, s.quadrature, s.axisymmetric)
        for state, nodes in ((start, begun), (end, ended))
    ]
    return at[0][0], at[1][0], at[1][1]


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


def _contacts(scene: Scene, node: Ints, tool: Ints, tau: float, tau_end: float) -> Contacts:
    normal = np.array([t.normal for t in scene.tools])
    point = np.array([t.point for t in scene.tools])
    begun, ended = (np.array([_moved(t, at) for t in scene.tools]) for at in (tau, tau_end))
    # A difference of multiples: positions of a tool far away would lose small travels.
    motion = np.array([_multiple(t, tau_end) - _multiple(t, tau) for t in scene.tools]).reshape(-1, 2)
    mu = np.array([scene.tools[k].mu_at.get(int(a), scene.tools[k].mu) for a, k in zip(node, tool, strict=True)])
    return Contacts(
        node=node,
        normal=normal[tool],
        mu=mu,
        offset=np.vecdot(normal, point + begun)[tool],
        offset_end=np.vecdot(normal, point + ended)[tool],
        motion=(motion * np.array([t.travel for t in scene.tools]).reshape(-1, 2))[tool],
    )


def _multiple(tool: FlatTool, tau: float) -> Floats:
    """Multiples (d,) of the travel's components."""
    taus = [point[0] for point in tool.path]
    return np.array([np.interp(tau, taus, [np.ravel(m)[k % np.size(m)] for _, m in tool.path]) for k in range(2)])


def _moved(tool: FlatTool, tau: float) -> Floats:
    return _multiple(tool, tau) * np.array(tool.travel)


def _curve(hardening: Hardening) -> Callable[[Floats], Floats]:
    """The yield stress written a second time, from the curve's numbers."""
    if isinstance(hardening, Perfect):
        sigma = hardening.sigma_y
        return lambda p: sigma + 0 * p
    if isinstance(hardening, Linear):
        sigma, slope = hardening.sigma_y, hardening.modulus
        return lambda p: sigma + slope * p
    if isinstance(hardening, Voce):
        h = hardening
        return lambda p: h.sigma_y + h.saturation * (1 - np.exp(-h.rate * p)) + h.modulus * p
    if isinstance(hardening, Tabulated):
        x, y = np.array(hardening.peeq), np.array(hardening.stress)
        return lambda p: np.interp(p, x, y)
    raise TypeError(f"no curve known for {hardening!r}")
