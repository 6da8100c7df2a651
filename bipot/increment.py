r"""One increment: the one loop over tangent, threshold and configuration.

A pass linearises the body at the last iterate, solves the form's convex program with friction's threshold or shift
frozen, moves that towards where the answer sends it, and evaluates the body at the answer. The increment is accepted
when its certificate, recomputed from the fields, is within the bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bipot.certificate import Balance, Bounds, Certificate, ContactFields, MaterialFields, certify
from bipot.contact import Candidates
from bipot.errors import NotConverged
from bipot.fem.kinematics import MANDEL_2D
from bipot.forms import Answer, Form, Pass, Workspace
from bipot.laws.tensors import norm
from bipot.programs.data import Bools, ContactRows, Outcome, Timing, Units
from bipot.programs.fixed_point import Coupled, Coupling, Safeguard, image
from bipot.response import Body, Response, State, rest

Floats = NDArray[np.float64]

NEAR = 4.0
LEAST_TRAVEL = 1e-6


@dataclass(frozen=True)
class System:
    """A scene made ready: body and candidates."""

    body: Body
    candidates: Candidates

    def rest(self) -> State:
        """The state at rest."""
        scene = self.body.scene
        return rest(scene, self.candidates.distance(scene.mesh.nodes, 0.0))

    def advance(self, start: State, solved: Solved, tau: float) -> State:
        """The state at ``tau`` after the increment that was ``solved`` from ``start``."""
        travel, gap = tool_travel(self, start.tau, tau), solved.rows.motion(solved.response.x)[:, 0]
        return self.body.advance(start, solved.response, tau, travel, solved.r, gap)


@dataclass(frozen=True)
class Limits:
    """When an increment is accepted, and when it is given up.

    It is given up after ``passes``, or when ``patience`` passes have not brought the worst measure (over its bound)
    below ``progress`` times the least so far. ``coupling`` says when friction's fixed point is helped.
    """

    bounds: Bounds = Bounds()
    passes: int = 40
    patience: int = 8
    progress: float = 0.7
    coupling: Safeguard = Safeguard()


@dataclass(frozen=True)
class Solved:
    """An increment that met its bounds: response, rows and forces of all candidates, certificate, cost.

    ``almost`` counts the passes whose solver claimed less than it was asked; the certificate has re-checked them.
    ``coupled`` tells how friction was coupled to the normal forces.
    """

    response: Response
    rows: ContactRows
    r: Floats
    certificate: Certificate
    posed: float
    passes: int
    iterations: int
    almost: int
    timing: Timing
    coupled: Coupled


@dataclass(frozen=True)
class Trial:
    """One pass's answer evaluated: what an observer sees."""

    number: int
    answer: Answer
    certificate: Certificate


def solve_increment(
    system: System,
    state: State,
    tau: float,
    form: Form,
    limits: Limits,
    workspace: Workspace,
    largest: float,
    observe: Callable[[Trial], None] = lambda trial: None,
) -> Solved:
    """Solve the increment from ``state`` to pseudo-time ``tau``.

    ``largest`` is the largest contact force of the run so far, the scale of the cone measure.

    Raises:
        NotConverged: after ``limits``, naming the measures above their bounds.
        InvertedElement, ProgramError: from an iterate.
    """
    body = system.body
    rows = system.candidates.rows(state.gap, state.tau, tau)
    units = _units(system, state, tau)
    x = _predicted(system, state, tau, workspace).ravel()[body.space.free]
    assembled = workspace.assembly.seconds
    with workspace.assembly:
        response = body.respond(state, x)
    near = _near(rows, x, units) if form.nearby else np.ones(rows.count, dtype=bool)
    taken = rows.take(near)
    coupling = Coupling.start(image(rows, state.forces, x), limits.coupling, form.shifts)
    r, force = state.forces, np.zeros(body.space.size)
    watch = _Watch(limits, form.exact)
    iterations, almost, timing = 0, 0, Timing()
    for number in range(1, limits.passes + 1):
        shift = coupling.shift
        active = near[rows.frictional]
        given = Pass(
            body,
            response,
            taken,
            (coupling.value if shift is None else rows.threshold(r))[active],
            state.gap[near],
            state.forces[near],
            r[near],
            force,
            units,
            None if shift is None else shift[active],
        )
        answer = form.solve(given, workspace)
        iterations, timing = iterations + answer.iterations, timing + answer.timing
        almost += answer.outcome is Outcome.ALMOST
        r = np.zeros_like(state.forces)
        r[near] = answer.r
        with workspace.assembly:
            response = answer.response or body.respond(state, answer.x)
        certificate = certify_response(system, response, rows, r, tau, largest)
        coupling = coupling.update(image(rows, r, answer.x), answer.coupled)
        observe(Trial(number, answer, certificate))
        if watch.accepts(certificate, answer.posed, coupling.report):
            timing += Timing(assembly=workspace.assembly.seconds - assembled)
            return Solved(
                response, rows, r, certificate, answer.posed, number, iterations, almost, timing, coupling.report
            )
        if not near.all():
            entering = ~near & (rows.motion(answer.x)[:, 0] < 0)
            near, taken = (near | entering, rows.take(near | entering)) if entering.any() else (near, taken)
    raise watch.failure(f"{limits.passes} passes left")


class _Watch:
    """Acceptance and patience over the passes of one increment."""

    def __init__(self, limits: Limits, exact: bool) -> None:
        self.limits, self.exact = limits, exact
        self.least, self.waited = np.inf, 0
        self.last: dict[str, float] = {}
        self.coupled = Coupled()

    def accepts(self, certificate: Certificate, posed: float, coupled: Coupled) -> bool:
        """Whether the bounds are met; raises NotConverged when patience has run out."""
        self.coupled = coupled
        ratios = certificate.ratios(self.limits.bounds)
        if not self.exact:
            ratios = {k: ratios[k] for k in ("equilibrium", "yield_violation")}
            ratios["posed"] = posed / self.limits.bounds.cone_violation
        self.last = {k: v for k, v in ratios.items() if not v <= 1}
        worst = max(ratios.values())
        if not self.last:
            return True
        if worst < self.limits.progress * self.least:
            self.least, self.waited = worst, 0
        else:
            self.waited += 1
        if self.waited >= self.limits.patience or not np.isfinite(worst):
            raise self.failure("stalled with")
        return False

    def failure(self, what: str) -> NotConverged:
        """The exception that names what is above its bound, in multiples of it, and how friction was coupled."""
        above = ", ".join(f"{name} {ratio:.2g} times" for name, ratio in self.last.items())
        seen = f", contraction {self.coupled.contraction:.2g}" if self.coupled.contraction > 0 else ""
        return NotConverged(f"{what} {above} its bound (coupling {self.coupled.route.value}{seen})", self.last)


def certify_response(
    system: System, response: Response, rows: ContactRows, r: Floats, tau: float, largest: float
) -> Certificate:
    """The certificate of a response and contact forces r (c, d) on the rows of all candidates."""
    body, material = system.body, system.body.scene.material
    kin, returned, elastic = response.kinematics, response.returned, material.elasticity
    sigma_e = response.trial - returned.plastic_strain @ elastic.stiffness(MANDEL_2D)
    contact = ContactFields(
        r, rows.motion(response.x), rows.mu, rows.tied, max(largest, float(np.abs(r).max(initial=0.0)))
    )
    points = (-1, MANDEL_2D)
    fields = MaterialFields(
        returned.stress.reshape(points),
        returned.plastic_strain.reshape(points),
        sigma_e.reshape(points),
        (response.state.peeq + returned.dpeeq).ravel(),
        kin.volume.ravel(),
        elastic,
        material.hardening,
    )
    residual = norm(body.space.spread(response.internal - rows.forces(r)))
    sigma_y, volume = float(material.hardening.yield_stress(0.0)), float(kin.volume.sum())
    balance = Balance(
        residual,
        max(body.space.force_scale(response.element_forces), _force_floor(body, volume)),
        body.scene.mesh.size,
        float(np.sum(tool_forces(system, r) * tool_travel(system, response.state.tau, tau))),
        1e-3 * sigma_y**2 / (2 * elastic.young) * volume,
    )
    return certify(contact, fields, balance)


def tool_forces(system: System, r: Floats) -> Floats:
    """Force (tools, d) of each tool on the modelled body from contact forces r (c, d)."""
    tools = system.body.scene.tools
    out = np.zeros((len(tools), 2))
    for k, tool in enumerate(tools):
        mine = r[system.candidates.tool == k].sum(axis=0)
        out[k] = mine[0] * np.array(tool.normal) + mine[1] * np.array([tool.normal[1], -tool.normal[0]])
    return out


def tool_travel(system: System, tau: float, tau_end: float) -> Floats:
    """Displacement (tools, d) of each tool from pseudo-time ``tau`` to ``tau_end``."""
    return np.array([tool.moved(tau, tau_end) for tool in system.body.scene.tools])


def _predicted(system: System, state: State, tau: float, workspace: Workspace) -> Floats:
    """Displacement (a, d) to start from: the last motion goes on, unless the tools turn back."""
    going_on = workspace.pace.predict(state, tau)
    before, now = tool_travel(system, 2 * state.tau - tau, state.tau), tool_travel(system, state.tau, tau)
    return going_on if np.vdot(before, now) >= 0 else np.zeros_like(going_on)


def _force_floor(body: Body, volume: float) -> float:
    """A thousandth of what an element's side carries at yield: residuals of an unstressed body are round-off of it."""
    mesh = body.scene.mesh
    sigma_y = float(body.scene.material.hardening.yield_stress(0.0))
    return 1e-3 * sigma_y * volume / (mesh.size * math.sqrt(len(mesh.elements)))


def _units(system: System, state: State, tau: float) -> Units:
    """Displacements in tool travel, stresses in the initial yield stress, volume in that of a cube."""
    scene = system.body.scene
    size = scene.mesh.size
    # A tool at rest leaves no length of its own: then a small part of the body's.
    travel = max(float(np.linalg.norm(tool_travel(system, state.tau, tau), axis=1).max()), LEAST_TRAVEL * size)
    return Units(travel, size, float(scene.material.hardening.yield_stress(0.0)), size**3)


def _near(rows: ContactRows, x: Floats, units: Units) -> Bools:
    """Candidates within a few travels of a tool at the predicted end: the others get no rows until they touch."""
    gap = rows.gap + rows.G_n @ x
    # At least one, so that no program is without contact rows: an open one changes nothing.
    return (gap <= max(NEAR * units.length, float(gap.min()))) | rows.tied
