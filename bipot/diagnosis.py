r"""Why an increment could not be solved, where the scene itself says so: a body inside a tool, a body nothing holds.

A rigid motion v of the body (in the plane two translations and a turn, about the axis one translation) is free when
neither supports nor any candidate contact could ever stop it: zero at held unknowns, G_n v >= 0 at every candidate (no
contact closes), and no friction where the motion keeps a contact closed. Candidates count however far they are: they
may land. That is a cone in at most three numbers; a linear program says which contacts a motion in it can open.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import linprog

from bipot.fem.kinematics import Geometry
from bipot.increment import System
from bipot.response import State

Floats = NDArray[np.float64]

ROUND_OFF = 1e-9


def diagnosis(system: System, state: State) -> str | None:
    """The fitting sentence for an increment from ``state`` that failed, None where the scene shows no reason."""
    return _inside(system, state) or _unheld(system, state)


def _inside(system: System, state: State) -> str | None:
    """A body that carries nothing yet and is inside a tool."""
    gap = system.candidates.start_gap(state.nodes, state.tau)
    size = system.body.scene.mesh.size
    worst = int(np.argmin(gap))
    if state.forces.any() or gap[worst] >= -ROUND_OFF * size:
        return None
    number, node = system.candidates.tool[worst], system.candidates.node[worst]
    return (
        f"The body starts inside tools[{number}], node {node} by {-gap[worst]:.3g}: "
        "move the tool's point out of the body, or the mesh."
    )


def _unheld(system: System, state: State) -> str | None:
    motion = free_motion(system, state)
    if motion is None:
        return None
    shift, turn = motion[:2], motion[2]
    along = " with a turn" if abs(turn) > ROUND_OFF else ""
    what = f"moving along ({shift[0]:.3g}, {shift[1]:.3g}){along}" if np.abs(shift).max() > ROUND_OFF else "turning"
    return f"Nothing holds the body against {what}: add a support, or friction at a contact that stays closed."


def free_motion(system: System, state: State) -> Floats | None:
    """A rigid motion (shift_1, shift_2, turn times body size) that nothing could stop, largest part 1; None if none.

    The turn is about the middle of the body.
    """
    modes = _modes(system, state.nodes)
    rows = system.candidates.rows(state.nodes, state.tau, state.tau)
    normal, tangent = _on_candidates(system, modes)
    held = modes[system.body.scene.held]
    rubs = np.isin(np.arange(rows.count), rows.frictional)
    pinned = np.zeros(rows.count, dtype=bool)
    while True:
        stopped = np.vstack([held, tangent[pinned]])
        opened = _opened(stopped, normal)
        more = rubs & ~opened & ~pinned
        if not more.any():
            break
        pinned |= more
    return _motion(system, stopped, normal, opened)


def _modes(system: System, nodes: Floats) -> Floats:
    """Displacements (2a, 3) of the rigid motions; about the axis all but the axial shift are no rigid motions."""
    scene = system.body.scene
    arm = (nodes - nodes.mean(axis=0)) / scene.mesh.size
    modes = np.zeros((nodes.size, 3))
    modes[0::2, 0] = modes[1::2, 1] = 1.0
    modes[0::2, 2], modes[1::2, 2] = -arm[:, 1], arm[:, 0]
    if scene.geometry is Geometry.AXISYMMETRIC:
        modes[:, [0, 2]] = 0.0
    return modes
