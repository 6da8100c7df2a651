"""A smooth wedge pressed into a rigid-perfectly plastic half-space, with the lip that it raises."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bipot import (
    Accepted,
    Elasticity,
    Element,
    Geometry,
    Mesh,
    Perfect,
    Profile,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    VonMises,
    wedge,
)
from bipot.meshes.cells import graded
from studies.element_scenes import tensor
from studies.verification.case import Asked, Case, Sense, Subject, Watch

MATERIAL = VonMises(Elasticity(3000 * np.sqrt(3.0), 0.3), Perfect(float(np.sqrt(3.0))))
HELD = (Support("right", 0), Support("base", 0), Support("base", 1))

PARTED = {75: 0.21, 60: 0.47, 45: 0.70}
"""Part of the face that particles of the axis cover in the exact field, in two digits."""

MISSING = 2 / (0.75 * 16)
"""What of it may be missing: two elements of the finest mesh at three quarters of the depth."""

HALF_AN_ELEMENT = {75: 0.04, 60: 0.05, 45: 0.06}
"""What of c/h is allowed by semi-angle: half an element of the finest mesh over it, at three quarters of the depth."""

EXACT = {75: (24.7662, 5.76560), 60: (9.59279, 2.93459), 45: (4.47138, 2.00768)}
"""F/(2 k h) and c/h by semi-angle in degrees: F on both faces, c the contact's length along one, h the depth."""

WHOLE = {75: 1.0, 60: 0.6, 45: 0.4}
"""Depths that a body is taken to which holds together below the tip, by semi-angle; deeper it folds there."""

EXCESS = {75: 0.03, 60: 0.15, 45: 0.25}
"""What of the force is allowed there."""

STEPS = 4
"""Increments over the depth of one, by elements of the contact."""

CORNER = 0.5
"""Radius between the wedge and the plane below it over the size of elements."""

TALL = 3.0
"""Height over width of the elements of a body that holds together: its column below the tip is pressed down."""

LATE, LATER = 0.5, 0.75
"""Parts of the travel after which the flow is taken as similar to itself, and that halve the rest."""


def body(c: float, n: int, tall: float) -> Mesh:
    """Half of the block, n elements along the surface to c."""
    size = c / n
    near = size * np.arange(np.ceil(1.15 * n))
    x = np.append(near, graded(float(near[-1] + size), 2.6 * c, max(8, int(0.7 * n)), 4.0))
    return tensor(x, np.linspace(0.0, 1.8 * c, int(1.8 * n / tall) + 1), Element.Q4)


def indented(angle: int, n: int) -> Scene:
    """It is cut below the tip: a plane of the tool goes down from there, and what leaves it lies along the wedge."""
    c, t = EXACT[angle][1], np.radians(angle)
    far, top = 4 * c, 1.8 * c
    points = ((far * float(np.sin(t)), top + far * float(np.cos(t))), (0.0, top), (0.0, -top))
    tool, square = Profile(points, CORNER * c / n), body(c, n, 1.0)
    # The body's corner lies on the rounded one.
    near = tool.distance(square.nodes)
    nodes = square.nodes + np.maximum(-near.gap, 0.0)[:, None] * near.normal
    return Scene(
        mesh=Mesh(nodes, square.elements, square.boundaries),
        geometry=Geometry.PLANE_STRAIN,
        material=MATERIAL,
        supports=HELD,
        tools=(ShapedTool(tool, (0.0, -1.0), ("top", "left"), 0.0),),
    )


def whole(angle: int, n: int) -> Scene:
    """It holds together on its plane of symmetry, and the tip is sharp."""
    c = EXACT[angle][1]
    return Scene(
        mesh=body(c, n, TALL),
        geometry=Geometry.PLANE_STRAIN,
        material=MATERIAL,
        supports=(Symmetry("left", 0), *HELD),
        tools=(ShapedTool(wedge((0.0, 1.8 * c), float(angle), 4 * c), (0.0, -WHOLE[angle]), ("top",), 0.0),),
    )


class Late(NamedTuple):
    """Means over the last half: F/(2 k h), c/h, part of the face that was the axis; how the first grows and spreads.

    It grows from the third quarter to the fourth; that and its spread are over its exact value.
    """

    force: float
    contact: float
    parted: float
    growth: float
    spread: float


def pressed(scene: Scene, angle: int, n: int, watch: Watch) -> Late:
    """Press to the end; the contact ends halfway between the last node that carries and the next."""
    (tool,) = scene.tools
    (corner,) = np.intersect1d(scene.mesh.boundary_nodes("left"), scene.mesh.boundary_nodes("top"))
    travel, sine = -tool.travel[1], float(np.sin(np.radians(angle)))
    found = list[tuple[float, float, float, float]]()
    for accepted in watch.march(scene, Schedule(round(STEPS * n * travel))):
        tau = accepted.state.tau
        if tau > LATE:
            half = -float(accepted.tool_force(0)[1]) / scene.images
            across = reach(accepted)
            parted = float(accepted.state.nodes[corner, 0]) / across
            found.append((tau, half / (tau * travel), across / sine / (tau * travel), parted))
    tau, force, contact, parted = np.array(found).T
    exact, later = EXACT[angle][0], tau > LATER
    growth = force[later].mean() - force[~later].mean()
    return Late(
        force=float(force.mean()),
        contact=float(contact.mean()),
        parted=float(parted.mean()),
        growth=float(growth) / exact,
        spread=float(np.ptp(force)) / exact,
    )


def reach(accepted: Accepted) -> float:
    """How far from the axis the contact ends."""
    x = accepted.state.nodes[accepted.solved.iterate.increment.system.candidates.node, 0]
    order = np.argsort(x)
    last = int(np.flatnonzero(accepted.solved.r[order, 0] > 0).max())
    return float(x[order][last : last + 2].mean())


def run(n: int, watch: Watch) -> Sequence[float]:
    """Each wedge with the body cut; then what a body that holds together takes."""
    out = list[float]()
    for angle in EXACT:
        late = pressed(indented(angle, n), angle, n, watch)
        out += [late.force, late.contact, late.parted, late.growth, late.spread * LATE * n]
    for angle in WHOLE:
        late = pressed(whole(angle, n), angle, n, watch)
        out += [late.force, late.contact]
    return out


def asked(angle: int) -> tuple[Asked, ...]:
    """The similar solution, and that F/h does not change but by what an element is of the contact."""
    force, contact = EXACT[angle]
    return (
        Asked(f"t = {angle}: F/(2kh)", force, 0.03),
        Asked(f"t = {angle}: c/h", contact, HALF_AN_ELEMENT[angle]),
        Asked(f"t = {angle}: face that was the axis", PARTED[angle], MISSING / PARTED[angle]),
        Asked(f"t = {angle}: growth", 0.0, 0.02),
        Asked(f"t = {angle}: spread over 2/n", 1.0, 0.0, Sense.AT_MOST),
    )


def excess(angle: int) -> tuple[Asked, ...]:
    """What force the body that holds together takes, which is too high; its contact."""
    force, contact = EXACT[angle]
    said = f"t = {angle}, whole"
    return (
        Asked(f"{said}: F/(2kh)", force, EXCESS[angle]),
        Asked(f"{said}: c/h", contact, HALF_AN_ELEMENT[angle]),
    )


NOTE = (
    "With the body cut the force is nearly exact at all three angles. Its spread, in units of one element of the "
    "contact, stays within one: the steps are those of nodes that begin to carry force, and decrease to first order. "
    "At t = 75 and 60 the part of the face that was the axis is short by about an element, where the corner is "
    "rounded. A body that is not cut needs a force that is {t = 75, whole: F/(2kh)}, {t = 60, whole: F/(2kh)} and {t "
    "= 45, whole: F/(2kh)} % too high at t = 75, 60 and 45, and finer elements do not cure that. Its contact has the "
    "right length, but below the tip the body is pressed down instead of parted, more so the sharper the wedge, until"
    " its elements fold there; the finer they are, the sooner."
)

CASE = Case(
    name="wedge_indentation",
    subject=Subject.TOOLS,
    source="closed form: Hill, Lee and Tupper",
    purpose=("Large deformation along a sharp tool, self-similar at every depth, with a raised lip at its sides."),
    setup=(
        "Plane strain, perfect plasticity with shear strength k, E = 3000 sigma_Y; half of a block 1.8 c deep and "
        "2.6 c wide, c the exact length of the contact along one face at a depth of one; a smooth wedge of "
        "semi-angle t, one deep; Q4 with the mean of its volume change, four increments an element. In the exact "
        "field the tip cuts the body: particles from the axis cover 21, 47 and 70 % of the face at t = 75, 60 and "
        "45. The block is therefore cut along the axis: a smooth plane extends down from the tip and holds the body "
        "back in place of the plane of symmetry; nodes move from it onto the face, and the corner between the two is"
        " rounded by half an element. cos(2 t - psi) = cos psi/(1 + sin psi), c/h = 1/(cos t - sin(t - psi)), F/(2 k"
        " h) = 2 (c/h) sin t (1 + psi). Values are means over the last half of the travel, with the end of the "
        "contact halfway between the last node that carries force and the next. In self-similar flow F/h is "
        "constant, except for the nodes that begin to carry force one by one. Growth is the change of its mean from "
        "the third to the fourth quarter of the travel, spread the largest less the smallest in the last half, both "
        "over the exact F/h; 2/n is one element of the contact at half of the depth. *Whole* is a body that is not "
        "cut, with a plane of symmetry under a sharp tip and elements three times as high as wide, taken to depths "
        "of 1, 0.6 and 0.4 at t = 75, 60 and 45."
    ),
    asked=tuple(one for angle in EXACT for one in asked(angle))
    + tuple(one for angle in WHOLE for one in excess(angle)),
    counted="elements along the contact",
    meshes=(4, 8, 16),
    run=run,
    note=NOTE,
)
