"""
Wedge indentation
=================

The force of a smooth wedge grows with the depth, and a lip rises at its sides. In a nearly rigid, perfectly plastic
body the flow is self-similar, and its solution is known (Hill, Lee and Tupper).
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp
from bipot import plot

WIDTH, HEIGHT, DEPTH = 14.0, 10.0, 1.0  # mm; half of the block is modelled
YIELD, YOUNG = 300.0, 1e6  # MPa
FORCE = 24.7662  # F/(2 k h) on both faces, of semi-angle 75 degrees


def half(elements: int) -> bp.Scene:
    """The half x >= 0 under the wedge, with so many elements through the height."""
    punch = bp.ShapedTool(bp.wedge((0.0, HEIGHT), 75.0, 20.0), travel=(0.0, -DEPTH), candidates=("top",), mu=0.0)
    return bp.Scene(
        mesh=bp.block(WIDTH, HEIGHT, 2 * elements, elements, grading=(3.0, 1.0)),
        geometry=bp.Geometry.PLANE_STRAIN,
        material=bp.VonMises(bp.Elasticity(YOUNG, 0.3), bp.Perfect(YIELD)),
        supports=(bp.Symmetry("left", 0), bp.Support("right", 0), bp.Support("base", 0), bp.Support("base", 1)),
        tools=(punch,),
    )


def main(increments: int = 60, elements: int = 16) -> tuple[list[tuple[float, float]], bp.Accepted]:
    """Depth (mm) and F/(2 k h) at every increment, and the last one."""
    rows, steps = [], []
    for accepted in bp.march(half(elements), bp.Schedule(increments)):
        steps.append(accepted)
        depth = accepted.state.tau * DEPTH
        rows.append((depth, -float(accepted.tool_force(0)[1]) / (2 * YIELD / np.sqrt(3) * depth)))
        lip = float(accepted.state.nodes[:, 1].max()) - HEIGHT
        print(f"{depth:.3f} mm deep: F/(2kh) = {rows[-1][1]:.2f} (known: {FORCE}), lip {lip:.3f} mm high")
    return rows, steps[-1]


def draw(found: tuple[list[tuple[float, float]], bp.Accepted]) -> None:
    """The force over the depth, and the half under the wedge, coloured by its equivalent plastic strain."""
    rows, last = found
    _, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    left.plot(*np.transpose(rows), label="march")
    left.axhline(FORCE, color="0.4", ls="--", label="Hill, Lee and Tupper")
    left.set(xlabel="depth [mm]", ylabel="F/(2kh)")
    left.legend()
    plot.body(last, last.peeq.mean(axis=1), right, label="plastic strain", lw=0.2)
    right.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", xlim=(0, 8), ylim=(4, 11))


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
