"""Where tools, and nodes that supports hold, ought to be: paths, forces and amplitudes read a second time.

A tool that a force drives goes its path across the force, and along it as far as the state says it has come. The state
says of one that a moment turns the angle times its lever.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bipot.fem.reduction import Geometry
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Symmetry
from bipot.state import State
from bipot.tools.deformable import AnyTool
from bipot.tools.tool import FlatTool
from bipot.typing import Bools, Floats, einsum
from studies.flat import axis_of
from studies.fuzz.surfaces import cut, outlines
from studies.independent.data import Led
from studies.independent.outline import cross

SAME = 1e-9
"""Sine of the angle between directions that are one."""

STRAIGHT = 1e-12
"""Of a unit vector along an axis the other component, by round-off."""


def along_path(scene: Scene, tau: float, tau_end: float) -> Floats:
    """Displacement (k, d) of the tools along their paths between two times."""
    moved = [(_multiple(t, tau_end) - _multiple(t, tau)) * np.array(t.travel) for t in scene.tools]
    across = np.array(moved).reshape(-1, 2)
    way = directions(scene)
    return across - np.vecdot(across, way)[:, None] * way


def tools_at(scene: Scene, state: State) -> Floats:
    """Displacement (k, d) of the tools since rest."""
    return along_path(scene, 0.0, state.tau) + _led(scene, state.translation)[:, :2]


def tools_gone(scene: Scene, start: State, end: State) -> Floats:
    """Displacement (k, d) of the tools in the increment that led to ``end``: no difference of positions."""
    return along_path(scene, start.tau, end.tau) + _led(scene, end.translated)[:, :2]


def poses(scene: Scene, state: State) -> Floats:
    """How far the tools have gone since rest, and by what angle turned (k, 3)."""
    angles = [0.0 if t.turn is None else t.turn.angle * _at(t.turn.amplitude, state.tau) for t in scene.tools]
    return np.column_stack([tools_at(scene, state), angles + _led(scene, state.translation)[:, 2]])


def gone(scene: Scene, start: State, end: State) -> Floats:
    """What poses (k, 3) change by in the increment that led to ``end``: no difference of poses."""
    turns = [None if t.turn is None else (t.turn.amplitude, t.turn.angle) for t in scene.tools]
    by_path = [0.0 if t is None else t[1] * (_at(t[0], end.tau) - _at(t[0], start.tau)) for t in turns]
    return np.column_stack([tools_gone(scene, start, end), by_path + turned_by_moments(scene, end.translated)])


def turned_by_moments(scene: Scene, coordinates: Floats) -> Floats:
    """By what angles (k,) tools turn as the drives' ``coordinates`` (m,) change so."""
    return _led(scene, coordinates)[:, 2]


def directions(scene: Scene) -> Floats:
    """Unit vectors (k, d) of the forces that drive the tools, zero where none does."""
    out = np.zeros((len(scene.tools), 2))
    for k, tool in enumerate(scene.tools):
        if tool.driven_by is not None:
            out[k] = np.array(tool.driven_by.vector) / math.hypot(*tool.driven_by.vector)
    return out


class Drive(NamedTuple):
    """What drives the tool of that ``number``: a force of so much along its direction, or a moment with a ``spin``."""

    number: int
    size: float
    amplitude: Amplitude
    spin: float

    def at(self, tau: float) -> float:
        """The force, or the moment."""
        return self.size * _at(self.amplitude, tau)


def drives(scene: Scene) -> list[Drive]:
    """What drives tools of a scene in a plane."""
    return driven_by(scene, lambda tool, centre: _lever(scene, tool, centre))


def driven_by(scene: Scene, lever: Callable[[AnyTool, Floats], float]) -> list[Drive]:
    """What drives tools, tool by tool, a force before a moment; a coordinate of the state is that of each.

    The ``lever`` is that of a tool which a moment turns about a centre (d,).
    """
    out = list[Drive]()
    for k, tool in enumerate(scene.tools):
        force, moment = tool.driven_by, None if tool.turn is None else tool.turn.driven_by
        if force is not None:
            out.append(Drive(k, math.hypot(*force.vector), force.amplitude, 0.0))
        if tool.turn is not None and moment is not None:
            spin = 1 / lever(tool, np.array(tool.turn.centre))
            out.append(Drive(k, moment.value, moment.amplitude, spin))
    return out


def _lever(scene: Scene, tool: AnyTool, centre: Floats) -> float:
    """How far the centre of a turn is from the surface, or the body's larger side where that is more."""
    size = float(np.ptp(scene.mesh.nodes, axis=0).max())
    return max(abs(float(min(outline.near(centre[None]).gap[0] for outline in outlines(tool.face)))), size)


def halves(scene: Scene) -> Floats:
    """Parts (m,) of the driven tools that are modelled: a half for each direction across which planes cut the tool."""
    tools, across = [scene.tools[drive.number] for drive in drives(scene)], planes(scene)
    return np.array([0.5 ** sum(cut(tool, *plane) for plane in across) for tool in tools])


def planes(scene: Scene) -> list[tuple[int, float]]:
    """Planes of symmetry x_direction = position."""
    found = {axis_of(s): s.boundary for s in scene.supports if isinstance(s, Symmetry)}
    return [(d, float(scene.mesh.nodes[scene.mesh.boundary_nodes(name), d].mean())) for d, name in found.items()]


def led_of(scene: Scene, tau: float, start: State, end: State | None = None) -> Led:
    """The tools that are driven in an increment to ``tau``, which has led to ``end`` unless it is still to come."""
    every, end = drives(scene), start if end is None else end
    number = np.array([drive.number for drive in every], dtype=np.intp)
    spin = np.array([drive.spin for drive in every])
    tools = [scene.tools[k] for k in number.tolist()]
    turns = np.array([(0.0, 0.0) if t.turn is None else t.turn.centre for t in tools]).reshape(-1, 2)
    forces = np.array([drive.at(tau) * (drive.spin or 1.0) for drive in every])
    return Led(
        tool=number,
        normal=np.array([t.normal if isinstance(t, FlatTool) else (0.0, 0.0) for t in tools]).reshape(-1, 2),
        direction=np.where(spin[:, None] > 0, 0.0, directions(scene)[number]),
        spin=spin,
        centre=turns + tools_at(scene, end)[number],
        force=forces * halves(scene),
        begun=start.translation,
        ended=end.translation,
        advance=end.translated,
    )


def directions_of(scene: Scene) -> Floats:
    """Unit vectors (s, 2) along which supports hold."""
    out = np.zeros((len(scene.supports), 2))
    for own, support in zip(out, scene.supports, strict=True):
        own[:] = np.arange(2) == support.direction if isinstance(support.direction, int) else support.direction
    return out


def held_by(scene: Scene) -> tuple[Floats, Bools]:
    """Axes (a, 2, 2) of the nodes, and which of the components along them are held (a, 2): n and across it, or both.

    The coordinates' own where a node is held along one of these, or both ways, or not.
    """
    axes, held = np.tile(np.eye(2), (len(scene.mesh.nodes), 1, 1)), np.zeros(scene.mesh.nodes.shape, dtype=bool)
    for support, n in zip(scene.supports, directions_of(scene), strict=True):
        for a in np.unique(scene.mesh.boundaries[support.boundary]).tolist():
            if held[a].all() or (held[a].any() and abs(cross(axes[a][held[a]][0], n)) < SAME):
                continue
            if held[a].any():
                axes[a], held[a] = np.eye(2), True
            elif np.abs(n).min() <= STRAIGHT:
                held[a, np.argmax(np.abs(n))] = True
            else:
                axes[a], held[a, 0] = [n, (-n[1], n[0])], True
    return axes, held


def prescribed_at(scene: Scene, tau: float) -> Floats:
    """Displacement (a, d) since rest that supports ask of the nodes they hold, and none of what they leave free.

    Of two along different directions what agrees with both, u . n_1 = v_1 and u . n_2 = v_2.
    """
    asked = [list[tuple[Floats, float]]() for _ in scene.mesh.nodes]
    for support, n in zip(scene.supports, directions_of(scene), strict=True):
        value = support.displacement * _at(support.amplitude, tau) if isinstance(support, Prescribed) else 0.0
        for a in np.unique(scene.mesh.boundaries[support.boundary]).tolist():
            if not any(abs(float(cross(other, n))) < SAME for other, _ in asked[a]):
                asked[a].append((n, value))
    out = np.zeros(scene.mesh.nodes.shape)
    for a, conditions in enumerate(asked):
        if len(conditions) == 1:
            out[a] = conditions[0][1] * conditions[0][0]
        elif conditions:
            out[a] = np.linalg.solve([n for n, _ in conditions[:2]], [value for _, value in conditions[:2]])
    return out


def _led(scene: Scene, coordinates: Floats) -> Floats:
    """What poses (k, 3) change by as the drives' ``coordinates`` (m,) do from zero."""
    out, along = np.zeros((len(scene.tools), 3)), directions(scene)
    for drive, gone_by in zip(drives(scene), coordinates.tolist(), strict=True):
        out[drive.number, 2] += gone_by * drive.spin
        out[drive.number, :2] += 0.0 if drive.spin else gone_by * along[drive.number]
    return out


def _at(amplitude: Amplitude, tau: float) -> float:
    taus, multiples = np.transpose(amplitude.points)
    return float(np.interp(tau, taus, multiples))


def _multiple(tool: AnyTool, tau: float) -> Floats:
    """Multiples (d,) of the travel's components."""
    taus = [point[0] for point in tool.path]
    return np.array([np.interp(tau, taus, [np.ravel(m)[k % np.size(m)] for _, m in tool.path]) for k in range(2)])


def way_along(scene: Scene, before: float, after: float) -> Floats:
    """Translation (2,) between two times of a body that nothing but its supports moves.

    In the planes of symmetry the one nearest to what other supports ask for, by least squares, along the axis on a
    ring.
    """
    normal, asked = directions_of(scene), np.zeros(len(scene.supports))
    for k, support in enumerate(scene.supports):
        if isinstance(support, Prescribed):
            asked[k] = support.displacement * (_at(support.amplitude, after) - _at(support.amplitude, before))
    if not asked.any():
        return np.zeros(2)
    mirrored = np.array([isinstance(support, Symmetry) for support in scene.supports])
    across = across_what_holds(scene, mirrored)
    inside = np.eye(2) - np.linalg.pinv(across) @ across
    return np.linalg.pinv(normal[~mirrored] @ inside, rcond=1e-9) @ asked[~mirrored]


def taken_along(scene: Scene, before: float, after: float) -> Floats:
    """Displacement (a, 2) of such a body: it goes that way, and what supports hold goes as they ask."""
    way, alone = way_along(scene, before, after), prescribed_at(scene, after) - prescribed_at(scene, before)
    axes, held = held_by(scene)
    return way + einsum("aij,ai->aj", axes, held * einsum("aij,aj->ai", axes, alone - way))


def across_what_holds(scene: Scene, chosen: Bools) -> Floats:
    """Directions (s, 2) of the ``chosen`` supports, and across the axis on a ring; zeros if it is none."""
    ring = float(scene.geometry is Geometry.AXISYMMETRIC)
    return np.vstack([directions_of(scene)[chosen], [[ring, 0.0]]])
