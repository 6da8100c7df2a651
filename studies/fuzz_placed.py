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
from bipot.tools import FlatTool
from bipot.typing import Floats, Ints
from studies.flat import flat_tools
from studies.independent_data import Led

FLAT = 1e-9
"""A normal with less than this along a direction has none: a plane of symmetry across that cuts the tool."""


def along_path(scene: Scene, tau: float, tau_end: float) -> Floats:
    """Displacement (k, d) of the tools along their paths between two times."""
    moved = [(_multiple(t, tau_end) - _multiple(t, tau)) * np.array(t.travel) for t in flat_tools(scene)]
    across = np.array(moved).reshape(-1, 2)
    way = directions(scene)
    return across - np.vecdot(across, way)[:, None] * way


def tools_at(scene: Scene, state: State) -> Floats:
    """Displacement (k, d) of the tools since rest."""
    return along_path(scene, 0.0, state.tau) + _led(scene, state.translation)


def tools_gone(scene: Scene, start: State, end: State) -> Floats:
    """Displacement (k, d) of the tools in the increment that led to ``end``: no difference of positions."""
    return along_path(scene, start.tau, end.tau) + _led(scene, end.translated)


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
    planes = {support.direction for support in scene.supports if isinstance(support, Symmetry)}
    tools = [scene.tools[k] for k in driven_tools(scene)]
    return np.array([0.5 ** sum(abs(tool.normal[d]) < FLAT for d in planes) for tool in tools])


def led_of(scene: Scene, tau: float, start: State, end: State | None = None) -> Led:
    """The tools that forces drive in an increment to ``tau``, which has led to ``end`` unless it is still to come."""
    number, end = driven_tools(scene), start if end is None else end
    return Led(
        tool=number,
        normal=np.array([tool.normal for tool in flat_tools(scene)]).reshape(-1, 2)[number],
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
            out[mine, support.direction] = support.displacement * _at(support.amplitude, tau)
    return out


def _led(scene: Scene, translation: Floats) -> Floats:
    out, number = np.zeros((len(scene.tools), 2)), driven_tools(scene)
    out[number] = translation[:, None] * directions(scene)[number]
    return out


def _at(amplitude: Amplitude, tau: float) -> float:
    taus, multiples = np.transpose(amplitude.points)
    return float(np.interp(tau, taus, multiples))


def _multiple(tool: FlatTool, tau: float) -> Floats:
    """Multiples (d,) of the travel's components."""
    taus = [point[0] for point in tool.path]
    return np.array([np.interp(tau, taus, [np.ravel(m)[k % np.size(m)] for _, m in tool.path]) for k in range(2)])
