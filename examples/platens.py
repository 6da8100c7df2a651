"""
A block between platens
=======================

A quarter of a block in plane strain, with a graded mesh: how much friction adds to the force.
"""

# %%
import matplotlib.pyplot as plt

import bipot as bp
from bipot import plot

WIDTH, HEIGHT, REDUCTION = 20.0, 10.0, 0.1  # mm, of the quarter


def quarter(mu: float) -> bp.Scene:
    """The quarter x, y >= 0; elements are smaller towards the side, where the free surface meets the platen."""
    return bp.Scene(
        mesh=bp.block(WIDTH, HEIGHT, 8, 4, grading=(0.5, 0.5)),
        geometry=bp.Geometry.PLANE_STRAIN,
        material=bp.VonMises(bp.Elasticity(young=70_000.0, poisson=0.33), bp.Linear(sigma_y=100.0, modulus=200.0)),
        supports=(bp.Symmetry("left", 0), bp.Symmetry("base", 1)),
        tools=(bp.FlatTool((0.0, HEIGHT), (0.0, -1.0), (0.0, -REDUCTION * HEIGHT), ("top", "right"), mu),),
    )


def force(accepted: bp.Accepted) -> float:
    """Of a platen on the whole block, per unit of thickness (N/mm)."""
    return -float(accepted.tool_force(0)[1])


def main(increments: int = 20, friction: tuple[float, ...] = (0.0, 0.1, 0.3)) -> dict[float, bp.Accepted]:
    """The last increment, by friction."""
    found = {}
    for mu in friction:
        *_, found[mu] = bp.march(quarter(mu), bp.Schedule(increments, first=0.005))
        bulge = float(found[mu].displacement[:, 0].max())
        print(f"mu = {mu:.2f}: {force(found[mu]):8.1f} N/mm, side displaced by up to {bulge:.4f} mm")
    return found


def draw(found: dict[float, bp.Accepted]) -> None:
    """The quarters at the end, each coloured by its equivalent plastic strain."""
    _, axes = plt.subplots(len(found), figsize=(7, 8), sharex=True, layout="constrained")
    for ax, (mu, last) in zip(axes, found.items(), strict=True):
        ax.set(title=f"mu = {mu}: {force(last):.0f} N/mm", ylabel="y [mm]", aspect="equal")
        plot.body(last, last.peeq.mean(axis=1), ax, label="plastic strain", clim=(0.0, 0.3))
    axes[-1].set(xlabel="x [mm]")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
