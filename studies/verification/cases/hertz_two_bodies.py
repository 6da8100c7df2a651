"""NAFEMS R0094-1: an elastic cylinder that is pressed on an elastic block."""

from __future__ import annotations

import numpy as np

from bipot import (
    Accepted,
    DeformableTool,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Prescribed,
    Scene,
    Schedule,
    Support,
    Symmetry,
    together,
)
from studies.element_scenes import tensor
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.indentation import FINE, lines
from studies.verification.two_bodies import borne, cylinder_end, half_width

RADIUS, WIDTH, DEPTH = 50.0, 100.0, 200.0
"""Of the cylinder; half the width of the block, and how deep it is."""

HARD, SOFT = Elasticity(210_000.0, 0.3), Elasticity(70_000.0, 0.3)
STAR = 1 / sum((1 - each.poisson**2) / each.young for each in (HARD, SOFT))
FORCE, TRAVEL = 35_000.0, 1.564
"""The force of the benchmark, and how far the middle of the cylinder goes down under it, to 0.1 %."""

FRICTION = 0.0, 0.1


def closed(force: float) -> tuple[float, float]:
    """a^2 = 4 F R/(pi E*) and p0^2 = F E*/(pi R).

    >>> [round(each, 3) for each in closed(35_000.0)]
    [6.215, 3585.362]
    """
    return float(np.sqrt(4 * force * RADIUS / np.pi / STAR)), float(np.sqrt(force * STAR / np.pi / RADIUS))


def pressed(n: int, mu: float) -> Scene:
    """A quarter of the cylinder and half of the block: 3 n/4 and ``n`` (a multiple of 8) equal elements to 1.3 a."""
    a, _ = closed(FORCE)
    block = tensor(lines(FINE * a, n, WIDTH), -lines(FINE * a / 2, n // 2, DEPTH)[::-1], Element.Q4)
    parts = {"cylinder": cylinder_end(RADIUS, a, 3 * n // 4, half=False), "block": block}
    return Scene(
        mesh=together(parts),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(SOFT),
        regions={"cylinder": Elastic(HARD)},
        supports=(
            *(Symmetry(f"{part}/left", 0) for part in parts),
            *(Support("block/base", axis) for axis in range(2)),
            Prescribed("cylinder/top", 1, -TRAVEL),
        ),
        tools=(DeformableTool(("block/top",), ("cylinder/base",), mu),),
    )


def below(accepted: Accepted) -> tuple[float, float]:
    """u_y of the block's point under the cylinder, and the mean sigma_yy of its element there."""
    scene = accepted.solved.iterate.increment.system.body.scene
    top = scene.mesh.boundary_nodes("block/top")
    (point,) = top[scene.mesh.nodes[top, 0] == 0]
    (element,) = np.flatnonzero((scene.mesh.elements == point).any(axis=1))
    return float(accepted.displacement[point, 1]), float(accepted.state.stress[element, :, 1].mean())


def run(n: int, watch: Watch) -> list[float]:
    """Half-width and largest pressure over their closed forms of the force; with friction what is published."""
    plain, rough = (watch.end(pressed(n, mu), Schedule(6)) for mu in FRICTION)
    found = borne(plain)
    a, p0 = closed(_force(plain))
    half = half_width(found.x[:, 0], found.r[:, 0], FINE * closed(FORCE)[0] / (3 * n // 4))
    sunk, stress = below(rough)
    over = FORCE / _force(rough)
    return [half / a, float(found.pressure.max()) / p0, sunk * over, stress * float(np.sqrt(over))]


def _force(accepted: Accepted) -> float:
    return abs(float(accepted.tool_force(0)[1]))


CASE = Case(
    name="hertz_two_bodies",
    subject=Subject.TWO_BODIES,
    source=(
        "closed form (Hertz) without friction; with it published: NAFEMS R0094-1, MARC's values in Code_Aster "
        "SSNP154, used to 3 %"
    ),
    purpose="Contact that grows between two elastic bodies of different stiffness: the benchmark NAFEMS R0094-1.",
    setup=(
        "An elastic cylinder, R = 50, E = 210000, on a block, 200 wide and 200 deep, E = 70000, both with nu = 0.3,"
        " in plane strain, Q4; 35 kN per length. A quarter of the cylinder and half of the block are modelled, with"
        " 3 n/4 and n equal elements to 1.3 a. The cylinder is pressed by its middle plane, y = R, which goes down "
        "by 1.564 in six increments; the base of the block is held. The force is 35 kN to 0.1 %, and values are "
        "brought to it: a, p0 and stress in proportion to its root, displacement to itself. Without friction the "
        "references are those of the force found, a^2 = 4 F R/(pi E*), p0^2 = F E*/(pi R), at 35 kN 6.21463 and "
        "3585.362; a is found from the mean square of the distance of contact forces from the middle, a^2/4 (with a"
        " sixth of the square of an element's side for what the force of a candidate stands for), and p0 is the "
        "largest pressure. With mu = 0.1 they are published values of the point of the block under the cylinder: "
        "u_y, and sigma_yy extrapolated from the body, for which the mean of the element below it is taken."
    ),
    asked=(
        Asked("a over its closed form", 1.0, 0.01),
        Asked("p0 over its closed form", 1.0, 0.01),
        Asked("mu = 0.1: u_y", -1.3026, 0.03),
        Asked("mu = 0.1: sigma_yy", -3542.7, 0.03),
    ),
    counted="equal elements to 1.3 a",
    meshes=(8, 16, 32),
    run=run,
    note=(
        "At a/R = 0.12 a is smaller and p0 larger than on half-spaces with parabolic surfaces; at a/R = 0.005 "
        "(`cattaneo_mindlin`) p0 is nearer. Published values are those of one mesh. With friction the mean stress "
        "in the element below the point rises as that becomes smaller, towards the pressure of the candidate there,"
        " which is 4 % above the published value. u_y has the compression of the block in it: on a base that slides"
        " it is -1.287, 1.2 % from what is published, which does not say how the base is held."
    ),
)
