"""A block on a rigid plane with stick, slip and separation."""

from __future__ import annotations

import numpy as np

from bipot import (
    Configuration,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Pressure,
    Scene,
    Schedule,
    Support,
    block,
)
from studies.verification.case import Asked, Case, Subject, Watch

MOVED = {0.0: 0.0286, 1.25: 0.0272, 5.0: 0.0228, 7.5: 0.0198, 11.25: 0.0150}
"""Published u_x by place."""


def run(elements: int, watch: Watch) -> list[float]:
    """Tangential displacements of the base."""
    scene = Scene(
        mesh=block(40.0, 40.0, elements, elements, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(Elasticity(130_000.0, 0.2)),
        supports=(Support("right", 0),),
        tools=(FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 1.0),),
        loads=(Pressure("top", 50.0), Pressure("left", 150.0)),
        configuration=Configuration.SMALL,
    )
    end = watch.end(scene, Schedule(5))
    base = scene.mesh.boundary_nodes("base")
    base = base[np.argsort(scene.mesh.nodes[base, 0])]
    return np.interp(list(MOVED), scene.mesh.nodes[base, 0], end.displacement[base, 0]).tolist()


CASE = Case(
    name="block_on_plane",
    subject=Subject.ELASTIC_CONTACT,
    source="published: Raous, Chabrand and Lebon; Code_Aster SSNV128, an average of codes known to 5 %",
    purpose="All three states of a contact at once: the corner lifts off, the middle slips, the rest sticks.",
    setup=(
        "Plane strain, 40 x 40, E = 130000, nu = 0.2, mu = 1 on the base, u_x = 0 on the right, pressures of 50 on "
        "the top and 150 on the left, small strain, five increments, Q8. The values are u_x at points of the base."
    ),
    asked=tuple(Asked(f"u_x at x = {x:g}", moved, 0.05) for x, moved in MOVED.items()),
    counted="elements a side",
    meshes=(8, 16, 32),
    run=run,
    note=(
        "The published mesh is 32 x 32. The error at x = 11.25 does not decrease with the mesh, because the "
        "published numbers are an average, given to three digits."
    ),
)
