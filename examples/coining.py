"""Coining: a blank is pressed into a closed die with a fillet, and the force rises as the die fills."""

# %%
from bipot import (
    Elasticity,
    Geometry,
    Linear,
    Profile,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    VonMises,
    cylinder,
    march,
)

RADIUS, HALF = 4.5, 4.0  # mm: the blank, the upper half of which is modelled
WALL, FILLET, STROKE = 5.0, 0.5, 0.73  # mm: the die, and how far each half of it goes

# Up the wall and back to the axis: the tool is on the right of who goes so.
DIE = Profile(((WALL, -2.0), (WALL, HALF), (0.0, HALF)), fillets=FILLET)


def blank(elements: int) -> Scene:
    """So many elements along the radius."""
    return Scene(
        mesh=cylinder(RADIUS, HALF, elements, elements),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(young=70_000.0, poisson=0.33), Linear(sigma_y=100.0, modulus=200.0)),
        supports=(Support("axis", 0), Symmetry("base", 1)),
        tools=(ShapedTool(DIE, (0.0, -STROKE), ("top", "side"), mu=0.1),),
    )


def main(increments: int = 60, elements: int = 10) -> list[tuple[float, float, float]]:
    """Stroke (mm), force (kN), and the largest gap between blank and die (mm)."""
    rows = []
    for accepted in march(blank(elements), Schedule(increments, first=0.002)):
        force, gap = -float(accepted.tool_force(0)[1]) / 1000, float(accepted.state.gap.max())
        rows.append((STROKE * accepted.state.tau, force, gap))
        print("stroke {:.3f} mm: {:6.2f} kN, the blank is up to {:.3f} mm from the die".format(*rows[-1]))
    return rows


# %%
if __name__ == "__main__":
    main()
