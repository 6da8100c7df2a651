"""A smooth wedge pressed into a rigid-perfectly plastic half-space, with the lip that it raises."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot import (
    Elasticity,
    Element,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    VonMises,
    wedge,
)
from bipot.cells import graded
from studies.element_scenes import tensor
from studies.verification.case import Asked, Case, Subject, Watch

EXACT = {75: (24.7662, 5.76560), 60: (9.59279, 2.93459)}
"""F/(2 k h) and c/h by semi-angle in degrees: F on both faces, c half of the width in contact, h the depth."""

TRAVEL = {75: 1.0, 60: 0.6}
"""Depths that are reached; meshes are those of a depth of one."""

STEPS = 4
"""Increments over the depth of one, by elements of the contact."""

COARSE = 8
"""Elements at t = 60: finer ones fold sooner."""

LATE = 0.5
"""Part of the travel after which the flow is taken as similar to itself."""


def indented(angle: int, n: int) -> Scene:
    """Half of the block, k = 1, with n elements along the contact of depth one; all of a column are equally high."""
    c = EXACT[angle][1]
    size = c / n
    near = size * np.arange(np.ceil(1.15 * n))
    x = np.append(near, graded(float(near[-1] + size), 2.6 * c, max(8, int(0.7 * n)), 4.0))
    y = np.linspace(0.0, 1.8 * c, int(1.2 * n) + 1)
    punch = wedge((0.0, 1.8 * c), float(angle), 4 * c)
    held = (Symmetry("left", 0), Support("right", 0), Support("base", 0), Support("base", 1))
    return Scene(
        mesh=tensor(x, y, Element.Q4),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(3000 * np.sqrt(3.0), 0.3), Perfect(float(np.sqrt(3.0)))),
        supports=held,
        tools=(ShapedTool(punch, (0.0, -TRAVEL[angle]), ("top",), 0.0),),
    )


def pressed(angle: int, n: int, watch: Watch) -> tuple[float, float, float]:
    """Means of F/(2 k h) and c/h over the last half, and the spread of the first over its exact value."""
    found = list[tuple[float, float]]()
    for accepted in watch.march(indented(angle, n), Schedule(round(STEPS * n * TRAVEL[angle]))):
        if accepted.state.tau > LATE:
            depth = accepted.state.tau * TRAVEL[angle]
            nodes = accepted.solved.iterate.increment.system.candidates.node
            x = accepted.state.nodes[nodes, 0]
            last = int(np.flatnonzero(accepted.solved.r[:, 0] > 0).max())
            found.append((-float(accepted.tool_force(0)[1]) / (2 * depth), x[last : last + 2].mean() / depth))
    force, contact = np.mean(found, axis=0)
    return float(force), float(contact), float(np.ptp([one for one, _ in found])) / EXACT[angle][0]


def run(n: int, watch: Watch) -> Sequence[float]:
    """Both wedges, the sharper one on its own mesh."""
    return [value for angle, count in ((75, n), (60, COARSE)) for value in pressed(angle, count, watch)]


CASE = Case(
    name="wedge_indentation",
    subject=Subject.TOOLS,
    source="closed form: Hill, Lee and Tupper",
    purpose="Large deformation along a sharp tool, similar to itself at every depth, with the lip raised at its sides.",
    setup=(
        "Plane strain, perfect plasticity with shear strength k, E = 3000 sigma_Y; half of a block 1.8 c deep and 2.6 c"
        " wide, c half of the exact contact at a depth of one; a smooth wedge of semi-angle t with a sharp tip, 1 deep"
        " at t = 75 and 0.6 at 60 degrees; Q4 with the mean of its volume change, four increments an element. cos(2 t -"
        " psi) = cos psi/(1 + sin psi), c/h = 1/(cos t - sin(t - psi)), F/(2 k h) = 2 (c/h) sin t (1 + psi). Means over"
        " the last half of the travel, c halfway between the last node that carries and the next; the spread is"
        " largest less smallest F/(2 k h), over the exact: allowed is one element of the contact at half of the depth."
    ),
    asked=(
        Asked("t = 75: F/(2kh)", EXACT[75][0], 0.03),
        Asked("t = 75: c/h", EXACT[75][1], 0.04),
        Asked("t = 75: spread", 0.0, 0.125),
        Asked("t = 60: F/(2kh)", EXACT[60][0], 0.15),
        Asked("t = 60: c/h", EXACT[60][1], 0.15),
        Asked("t = 60: spread", 0.0, 0.125 / TRAVEL[60]),
    ),
    counted="elements along the contact",
    meshes=(8, 16),
    run=run,
    note=(
        "t = 60 is always that of 8 elements, as far as they carry: the force is 11 % too high and the contact 11 % too"
        " narrow, and finer elements fold sooner (of 16 that below the tip at a depth of 0.36). In the exact field the"
        " tip cuts the body: what was its surface parts there and lies along the faces. A mesh holds together, so the"
        " column below the tip is pressed down instead, more so the sharper the wedge."
    ),
)
