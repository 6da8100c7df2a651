"""What drives a body in the fuzz study's recomputation: forces on tools, and supports that move.

A tool that a force F drives along d translates along d as far as its contacts let it: sum_c r . d = F. Across d it goes
its path. One that a moment M turns does so about its centre: sum_c r . (z x a) = M. What a support holds is where the
support asks for it, and the support does the work of its reaction.
"""

from __future__ import annotations

import numpy as np

from studies.independent.data import EPS, Floats, Setting, Step, beyond
from studies.independent.element import Placed, element_forces, nodal, place


def driven(step: Step) -> float:
    """Largest |sum_c r . w - F| over F of the tools that forces drive, or moments, w what they go by; 0 without one."""
    led, c = step.led, step.contacts
    vectors, x, worst = c.vectors(step.end.forces), step.end.nodes[c.parts.node], [0.0]
    for k, (tool, force) in enumerate(zip(led.tool, led.force, strict=True)):
        own = c.met == tool
        ways = led.ways(k, x[own])
        sizes = float((np.linalg.norm(vectors[own], axis=1) * np.linalg.norm(ways, axis=1)).sum())
        scale = max(abs(float(force)), sizes) if led.spin[k] else abs(float(force))
        blur = EPS * (sizes + led.spin[k] * float(np.abs(vectors[own]).sum() * np.abs(x[own]).max(initial=0.0)))
        worst.append(beyond(np.abs(np.vdot(vectors[own], ways) - force)[None], blur, scale))
    return max(worst)


def placed(s: Setting, step: Step) -> float:
    """How far held nodes and driven tools are from where they ought to be, see :mod:`studies.independent`."""
    (begun, ended), led, held = step.prescribed, step.led, s.held
    at, rest = np.abs(step.end.nodes).max(axis=1), np.abs(s.rest).max(axis=1)
    away = np.abs(s.along(step.end.nodes - s.rest - ended))
    off = beyond(away[held], EPS * np.broadcast_to((at + rest)[:, None], held.shape)[held], s.size)
    moved = float(max(np.abs(step.displacement).max(), np.abs(led.advance).max(initial=0.0)))
    blur = EPS * np.abs(begun).max(axis=1) + EPS * np.abs(ended).max(axis=1) + _stored(step)
    missed = np.abs(s.along(step.displacement - (ended - begun)))
    short = beyond(missed[held], np.broadcast_to(blur[:, None], held.shape)[held], moved)
    jumped = np.abs(led.ended - led.begun - led.advance)
    return max(off, short, beyond(jumped, EPS * (np.abs(led.ended) + np.abs(led.begun)), s.size))


def _stored(step: Step) -> Floats | float:
    """Round-off of displacements (a,) that are differences of positions."""
    return EPS * np.abs(step.end.nodes).max(axis=1) if step.by_difference else 0.0


def work_of_supports(s: Setting, step: Step, ended: Placed) -> tuple[float, float]:
    """Mean of the reactions at start and end times what supports move by; the sum of the sizes of its terms."""
    asked = step.prescribed[1] - step.prescribed[0]
    if not asked.any():
        return 0.0, 0.0
    begun = place(step.balanced, s.elements, s.quadrature, s.axisymmetric)
    c, mean, size = step.contacts, np.zeros(asked.shape), np.zeros(asked.shape)
    before, after = c.start_vectors(step.start.forces), c.vectors(step.end.forces)
    parts = (begun, step.start, step.loads[0], before), (ended, step.end, step.loads[1], after)
    for configuration, moment, loads, pushes in parts:
        element = element_forces(configuration, moment.stress)
        mean += (nodal(s.elements, element, len(asked)) - loads - c.on_nodes(pushes)) / 2
        terms = nodal(s.elements, np.abs(element), len(asked)) + np.abs(loads)
        size += (terms + c.on_nodes(np.abs(pushes))) / 2
    return float(np.vdot(mean, asked)), float(np.vdot(size, np.abs(asked)))
