r"""One increment: the one loop over tangent, threshold and configuration.

A pass linearises the body at the last iterate, solves the form's convex program with friction's threshold or shift
frozen, moves that towards where the answer sends it, and evaluates the body at the answer. The increment is accepted
when its certificate, recomputed from the fields, is within the bounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bipot.certificate import Bounds, Certificate
from bipot.certification import Examined
from bipot.contact import LEAST_MOTION, near_tools
from bipot.determinacy import loose_motions, may_leave, settled, shared_forces
from bipot.errors import NotConverged, require, require_count, require_number, require_type
from bipot.forms import OWN, Answer, Form, Pass, Workspace
from bipot.laws.tensors import norm
from bipot.programs.data import ContactRows, Outcome, Timing, Units
from bipot.programs.fixed_point import Coupled, Coupling, Safeguard, image
from bipot.response import Response, State
from bipot.system import Increment
from bipot.system import System as System
from bipot.typing import Floats

RUNAWAY = 10.0
"""Farthest motion of a node in an increment, over the size of the body and the tools' travel together."""

SETTLED = 1e-12
"""A free rigid motion below this fraction of the increment's displacement is round-off."""


@dataclass(frozen=True)
class Limits:
    """When an increment is accepted, and when it is given up.

    It is given up after ``passes``, or when ``patience`` passes have not brought the worst measure (over its bound)
    below ``progress`` times the least so far. ``coupling`` says when friction's fixed point is helped.

    Raises:
        SceneError: a wrong type, or a value out of its range.
    """

    bounds: Bounds = Bounds()
    passes: int = 40
    patience: int = 8
    progress: float = 0.7
    coupling: Safeguard = Safeguard()

    def __post_init__(self) -> None:
        require_type(self.bounds, Bounds, "limits.bounds")
        require_count(self.passes, "limits.passes")
        require_count(self.patience, "limits.patience")
        require_number(self.progress, "limits.progress")
        require(0 < self.progress <= 1, "limits.progress", self.progress, "in (0, 1]")
        require_type(self.coupling, Safeguard, "limits.coupling")


@dataclass(frozen=True)
class Solved:
    """An increment that met its bounds: response, rows and forces of all candidates, certificate, cost.

    ``almost`` counts the passes whose solver claimed less than it was asked; the certificate has re-checked them.
    ``coupled`` tells how friction was coupled to the normal forces, ``undetermined`` in words what the law leaves open
    (:mod:`bipot.determinacy`): nothing where the answer is the only one nearby.
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
    undetermined: tuple[str, ...] = ()


@dataclass(frozen=True)
class Trial:
    """One pass's answer evaluated: what an observer sees."""

    number: int
    answer: Answer
    examined: Examined

    @property
    def certificate(self) -> Certificate:
        """Every measure, made when asked for."""
        return self.examined.certificate


def solve_increment(
    system: System,
    state: State,
    tau: float,
    form: Form,
    limits: Limits,
    workspace: Workspace,
    largest: float,
    observe: Callable[[Trial], None] = lambda trial: None,
    near_to: Solved | None = None,
) -> Solved:
    """Solve the increment from ``state`` to pseudo-time ``tau``.

    ``largest`` is the largest contact force of the run so far, the scale of the cone measure. ``near_to`` solved the
    same increment with a little other flow carried on: the iteration starts there.

    Raises:
        NotConverged: after ``limits``, naming the measures above their bounds; at once, a tool in a node that is held.
        InvertedElement: from an iterate, or the answer is folded anywhere in an element.
        ProgramError: from an iterate.
    """
    body = system.body
    increment = Increment(system, state, tau)
    _refuse_blocked(increment, limits.bounds)
    rows, units = increment.rows, _units(increment)
    if near_to is None:
        x, r = _predicted(system, state, tau, workspace).ravel()[body.space.free], state.forces
    else:
        x, r = near_to.response.x, near_to.r
    assembled = workspace.assembly.seconds
    with workspace.assembly:
        response = body.respond(state, x)
    near = near_tools(rows, x, units.length) if form.nearby else np.ones(rows.count, dtype=bool)
    taken = rows.take(near)
    coupling = Coupling.start(image(rows, r, x), limits.coupling, form.shifts)
    force = np.zeros(body.space.size)
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
            # What a form from elsewhere says of the body is not believed.
            response = (answer.response if type(form) in OWN else None) or body.respond(state, answer.x)
        examined = Examined(increment, response, r, largest, limits.bounds)
        coupling = coupling.update(image(rows, r, answer.x), answer.coupled)
        observe(Trial(number, answer, examined))
        if watch.accepts(examined, answer.posed, coupling.report):
            timing += Timing(assembly=workspace.assembly.seconds - assembled)
            present = max(float(np.abs(forces).max(initial=0.0)) for forces in (r, state.forces))
            blurred = examined.certificate.resolution.law * present
            least, undetermined = _settled(system, response, rows, r, blurred)
            if least is not response:
                examined = replace(examined, response=least)
                if not watch.accepts(examined, answer.posed, coupling.report):
                    raise watch.failure("the least of the body's free rigid motions leaves")
            body.refuse_folded(least)
            _refuse_runaway(increment, least)
            return Solved(
                response=least,
                rows=rows,
                r=r,
                certificate=examined.certificate,
                posed=answer.posed,
                passes=number,
                iterations=iterations,
                almost=almost,
                timing=timing,
                coupled=coupling.report,
                undetermined=undetermined,
            )
        if not near.all():
            entering = ~near & (rows.motion(answer.x)[:, 0] < 0)
            near, taken = (near | entering, rows.take(near | entering)) if entering.any() else (near, taken)
    raise watch.failure(f"{limits.passes} passes left")


def _settled(
    system: System, response: Response, rows: ContactRows, r: Floats, noise: float
) -> tuple[Response, tuple[str, ...]]:
    """The response whose free rigid motion is the least, and what is not determined, in words.

    Forces up to ``noise`` are round-off.
    """
    motion, state = rows.motion(response.x), response.state
    words = [f"forces at node {node}" for node in shared_forces(system, rows, motion, r)]
    loose = loose_motions(system, state.nodes, rows, motion, r)
    if loose.shape[1]:
        words.append(f"position in {loose.shape[1]} rigid motion" + "s" * (loose.shape[1] > 1))
        x = settled(rows, response.x, r, loose)
        if norm(x - response.x) > SETTLED * norm(x):
            response = system.body.respond(state, x)
    elif may_leave(system, state.nodes, rows, motion, r, noise):
        words.append("position: nothing keeps the body at contacts that carry nothing")
    return response, tuple(words)


def _refuse_blocked(increment: Increment, bounds: Bounds) -> None:
    """Refuse a tool that ends in a node held along its normal: it is in no form's contact law, and no motion helps."""
    inside = increment.inside / increment.system.body.scene.mesh.size
    if inside > bounds.penetration:
        raise NotConverged(f"a tool ends {inside:.2g} times the body's size inside a node that a support holds")


def _refuse_runaway(increment: Increment, response: Response) -> None:
    """Refuse a motion so long that its round-off hides every strain."""
    body = increment.system.body
    size, moved = body.scene.mesh.size, float(norm(body.space.spread(response.x)).max())
    allowed = RUNAWAY * (size + increment.reach)
    if moved > allowed:
        raise NotConverged(f"the body runs away by {moved / size:.2g} times its size: nothing holds it")


class _Watch:
    """Acceptance and patience over the passes of one increment."""

    def __init__(self, limits: Limits, exact: bool) -> None:
        self.limits, self.exact = limits, exact
        # The first of a pass that is not in equilibrium, which is asked nothing else; the second of others.
        self.least, self.waited = [np.inf, np.inf], 0
        self.last: dict[str, float] = {}
        self.coupled = Coupled()

    def accepts(self, examined: Examined, posed: float, coupled: Coupled) -> bool:
        """Whether the bounds are met; raises NotConverged when patience has run out."""
        self.coupled = coupled
        ratios = examined.ratios()
        balanced = len(ratios) > 1
        if not self.exact:
            ratios = {k: ratios[k] for k in ("equilibrium", "yield_violation") if k in ratios}
            ratios["posed"] = posed / self.limits.bounds.cone_violation
        self.last = {k: v for k, v in ratios.items() if not v <= 1}
        worst = max(ratios.values())
        if not self.last:
            return True
        if worst < self.limits.progress * self.least[balanced]:
            self.least[balanced], self.waited = worst, 0
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


def advance(system: System, start: State, solved: Solved, tau: float) -> State:
    """The state at ``tau`` after the increment that was ``solved`` from ``start``."""
    gap = solved.rows.motion(solved.response.x)[:, 0]
    return system.body.advance(start, solved.response, tau, solved.r, gap)


def _predicted(system: System, state: State, tau: float, workspace: Workspace) -> Floats:
    """Displacement (a, d) to start from: the last motion goes on, unless the tools turn back."""
    going_on = workspace.pace.predict(state, tau)
    travel = system.candidates.travel
    before, now = travel(2 * state.tau - tau, state.tau), travel(state.tau, tau)
    return going_on if np.vdot(before, now) >= 0 else np.zeros_like(going_on)


def _units(increment: Increment) -> Units:
    """Displacements in tool travel, stresses in what the increment can reach of the yield stress, volume of a cube."""
    state, scene = increment.start, increment.system.body.scene
    material, size = scene.material, scene.mesh.size
    # Tools at rest leave no length of their own: then that of the last increment, or a small part of the body's.
    length = increment.reach or float(norm(state.displacement).max()) or LEAST_MOTION * size
    reached = max(material.elasticity.young * length / size, float(norm(state.stress).max()))
    return Units(length, size, min(float(material.yield_stress(0.0)), reached), size**3)
