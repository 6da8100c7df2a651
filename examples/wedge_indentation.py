"""A smooth wedge pressed into a block: the force grows with the depth, and a lip rises at its sides.

Where the body is next to rigid and does not harden, the flow is similar to itself at every depth, and known (Hill, Lee
and Tupper).
"""

# %%
from math import sqrt

from bipot import (
    Elasticity,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    VonMises,
    block,
    march,
    wedge,
)

WIDTH, HEIGHT, DEPTH = 14.0, 10.0, 1.0  # mm; half of the block is modelled
YIELD, YOUNG = 300.0, 1e6  # MPa
FORCE = 24.7662  # F/(2 k h) on both faces, of semi-angle 75 degrees


def half(elements: int) -> Scene:
    """The half x >= 0 under the wedge, with so many elements through the height."""
    punch = ShapedTool(wedge((0.0, HEIGHT), 75.0, 20.0), travel=(0.0, -DEPTH), candidates=("top",), mu=0.0)
    return Scene(
        mesh=block(WIDTH, HEIGHT, 2 * elements, elements, grading=(3.0, 1.0)),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(YOUNG, 0.3), Perfect(YIELD)),
        supports=(Symmetry("left", 0), Support("right", 0), Support("base", 0), Support("base", 1)),
        tools=(punch,),
    )


def main(increments: int = 60, elements: int = 16) -> list[tuple[float, float]]:
    """Depth (mm) and F/(2 k h) at every increment."""
    rows = []
    for accepted in march(half(elements), Schedule(increments)):
        depth = accepted.state.tau * DEPTH
        rows.append((depth, -float(accepted.tool_force(0)[1]) / (2 * YIELD / sqrt(3) * depth)))
        lip = float(accepted.state.nodes[:, 1].max()) - HEIGHT
        print(f"{depth:.3f} mm deep: F/(2kh) = {rows[-1][1]:.2f} (known: {FORCE}), lip {lip:.3f} mm high")
    return rows


# %%
if __name__ == "__main__":
    main()
