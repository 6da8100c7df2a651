"""
A roller between two plates
===========================

Friction alone holds an elastic roller between two plates. As the upper one moves, it rolls half as far, and nothing
slips. The force along the plates would be none if the roller were round; the edges of elements leave a hundredth.
"""

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import bipot as bp

RADIUS, PLATE, HEIGHT = 5.0, 24.0, 3.0  # mm: of the roller, and length and height of the plates
STEEL = bp.Elastic(bp.Elasticity(young=210_000.0, poisson=0.3))
PRESSED, HELD = bp.Amplitude(((0, 0), (0.2, 1), (1, 1))), bp.Amplitude(((0, 0), (0.2, 0), (1, 1)))


def scene(travel: float, mu: float, elements: int) -> bp.Scene:
    """The roller is pressed by 0.1 mm, then the upper plate goes by the ``travel`` (mm)."""
    square = bp.block(2.0, 2.0, elements, elements, element=bp.Element.Q8)
    u, v = (square.nodes - 1.0).T
    disc = np.stack([u * np.sqrt(1 - v**2 / 2), v * np.sqrt(1 - u**2 / 2)], axis=1)
    plate = bp.block(PLATE, HEIGHT, 4 * elements, 2, element=bp.Element.Q8)
    parts = {
        "low": replace(plate, nodes=plate.nodes - (PLATE / 2, RADIUS + HEIGHT)),
        "roller": replace(square, nodes=RADIUS * disc),
        "up": replace(plate, nodes=plate.nodes - (PLATE / 2, -RADIUS)),
    }
    around = tuple(f"roller/{side}" for side in ("left", "right", "base", "top"))
    return bp.Scene(
        mesh=bp.together(parts),
        geometry=bp.Geometry.PLANE_STRAIN,
        material=STEEL,
        supports=(
            *(bp.Support("low/base", axis) for axis in range(2)),
            bp.Prescribed("up/top", 0, travel, HELD),
            bp.Prescribed("up/top", 1, -0.1, PRESSED),
        ),
        tools=tuple(bp.DeformableTool((side,), around, mu) for side in ("low/top", "up/base")),
    )


def main(travel: float = 3.0, mu: float = 0.3, elements: int = 8, increments: int = 15) -> list[bp.Accepted]:
    """The increments; printed are the way of the roller over that of the plate, and the forces over each other."""
    made = scene(travel, mu, elements)
    steps = list(bp.march(made, bp.Schedule(increments)))
    own = np.unique(made.mesh.elements[made.mesh.region("roller")])
    for step in steps:
        gone, (along, across) = travel * HELD.at(step.state.tau), step.tool_force(1)
        if gone > 0:
            moved = float((step.state.nodes - made.mesh.nodes)[own, 0].mean())
            print(f"{gone:4.2f} mm: {moved / gone:.4f} of it, force {along / across:8.1e} of the pressing one")
    return steps


def draw(steps: list[bp.Accepted]) -> None:
    """The equivalent stress at the end; elements are drawn by their corners."""
    made = steps[-1].solved.iterate.increment.system.body.scene
    figure, axes = plt.subplots()
    x = steps[-1].state.nodes[made.mesh.elements[:, :4]]
    cells = PolyCollection(list(x), array=steps[-1].mises.mean(axis=1), cmap="cividis", edgecolor="0.5", lw=0.3)
    axes.add_collection(cells)
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set(xlabel="x [mm]", ylabel="y [mm]", title="equivalent stress in a roller and its plates")
    figure.colorbar(cells, label="MPa", orientation="horizontal")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
