r"""One increment: the one loop over tangent, threshold and configuration.

A pass linearises the body at the last iterate, solves the form's convex program at the frozen threshold s, moves s
towards mu r_n, and evaluates the body at the answer. The increment is accepted when its certificate, recomputed from
the fields, is within the bounds.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bipot.certificate import Balance, Bounds, Certificate, ContactFields, MaterialFields, certify
from bipot.contact import Candidates
from bipot.errors import NotConverged
from bipot.fem.kinematics import MANDEL_2D
from bipot.forms import Answer, Form, Pass, Workspace
from bipot.programs.data import Bools, ContactRows, Units
from bipot.programs.fixed_point import Threshold
from bipot.response import Body, Response, State

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class System:
    """A scene made ready: body and candidates."""

    body: Body
    candidates: Candidates


@dataclass(frozen=True)
class Limits:
    """When an increment is accepted, and when it is given up."""

    bounds: Bounds = Bounds()
    passes: int = 40


@dataclass(frozen=True)
class Solved:
    """An increment that met its bounds: response, contact rows and forces (all candidates), certificate, cost."""

    response: Response
    rows: ContactRows
    r: Floats
    certificate: Certificate
    passes: int
    iterations: int


@dataclass(frozen=True)
class Trial:
    """One pass's answer evaluated: what an observer sees."""

    number: int
    answer: Answer
    response: Response
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
        NotConverged: after ``limits.passes``, naming the measures above their bounds.
        InvertedElement, ProgramError: from an iterate.
    """
    body = system.body
    rows = system.candidates.rows(state.nodes, state.tau, tau)
    units = _units(system, state, tau)
    x = (state.velocity * (tau - state.tau)).ravel()[body.space.free]
    response = body.respond(state, x)
    near = _near(rows, x, units)
    threshold = Threshold.start(rows.threshold(state.forces))
    iterations = 0
    for number in range(1, limits.passes + 1):
        chosen = rows.take(near)
        kept = near[rows.frictional]
        given = Pass(body, response, chosen, threshold.value[kept], np.zeros(body.space.size), units)
        answer = form.solve(given, workspace)
        iterations += answer.iterations
        r = np.zeros((rows.count, answer.r.shape[1]))
        r[near] = answer.r
        response = body.respond(state, answer.x)
        certificate = certify_response(system, response, rows, r, tau, largest)
        observe(Trial(number, answer, response, certificate))
        if certificate.within(limits.bounds):
            return Solved(response, rows, r, certificate, number, iterations)
        near = near | (rows.motion(answer.x)[:, 0] < 0)
        threshold = threshold.update(rows.threshold(r))
    above = ", ".join(f"{n} = {getattr(certificate, n):.2g}" for n in certificate.exceeded(limits.bounds))
    raise NotConverged(f"{limits.passes} passes left {above}", certificate)


def certify_response(
    system: System, response: Response, rows: ContactRows, r: Floats, tau: float, largest: float
) -> Certificate:
    """The certificate of a response and contact forces r (c, d) on ``rows`` (DESIGN 4)."""
    body, scene, returned = system.body, system.body.scene, response.returned
    kin, elastic = response.kinematics, scene.material.elasticity
    residual = body.space.spread(response.internal - rows.forces(r))
    points = returned.peeq_shape if hasattr(returned, "peeq_shape") else returned.dpeeq.size
    flat = lambda a: a.reshape(points, -1)
    sigma_e = response.rotated + (kin.strain - returned.plastic_strain) @ elastic.stiffness(MANDEL_2D)
    sigma_y = float(scene.material.hardening.yield_stress(0.0))
    work = float(np.sum(tool_forces(system, r) * tool_travel(system, tau - response.state.tau)))
    return certify(
        ContactFields(r, rows.motion(response.x), rows.mu, rows.tied, max(largest, float(np.abs(r).max(initial=0)))),
        MaterialFields(
            flat(returned.stress),
            flat(returned.plastic_strain),
            flat(sigma_e),
            (response.state.peeq + returned.dpeeq).ravel(),
            kin.volume.ravel(),
            elastic,
            scene.material.hardening,
        ),
        Balance(
            np.linalg.norm(residual, axis=1),
            body.space.force_scale(response.element_forces),
            scene.mesh.size,
            work,
            1e-3 * sigma_y**2 / (2 * elastic.young) * float(kin.volume.sum()),
        ),
    )


def tool_forces(system: System, r: Floats) -> Floats:
    """Force (tools, d) of each tool on the modelled body from contact forces r (c, d)."""
    tools = system.body.scene.tools
    out = np.zeros((len(tools), 2))
    for k, tool in enumerate(tools):
        mine = r[system.candidates.tool == k].sum(axis=0)
        out[k] = mine[0] * np.array(tool.normal) + mine[1] * np.array([tool.normal[1], -tool.normal[0]])
    return out


def tool_travel(system: System, dtau: float) -> Floats:
    """Displacement (tools, d) of each tool in an increment of pseudo-time."""
    return dtau * np.array([tool.travel for tool in system.body.scene.tools])


def _units(system: System, state: State, tau: float) -> Units:
    """Displacements in tool travel, stresses in the initial yield stress, the body as it is."""
    scene = system.body.scene
    travel = float(np.linalg.norm(tool_travel(system, tau - state.tau), axis=1).max())
    size = scene.mesh.size
    sigma_y = float(scene.material.hardening.yield_stress(0.0))
    return Units(travel, size, sigma_y, size**3)


def _near(rows: ContactRows, x: Floats, units: Units) -> Bools:
    """Candidates within a few travels of a tool at the predicted end: the others get no rows until they touch."""
    return (rows.gap + rows.G_n @ x < 4 * units.length) | rows.tied
