"""Where tools in space ought to be: paths, turns, forces and moments read a second time.

A pose is how far (3,) a tool has gone since rest, and by what angle it has turned about its axis: four numbers.
"""

from __future__ import annotations

import numpy as np

from bipot.control.accepted import Accepted
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Symmetry
from bipot.state import State
from bipot.tools.deformable import AnyTool
from bipot.typing import Bools, Floats, einsum
from studies.fuzz.placed import Drive, driven_by
from studies.fuzz.solid_held import asked, direction_of, freed, multiple, planes_of, prescribed_at
from studies.fuzz.solid_surfaces import cut, faces, gap_of
from studies.independent.solid_tools import Solid


def drives(scene: Scene) -> list[Drive]:
    """What drives tools, as :func:`studies.fuzz.placed.drives`."""
    size = scene.mesh.size
    return driven_by(scene, lambda tool, centre: max(abs(gap_of(tool.face, centre)), size))


def solid(scene: Scene, number: int, accepted: Accepted) -> Solid:
    """A tool in an increment, a flat one too."""
    tool, start, end = scene.tools[number], accepted.start, accepted.state
    by_path = _by_path(tool, end.tau) - _by_path(tool, start.tau)
    by_moment = _led(scene, number, end.translated)
    return Solid(
        faces=faces(tool.face),
        centre=np.zeros(3) if tool.turn is None else np.array(tool.turn.centre),
        axis=axis_of(tool),
        begun=pose(scene, number, start),
        ended=pose(scene, number, end),
        gone=by_path + by_moment,
        by_moment=float(by_moment[3]),
    )


def pose(scene: Scene, number: int, state: State) -> Floats:
    """That (4,) of a tool in a state."""
    return _by_path(scene.tools[number], state.tau) + _led(scene, number, state.translation)


def axis_of(tool: AnyTool) -> Floats:
    """What a tool turns about (3,), any axis if it does not."""
    return np.array([0.0, 0.0, 1.0] if tool.turn is None else tool.turn.axis)


def _by_path(tool: AnyTool, tau: float) -> Floats:
    """What the path and the prescribed turn make of a pose (4,)."""
    taus = [at for at, _ in tool.path]
    values = np.array([np.broadcast_to(own, 3) for _, own in tool.path], dtype=np.float64)
    moved = np.array([np.interp(tau, taus, own) for own in values.T]) * np.array(tool.travel)
    return np.append(moved, 0.0 if tool.turn is None else tool.turn.angle * multiple(tool.turn.amplitude, tau))


def _led(scene: Scene, number: int, coordinates: Floats) -> Floats:
    """What a pose (4,) changes by as the drives' ``coordinates`` (m,) do from zero."""
    out, force = np.zeros(4), scene.tools[number].driven_by
    for drive, by in zip(drives(scene), coordinates.tolist(), strict=True):
        if drive.number == number and drive.spin:
            out[3] += by * drive.spin
        elif drive.number == number:
            assert force is not None
            out[:3] += by * np.array(force.vector) / np.linalg.norm(force.vector)
    return out


def cuts(scene: Scene, tool: AnyTool) -> list[tuple[Floats, Bools]]:
    """The planes of symmetry in which a tool is its own mirror image, as :func:`studies.fuzz.solid_held.planes_of`."""
    x = scene.mesh.nodes
    return [(way, inside) for way, inside in planes_of(scene) if cut(tool, way, float((x[inside] @ way).mean()))]


def way_along(scene: Scene, before: float, after: float) -> Floats:
    """Translation (3,) between two times of a body that nothing but its supports moves.

    In the planes of symmetry the one nearest to what other supports ask for, by least squares.
    """
    if not any(isinstance(support, Prescribed) for support in scene.supports):
        return np.zeros(3)
    others = [support for support in scene.supports if not isinstance(support, Symmetry)]
    normals = np.array([way for way, _ in planes_of(scene)]).reshape(-1, 3)
    inside = np.eye(3) - np.linalg.pinv(normals) @ normals
    by = np.array([asked(support, after) - asked(support, before) for support in others])
    ways = np.array([direction_of(support) for support in others]) @ inside
    return np.asarray(np.linalg.pinv(ways, rcond=1e-9) @ by, np.float64)


def taken_along(scene: Scene, before: float, after: float) -> Floats:
    """Displacement (a, 3) of such a body: it goes that way, and what supports hold goes as they ask."""
    way, alone = way_along(scene, before, after), prescribed_at(scene, after) - prescribed_at(scene, before)
    return way + einsum("aij,aj->ai", np.eye(3) - freed(scene), alone - way)


def alone_gone(scene: Scene, number: int, accepted: Accepted) -> Floats:
    """What a pose (4,) changes by along the path and by the prescribed turn alone."""
    tool = scene.tools[number]
    return _by_path(tool, accepted.state.tau) - _by_path(tool, accepted.start.tau)


def asked_of(scene: Scene, number: int, tau: float) -> tuple[float, float]:
    """The force and the moment that drive a tool at a time, zero where none does."""
    own = [(bool(drive.spin), drive.at(tau)) for drive in drives(scene) if drive.number == number]
    return sum(at for spins, at in own if not spins), sum(at for spins, at in own if spins)
