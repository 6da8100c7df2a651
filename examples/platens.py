"""A block of one's own between rough platens, in plane strain: a quarter of it, what friction adds to the force."""

# %%
from bipot import Elasticity, FlatTool, Geometry, Linear, Scene, Schedule, Symmetry, VonMises, block, march

WIDTH, HEIGHT, REDUCTION = 20.0, 10.0, 0.1  # mm, of the quarter


def quarter(mu: float) -> Scene:
    """The quarter x, y >= 0; elements are smaller towards the side, where the free surface meets the platen."""
    return Scene(
        mesh=block(WIDTH, HEIGHT, 8, 4, grading=(0.5, 0.5)),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(young=70_000.0, poisson=0.33), Linear(sigma_y=100.0, modulus=200.0)),
        supports=(Symmetry("left", 0), Symmetry("base", 1)),
        tools=(FlatTool((0.0, HEIGHT), (0.0, -1.0), (0.0, -REDUCTION * HEIGHT), ("top", "right"), mu),),
    )


def main(increments: int = 20, friction: tuple[float, ...] = (0.0, 0.1, 0.3)) -> dict[float, float]:
    """Force of a platen on the whole block, a unit of thickness (N/mm), by friction, at the end."""
    forces = {}
    for mu in friction:
        *_, last = march(quarter(mu), Schedule(increments, first=0.005))
        forces[mu] = -float(last.tool_force(0)[1])
        bulge = float(last.displacement[:, 0].max())
        print(f"mu = {mu:.2f}: {forces[mu]:8.1f} N/mm, side displaced by up to {bulge:.4f} mm")
    return forces


# %%
if __name__ == "__main__":
    main()
