"""What the comparisons share: a march kept as snapshots, errors between two runs."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from bipot.conic.problem import Timing
from bipot.contact.closeness import carries
from bipot.control.accepted import Accepted
from bipot.errors import IncrementFailed, ProgramError
from bipot.fem.surface import facet_mass
from bipot.forms import Penalty, Uzawa
from bipot.increment import Trial
from bipot.laws.coulomb import Status
from bipot.marching import Control, Schedule, march, system_of
from bipot.programs.condensation import factorise
from bipot.response import TangentKind
from bipot.scene.scene import Scene
from bipot.system import System
from bipot.traction import contact_edges
from bipot.typing import Floats, einsum
from studies.recovered import consistent_tractions


@dataclass(frozen=True)
class Snapshot:
    """An accepted increment: pseudo-time, punch force (N), work on the whole body, fields, and its own course.

    Nodes and velocity (a, 2); forces r (c, 2); gap, |slip| and status (c,); pressure and shear (c,) recovered by the
    consistent mass, in whose norm they are compared, NaN off the line.
    """

    tau: float
    force: float
    work: float
    nodes: Floats
    velocity: Floats
    r: Floats
    gap: Floats
    slip: Floats
    status: NDArray[np.int8]
    pressure: Floats
    shear: Floats
    relative_gap: float
    passes: int
    iterations: int
    cuts: int
    seconds: float
    timing: Timing
    condition: float


@dataclass(frozen=True)
class Run:
    """Snapshots of a march and, when it stopped early, why."""

    snapshots: tuple[Snapshot, ...]
    failure: str = ""

    def at(self, tau: float) -> int | None:
        """Number of the snapshot at ``tau``, None when the run did not get there."""
        found = [k for k, s in enumerate(self.snapshots) if s.tau == tau]
        return found[0] if found else None

    def total(self, name: str, upto: int) -> float:
        """Sum of a snapshot field over the run up to and with number ``upto``."""
        return sum(getattr(s, name) for s in self.snapshots[: upto + 1])

    def curve(self, upto: int) -> tuple[Floats, Floats]:
        """Pseudo-time and force up to number ``upto``."""
        kept = self.snapshots[: upto + 1]
        return np.array([s.tau for s in kept]), np.array([s.force for s in kept])


def hessian(trial: Trial, x: Floats) -> sp.csc_matrix:
    """K and, in a penalised form, the contact's part, of a pass's program at x (n,)."""
    if isinstance(trial.form, Penalty | Uzawa):
        return trial.form.program(trial.iterate, trial.r, trial.state).hessian(x)
    return trial.iterate.stiffness(TangentKind.CONSISTENT)


def condition(H: sp.csc_matrix) -> float:
    """The condition of a matrix (n, n) in the 1-norm; inf when it is singular."""
    try:
        lu = factorise(H)
    except ProgramError:
        return float("inf")
    # The stubs of scipy hide the keyword constructor.
    operator: Any = sla.LinearOperator
    inverse = operator(H.shape, matvec=lu.solve, rmatvec=lu.solve, dtype=float)
    # By Higham and Tisseur's estimator.
    return float(sla.norm(H, 1)) * float(np.asarray(sla.onenormest(inverse)))


def record(scene: Scene, schedule: Schedule, control: Control, marks: tuple[float, ...] = ()) -> Run:
    """March and keep every increment; with ``marks`` the tangent's condition at those pseudo-times."""
    system = system_of(scene)
    last = deque[Trial](maxlen=1)
    snapshots: list[Snapshot] = []
    try:
        for accepted in march(scene, schedule, control, observe=last.append):
            marked = accepted.state.tau in marks
            found = condition(hessian(last[0], accepted.solved.response.x)) if marked else float("nan")
            snapshots.append(_snapshot(system, accepted, found))
    except IncrementFailed as failed:
        return Run(tuple(snapshots), str(failed))
    return Run(tuple(snapshots))


def _snapshot(system: System, accepted: Accepted, condition: float) -> Snapshot:
    solved, state, found = accepted.solved, accepted.state, accepted.traction
    motion = solved.rows.motion(solved.response.x)
    pressure, shear = consistent_tractions(system.candidates, state.nodes, solved.r, carries(solved.r))
    return Snapshot(
        state.tau,
        float(-accepted.tool_forces[0, 1]),
        accepted.energies.work,
        state.nodes,
        state.velocity,
        solved.r,
        motion[:, 0],
        np.abs(motion[:, 1]),
        found.status,
        pressure,
        shear,
        solved.certificate.relative_gap,
        accepted.passes,
        solved.iterations,
        accepted.cuts,
        accepted.seconds,
        solved.timing,
        condition,
    )


def traction_errors(system: System, run: Snapshot, reference: Snapshot) -> tuple[float, float]:
    """Relative L2 errors of pressure and shear over the reference's contact line (0 off it); nan if that is zero."""
    closed = carries(reference.r)
    squares = np.zeros((2, 2))
    for number in range(len(system.body.scene.tools)):
        edges = contact_edges(system.candidates, number, closed)
        mass = facet_mass(reference.nodes, system.candidates.node[edges], system.body.scene.geometry)
        for k, name in enumerate(("pressure", "shear")):
            value, exact = (np.nan_to_num(getattr(s, name))[edges] for s in (run, reference))
            for j, field in enumerate((value - exact, exact)):
                squares[k, j] += einsum("fi,fij,fj->", field, mass, field)
    relative = [float(np.sqrt(e / whole)) if whole > 0 else float("nan") for e, whole in squares]
    return relative[0], relative[1]


def curve_error(run: Run, reference: Run, upto: int) -> float:
    """Relative L2 error of the force over pseudo-time, on the run's own increments up to number ``upto``."""
    tau, force = run.curve(upto)
    exact = np.interp(tau, *reference.curve(len(reference.snapshots) - 1))
    return float(np.sqrt(np.trapezoid((force - exact) ** 2, tau) / np.trapezoid(exact**2, tau)))


def stick_creep(run: Run, reference: Run, stops: list[float], upto: float) -> float:
    """Largest path that a point slips in intervals of ``stops`` over which it sticks in the reference."""
    edges = np.array([t for t in stops if t <= upto])
    paths = np.zeros_like(reference.snapshots[0].slip)
    for k in range(len(edges)):
        inside = [_between(r, edges[k - 1] if k else 0.0, edges[k]) for r in (run, reference)]
        if not all(inside):
            return float("nan")
        sticking = np.all([s.status == Status.STICK for s in inside[1]], axis=0)
        paths += np.where(sticking, np.sum([s.slip for s in inside[0]], axis=0), 0.0)
    return float(paths.max())


def _between(run: Run, low: float, high: float) -> list[Snapshot]:
    return [s for s in run.snapshots if low < s.tau <= high]
