"""
Coining: a die that fills
=========================

A blank is pressed into a closed die with a fillet, and the force rises as the die fills.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp
from bipot import plot

RADIUS, HALF = 4.5, 4.0  # mm: the blank, the upper half of which is modelled
WALL, FILLET, STROKE = 5.0, 0.5, 0.73  # mm: the die, and how far each half of it goes

# Up the wall and back to the axis: the profile has the tool on its right.
DIE = bp.Profile(((WALL, -2.0), (WALL, HALF), (0.0, HALF)), fillets=FILLET)


def blank(elements: int) -> bp.Scene:
    """So many elements along the radius."""
    return bp.Scene(
        mesh=bp.cylinder(RADIUS, HALF, elements, elements),
        geometry=bp.Geometry.AXISYMMETRIC,
        material=bp.VonMises(bp.Elasticity(young=70_000.0, poisson=0.33), bp.Linear(sigma_y=100.0, modulus=200.0)),
        supports=(bp.Support("axis", 0), bp.Symmetry("base", 1)),
        tools=(bp.ShapedTool(DIE, (0.0, -STROKE), ("top", "side"), mu=0.1),),
    )


def main(increments: int = 60, elements: int = 10) -> tuple[list[tuple[float, float, float]], bp.Accepted]:
    """Stroke (mm), force (kN), the largest gap between blank and die (mm), and the last increment."""
    rows, steps = [], []
    for accepted in bp.march(blank(elements), bp.Schedule(increments, first=0.002)):
        steps.append(accepted)
        force, gap = -float(accepted.tool_force(0)[1]) / 1000, float(accepted.state.gap.max())
        rows.append((STROKE * accepted.state.tau, force, gap))
        print("stroke {:.3f} mm: {:6.2f} kN, the blank is up to {:.3f} mm from the die".format(*rows[-1]))
    return rows, steps[-1]


def draw(found: tuple[list[tuple[float, float, float]], bp.Accepted]) -> None:
    """The force over the stroke, and the blank in the die at the end, coloured by its equivalent plastic strain."""
    rows, last = found
    _, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    stroke, force, _gap = np.transpose(rows)
    left.plot(stroke, force)
    left.set(xlabel="stroke [mm]", ylabel="force [kN]")
    plot.body(last, last.peeq.mean(axis=1), right, label="plastic strain", lw=0.4)
    right.plot(*np.add(DIE.points, (0.0, -STROKE)).T, color="black")
    right.set(xlabel="r [mm]", ylabel="z [mm]", aspect="equal", xlim=(0, 5.5), ylim=(0, 4))


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
