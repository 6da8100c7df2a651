"""A sphere pressed into perfect plasticity: the mean pressure tends to three yield stresses, and the rim piles up."""

# %%
from math import pi

from bipot import (
    Circle,
    Elasticity,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    VonMises,
    cylinder,
    march,
)

SIZE, RADIUS, DEPTH, YIELD = 10.0, 5.0, 0.1, 200.0  # mm, MPa


def dented(elements: int) -> Scene:
    """So many elements along the surface and the axis, finer towards the contact."""
    return Scene(
        mesh=cylinder(SIZE, SIZE, elements, elements, grading=(20.0, 0.05)),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(young=200_000.0, poisson=0.3), Perfect(YIELD)),
        supports=(Support("base", 0), Support("base", 1), Support("axis", 0)),
        tools=(ShapedTool(Circle((0.0, SIZE + RADIUS), RADIUS), (0.0, -DEPTH), ("top",), mu=0.0),),
    )


def main(increments: int = 20, elements: int = 24) -> list[tuple[float, float, float]]:
    """Depth (mm), mean pressure over the yield stress, how far the rim is above the surface (mm)."""
    scene, rows = dented(elements), []
    top = scene.mesh.boundary_nodes("top")
    for accepted in march(scene, Schedule(increments)):
        r, z = accepted.state.nodes[top].T
        nodes = accepted.solved.iterate.increment.system.candidates.node
        edge = accepted.state.nodes[nodes[accepted.solved.r[:, 0] > 0], 0].max()
        edge = (edge + r[r > edge].min()) / 2
        pressure = -float(accepted.tool_force(0)[1]) / (pi * edge**2)
        rows.append((DEPTH * accepted.state.tau, pressure / YIELD, float(z.max()) - SIZE))
        print("depth {:.3f} mm: a mean pressure of {:.2f} yield stresses, pile-up {:+.4f} mm".format(*rows[-1]))
    return rows


# %%
if __name__ == "__main__":
    main()
