"""Where tools, and nodes that supports hold, ought to be: paths, forces and amplitudes read a second time.

A tool that a force drives goes its path across the force, and along it as far as the state says it has come.
"""

from __future__ import annotations

import math

import numpy as np

from bipot.paths import Amplitude
from bipot.response import State
from bipot.scene import Scene
from bipot.supports import Prescribed, Symmetry
from bipot.tools import AnyTool
from bipot.typing import Floats, Ints
from studies.flat import axis_of, flat
from studies.fuzz_surfaces import cut
from studies.independent_data import Led


def along_path(scene: Scene, tau: float, tau_end: float) -> Floats:
    """Displacement (k, d) of the tools along their paths between two times."""
    moved = [(_multiple(t, tau_end) - _multiple(t, tau)) * np.array(t.travel) for t in scene.tools]
    across = np.array(moved).reshape(-1, 2)
    way = directions(scene)
    return across - np.vecdot(across, way)[:, None] * way


def tools_at(scene: Scene, state: State) -> Floats:
    """Displacement (k, d) of the tools since rest."""
    return along_path(scene, 0.0, state.tau) + _led(scene, state.translation)


def tools_gone(scene: Scene, start: State, end: State) -> Floats:
    """Displacement (k, d) of the tools in the increment that led to ``end``: no difference of positions."""
    return along_path(scene, start.tau, end.tau) + _led(scene, end.translated)


def poses(scene: Scene, state: State) -> Floats:
    """How far the tools have gone since rest, and by what angle turned (k, 3)."""
    angles = [0.0 if t.turn is None else t.turn.angle * _at(t.turn.amplitude, state.tau) for t in scene.tools]
    return np.column_stack([tools_at(scene, state), angles])


def gone(scene: Scene, start: State, end: State) -> Floats:
    """What poses (k, 3) change by in the increment that led to ``end``: no difference of poses."""
    turns = [None if t.turn is None else (t.turn.amplitude, t.turn.angle) for t in scene.tools]
    angles = [0.0 if t is None else t[1] * (_at(t[0], end.tau) - _at(t[0], start.tau)) for t in turns]
    return np.column_stack([tools_gone(scene, start, end), angles])


def directions(scene: Scene) -> Floats:
    """Unit vectors (k, d) of the forces that drive the tools, zero where none does."""
    out = np.zeros((len(scene.tools), 2))
    for k, tool in enumerate(scene.tools):
        if tool.driven_by is not None:
            out[k] = np.array(tool.driven_by.vector) / math.hypot(*tool.driven_by.vector)
    return out


def driven_tools(scene: Scene) -> Ints:
    """Numbers (m,) of the tools that forces drive."""
    return np.array([k for k, tool in enumerate(scene.tools) if tool.driven_by is not None], dtype=np.intp)


def forces_on_tools(scene: Scene, tau: float) -> Floats:
    """Sizes (m,) of the forces that drive whole tools."""
    forces = [tool.driven_by for tool in scene.tools if tool.driven_by is not None]
    return np.array([math.hypot(*force.vector) * _at(force.amplitude, tau) for force in forces])


def halves(scene: Scene) -> Floats:
    """Parts (m,) of the driven tools that are modelled: a half for each direction across which planes cut the tool."""
    tools, across = [scene.tools[k] for k in driven_tools(scene)], planes(scene)
    return np.array([0.5 ** sum(cut(tool, *plane) for plane in across) for tool in tools])


def planes(scene: Scene) -> list[tuple[int, float]]:
    """Planes of symmetry x_direction = position."""
    found = {axis_of(s): s.boundary for s in scene.supports if isinstance(s, Symmetry)}
    return [(d, float(scene.mesh.nodes[scene.mesh.boundary_nodes(name), d].mean())) for d, name in found.items()]


def led_of(scene: Scene, tau: float, start: State, end: State | None = None) -> Led:
    """The tools that forces drive in an increment to ``tau``, which has led to ``end`` unless it is still to come."""
    number, end = driven_tools(scene), start if end is None else end
    return Led(
        tool=number,
        normal=np.array([flat(scene.tools[k]).normal for k in number]).reshape(-1, 2),
        direction=directions(scene)[number],
        force=forces_on_tools(scene, tau) * halves(scene),
        begun=start.translation,
        ended=end.translation,
        advance=end.translated,
    )


def prescribed_at(scene: Scene, tau: float) -> Floats:
    """Displacement (a, d) since rest that supports ask of the nodes they hold."""
    out = np.zeros(scene.mesh.nodes.shape)
    for support in scene.supports:
        if isinstance(support, Prescribed):
            mine = np.unique(scene.mesh.boundaries[support.boundary])
            out[mine, axis_of(support)] = support.displacement * _at(support.amplitude, tau)
    return out


def _led(scene: Scene, translation: Floats) -> Floats:
    out, number = np.zeros((len(scene.tools), 2)), driven_tools(scene)
    out[number] = translation[:, None] * directions(scene)[number]
    return out


def _at(amplitude: Amplitude, tau: float) -> float:
    taus, multiples = np.transpose(amplitude.points)
    return float(np.interp(tau, taus, multiples))


def _multiple(tool: AnyTool, tau: float) -> Floats:
    """Multiples (d,) of the travel's components."""
    taus = [point[0] for point in tool.path]
    return np.array([np.interp(tau, taus, [np.ravel(m)[k % np.size(m)] for _, m in tool.path]) for k in range(2)])
