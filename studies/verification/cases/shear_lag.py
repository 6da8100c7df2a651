"""A bar that is pulled over a plane whose friction is limited, and released."""

from __future__ import annotations

from bipot import (
    Amplitude,
    Configuration,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Pressure,
    Scene,
    Schedule,
    Traction,
    block,
)
from studies.verification.case import Asked, Case, Subject, Watch

THICK, STIFFNESS, FRICTION, PULL, MU = 1e-3, 1000.0, 10.0, 5.0, 0.5
MOVED = PULL**2 / (2 * FRICTION * STIFFNESS)
PRESSED = Amplitude(((0.0, 0.0), (0.1, 1.0), (1.0, 1.0)))
PULLED, RELEASED = 0.5, 1.0
PULLING = Amplitude(((0.0, 0.0), (0.1, 0.0), (PULLED, 1.0), (RELEASED, 0.0)))


def run(elements: int, watch: Watch) -> list[float]:
    """End displacement and dissipation at the full pull, end displacement after release."""
    scene = Scene(
        mesh=block(1.0, THICK, elements, 1, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(Elasticity(STIFFNESS / THICK, 0.0)),
        supports=(),
        tools=(FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), MU),),
        loads=(Pressure("top", FRICTION / MU, PRESSED), Traction("right", (PULL / THICK, 0.0), PULLING)),
        configuration=Configuration.SMALL,
    )
    right, out = scene.mesh.boundary_nodes("right"), list[float]()
    for step in watch.march(scene, Schedule(elements, landings=(0.1, PULLED))):
        if step.state.tau in (PULLED, RELEASED):
            out.append(float(step.displacement[right, 0].mean()))
        if step.state.tau == PULLED:
            out.append(float(step.energies.friction))
    return out


CASE = Case(
    name="shear_lag",
    subject=Subject.ELASTIC_CONTACT,
    source="closed form: shear lag of a bar, q u' = EA u'' where it slips",
    purpose=("Slip that spreads and reverses: the dissipation, and the displacement that remains after unloading."),
    setup=(
        "A bar (EA = 1000, length 1, thickness 0.001 so that the eccentricity of its pull does not matter) on a "
        "rigid plane, whose friction is at most q = 10 per unit of length, is pulled by F = 5 and released. It slips"
        " on half its length; its end moves by F^2/(2 q EA), half of which remains; F^3/(6 q EA) is dissipated in "
        "loading. Q8, plane strain, nu = 0, small strain, as many increments as elements."
    ),
    asked=(
        Asked("end displacement", MOVED, 0.01),
        Asked("dissipated in loading", PULL**3 / (6 * FRICTION * STIFFNESS), 0.01),
        Asked("end displacement left", MOVED / 2, 0.01),
    ),
    counted="elements along the bar",
    meshes=(25, 50, 100),
    run=run,
)
