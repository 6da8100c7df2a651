"""A thick hollow sphere: loaded by an inner pressure past first yield, and unloaded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot import (
    Amplitude,
    Configuration,
    Elasticity,
    Element,
    Geometry,
    Mesh,
    Perfect,
    Pressure,
    Quadrature,
    Scene,
    Schedule,
    Support,
    VonMises,
    block,
)
from bipot.typing import Floats
from studies.verification.case import Asked, Case, Subject, Watch

INNER, OUTER, FRONT = 1.0, 2.0, 1.4
YOUNG, POISSON, YIELD = 1000.0, 0.3, 1.0

CUBES = (INNER / OUTER) ** 3
PRESSURE = float(2 * YIELD * (np.log(FRONT / INNER) + (1 - (FRONT / OUTER) ** 3) / 3))
"""Which brings the plastic front to FRONT. What it stores in the wall yields again beyond 4/3 (1 - CUBES) of YIELD."""

MOVED = (1 - POISSON) * YIELD * FRONT**3 / (YOUNG * OUTER**2)
BACK = 1.5 * (1 - POISSON) * PRESSURE * OUTER / YOUNG * CUBES / (1 - CUBES)
"""Outer displacement under the pressure, and what of it an elastic sphere has under the same."""

UP_AND_DOWN = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)))


def sphere(elements: int) -> Mesh:
    """A quarter of its meridian plane, with as many elements through the wall as along it."""
    flat = block(1.0, 1.0, elements, elements, element=Element.Q8)
    radius, angle = INNER + (OUTER - INNER) * flat.nodes[:, 0], np.pi / 2 * flat.nodes[:, 1]
    nodes = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    # The axis is where the radius is zero, to the last bit.
    nodes[flat.boundary_nodes("top"), 0] = 0.0
    return replace(flat, nodes=nodes)


def hoop(radius: Floats) -> Floats:
    """The stress around the axis that is left: that of the loaded sphere less that of an elastic one."""
    flows = 2 * YIELD * np.log(radius / INNER) - PRESSURE + YIELD
    strains = 2 / 3 * YIELD * (FRONT / OUTER) ** 3 * ((OUTER / radius) ** 3 / 2 + 1)
    elastic = PRESSURE * CUBES / (1 - CUBES) * ((OUTER / radius) ** 3 / 2 + 1)
    return np.where(radius < FRONT, flows, strains) - elastic


def run(elements: int, watch: Watch) -> list[float]:
    """Displacements of the outer surface, loaded and unloaded, and how far the stress left is from the exact one."""
    mesh = sphere(elements)
    scene = Scene(
        mesh=mesh,
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(YOUNG, POISSON), Perfect(YIELD)),
        supports=(Support("base", 1), Support("top", 0)),
        loads=(Pressure("left", PRESSURE, UP_AND_DOWN),),
        quadrature=Quadrature.GAUSS2,
        configuration=Configuration.SMALL,
    )
    outer = mesh.boundary_nodes("right")
    loaded, left = (step for step in watch.march(scene, Schedule(20, landings=(0.5,))) if step.state.tau in (0.5, 1.0))
    moved = [float(np.linalg.norm(step.displacement[outer], axis=1).mean()) for step in (loaded, left)]
    space = left.solved.iterate.increment.system.body.space
    places = space.reference.values @ mesh.nodes[mesh.elements]
    volume = space.gradients(mesh.nodes).volume
    off = left.state.stress[..., 2] - hoop(np.linalg.norm(places, axis=-1))
    return [*moved, float(np.sqrt(np.average(off**2, weights=volume))) / YIELD]


CASE = Case(
    name="thick_sphere",
    subject=Subject.MATERIAL,
    source="closed form (Hill): spherical symmetry, in which von Mises' law is Tresca's",
    purpose="Stress and displacement that are left after plastic flow, when the load is gone.",
    setup=(
        "A hollow sphere, a = 1, b = 2, E = 1000 sigma_Y, nu = 0.3, perfect plasticity, small strain, under an inner "
        "pressure that rises until the plastic front is at c = 1.4 and goes back to zero, which makes nothing yield "
        "again; a quarter of the meridian plane, Q8 with 2 x 2 points, ten increments each way. Values are "
        "displacements of the outer surface, and the root mean square over the volume of the error of the hoop stress "
        "that is left, over sigma_Y. p = 2 sigma_Y (ln(c/a) + (1 - c^3/b^3)/3), u(b) = (1 - nu) sigma_Y c^3/(E b^2); "
        "what is left is this less the elastic solution for p."
    ),
    asked=(
        Asked("u(b) under the pressure", MOVED, 1e-4),
        Asked("u(b) left", MOVED - BACK, 1e-4),
        Asked("hoop stress left, error", 0.0, 0.001),
    ),
    counted="elements through the wall",
    meshes=(5, 10, 20),
    run=run,
)
