"""What drives a body in the fuzz study's recomputation: forces on tools, and supports that move.

A tool that a force F drives along d translates along d as far as its contacts let it: sum_c r . d = F. Across d it goes
its path. What a support holds is where the support asks for it, and the support does the work of its reaction.
"""

from __future__ import annotations

import numpy as np

from studies.independent_data import EPS, Bools, Floats, Setting, Step, beyond
from studies.independent_element import Placed, element_forces, nodal, place


def driven(step: Step) -> float:
    """Largest |sum_c r . d - F| over F of the tools that forces drive; 0 without one."""
    led, c, r = step.led, step.contacts, step.end.forces
    vectors = c.vectors(r)
    worst = [0.0]
    for tool, direction, force in zip(led.tool, led.direction, led.force, strict=True):
        along = vectors[c.tool == tool] @ direction
        blur = EPS * float(np.linalg.norm(vectors[c.tool == tool], axis=1).sum())
        worst.append(beyond(np.abs(along.sum() - force)[None], blur, abs(float(force))))
    return max(worst)


def placed(s: Setting, step: Step) -> float:
    """How far held nodes and driven tools are from where they ought to be, see :mod:`studies.independent`."""
    (begun, ended), led, held = step.prescribed, step.led, s.held
    at, rest = step.end.nodes[held], s.rest[held]
    off = beyond(np.abs(at - rest - ended[held]), EPS * (np.abs(at) + np.abs(rest)), s.size)
    moved = float(max(np.abs(step.displacement).max(), np.abs(led.advance).max(initial=0.0)))
    asked = (ended - begun)[held]
    blur = EPS * (np.abs(begun) + np.abs(ended))[held] + _stored(step, held)
    short = beyond(np.abs(step.displacement[held] - asked), blur, moved)
    jumped = np.abs(led.ended - led.begun - led.advance)
    return max(off, short, beyond(jumped, EPS * (np.abs(led.ended) + np.abs(led.begun)), s.size))


def _stored(step: Step, held: Bools) -> Floats | float:
    """Round-off of displacements (h,) that are differences of positions."""
    return EPS * np.abs(step.end.nodes[held]) if step.by_difference else 0.0


def work_of_supports(s: Setting, step: Step, ended: Placed) -> tuple[float, float]:
    """Mean of the reactions at start and end times what supports move by; the sum of the sizes of its terms."""
    asked = np.where(s.held, step.prescribed[1] - step.prescribed[0], 0.0)
    if not asked.any():
        return 0.0, 0.0
    begun = place(s.rest if s.small else step.start.nodes, s.elements, s.quadrature, s.axisymmetric)
    c, mean, size = step.contacts, np.zeros(asked.shape), np.zeros(asked.shape)
    before, after = c.start_vectors(step.start.forces), c.vectors(step.end.forces)
    parts = (begun, step.start, step.loads[0], before), (ended, step.end, step.loads[1], after)
    for configuration, moment, loads, pushes in parts:
        element = element_forces(configuration, moment.stress)
        mean += (nodal(s.elements, element, len(asked)) - loads - c.on_nodes(pushes)) / 2
        terms = nodal(s.elements, np.abs(element), len(asked)) + np.abs(loads)
        size += (terms + c.on_nodes_at_most(np.abs(pushes))) / 2
    return float(np.vdot(mean, asked)), float(np.vdot(size, np.abs(asked)))
