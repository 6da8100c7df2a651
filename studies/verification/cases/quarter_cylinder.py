"""A quarter of the seed paper's cylinder in space, beside the same cylinder on a meridian."""

from __future__ import annotations

from bipot import Element, FlatTool, Geometry, Scene, Schedule, Symmetry, cylinder_3d, upsetting
from studies.verification.case import Asked, Case, Subject, Watch

MU, SIZE, REDUCTIONS = 0.1, 5.0, (0.20, 0.45)
MERIDIAN = 20
"""Elements a side of the axisymmetric mesh."""

SCHEDULE = Schedule(30, 0.001 / REDUCTIONS[-1], 5, landings=(REDUCTIONS[0] / REDUCTIONS[-1],))


def meridian(elements: int = MERIDIAN) -> Scene:
    """The axisymmetric cylinder above its plane of symmetry, Q4 with the mean of its volume change."""
    return upsetting(mu=MU, reduction=REDUCTIONS[-1], elements=elements, element=Element.Q4, volume=None)


def quarter(segments: int) -> Scene:
    """The same in space, its circle of so many straight segments a quarter, of the circle's area."""
    third = segments // 3
    scene = meridian(1)
    platen = FlatTool((0.0, 0.0, SIZE), (0.0, 0.0, -1.0), (0.0, 0.0, -REDUCTIONS[-1] * SIZE), ("top", "side"), MU)
    return Scene(
        mesh=cylinder_3d(SIZE, SIZE, segments // 2, third, 2 * third, inscribed=False),
        geometry=Geometry.SOLID,
        material=scene.material,
        supports=(Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)),
        tools=(platen,),
    )


def forces(scene: Scene, watch: Watch) -> list[float]:
    """Of the platen on the whole cylinder, at the reductions."""
    times = (*SCHEDULE.landings, 1.0)
    return [float(-step.tool_force(0)[-1]) for step in watch.march(scene, SCHEDULE) if step.state.tau in times]


def run(segments: int, watch: Watch) -> list[float]:
    """Forces in space over those on the meridian."""
    exact = forces(meridian(), Watch())
    return [found / known for found, known in zip(forces(quarter(segments), watch), exact, strict=True)]


CASE = Case(
    name="quarter_cylinder",
    subject=Subject.UPSETTING,
    source="a second route: the axisymmetric cylinder of the library",
    purpose=("A body in space whose solution is axisymmetric, with friction that slips in every direction."),
    setup=(
        "The seed paper's cylinder (radius and half the height 5 mm, E = 210000 MPa, nu = 0.3, sigma_Y = 300 MPa, mu ="
        " 0.1) to 45 %. In space a quarter of its upper half is modelled: n straight segments along a quarter of the"
        " circle, n/2 by n/2 elements in the square around the axis, n/3 rings around it, 2 n/3 layers, H8 with the"
        " mean of its volume change. Nodes of the side are placed outside the circle such that the volume is that of"
        f" the cylinder. On the meridian {MERIDIAN} x {MERIDIAN} Q4 with the same mean. Both use the same increments."
    ),
    asked=tuple(Asked(f"F over the axisymmetric one, {reduction:.0%}", 1.0, 0.005) for reduction in REDUCTIONS),
    counted="segments of a quarter circle",
    meshes=(6, 12),
    run=run,
    note=(
        "If the ends of the segments are on the circle instead, the section of 12 of them is 0.29 % smaller, and so "
        "is the force."
    ),
)
