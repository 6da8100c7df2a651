"""
A cylinder pressed flat on meshes drawn anew
============================================

Where the side of a rough cylinder rolls onto the punch, an element folds in the end. The body is unloaded before, drawn
anew and pressed on.
"""

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from bipot import Accepted, FlatTool, IncrementFailed, Mesh, Scene, Schedule, cylinder, march, transferred, upsetting

HALF, MU, LIFTED, OFF = 5.0, 0.3, 0.05, 0.002  # mm: half the height, the punch after a stage and before the next
ON_PUNCH = 0.998  # part of the height above which a node is on the punch


def drawn(mesh: Mesh, nodes: np.ndarray, elements: int) -> Mesh:
    """A grid inside the curve that the side is now; what has rolled onto the punch is part of the top."""
    top, side = nodes[:, 1].max(), nodes[mesh.boundary_nodes("side")]
    radius = nodes[nodes[:, 1] > ON_PUNCH * top, 0].max()
    r, z = side[side[:, 1] < ON_PUNCH * top].T
    grid, order = cylinder(1.0, 1.0, elements, elements), np.argsort(z)
    across = np.interp(top * grid.nodes[:, 1], [*z[order], top], [*r[order], radius])
    return replace(grid, nodes=grid.nodes * np.column_stack([across, np.full_like(across, top)]))


def stage(mesh: Mesh, height: float, to: float) -> Scene:
    """The punch goes from one half height to another, and off the body."""
    path = ((0.0, 0.0), (0.9, 1.0), (1.0, 1.0 - LIFTED / (height - to)))
    punch = FlatTool((0.0, height), (0.0, -1.0), (0.0, to - height), ("top", "side"), MU, path)
    return replace(upsetting(mu=MU, volume=None), mesh=mesh, tools=(punch,))


def row(step: Accepted) -> tuple[float, float]:
    """Half the height (mm) and the force (kN)."""
    return step.state.nodes[:, 1].max(), -1e-3 * step.tool_force(0)[1]


def main(elements: int = 8, heights: tuple[float, ...] = (2.5, 1.8, 1.25), accuracy: float = 1e-3) -> tuple:
    """Rows of the march on one mesh, and of those to the ``heights`` between which meshes are drawn; the first two."""
    one, anew, meshes, schedule = [], [], [cylinder(HALF, HALF, elements, elements)], Schedule(accuracy=accuracy)
    try:
        one.extend(map(row, march(stage(meshes[0], HALF, heights[-1]), schedule)))
    except IncrementFailed as failed:
        print(f"half the height {one[-1][0]:.2f} mm: {failed}")
    scene, start = stage(meshes[0], HALF, heights[0]), None
    for reached, to in zip(heights, (*heights[1:], None), strict=True):
        *steps, lifted = march(scene, schedule, start=start)
        anew += map(row, steps)
        if to is not None:
            meshes += replace(scene.mesh, nodes=lifted.state.nodes), drawn(scene.mesh, lifted.state.nodes, elements)
            onto = stage(meshes[-1], meshes[-1].nodes[:, 1].max() + OFF, to)
            found = transferred(lifted.state, scene, onto)
            print(f"{reached} mm: drawn anew, volume {found.volume:+.2%}, mean peeq {found.peeq:+.2%}")
            scene, start = onto, found.state
    return np.array(one), np.array(anew), *meshes[1:3]


def draw(found: tuple) -> None:
    """Forces over the reduction, and the two meshes."""
    one, anew, before, after = found
    _, (upper, lower) = plt.subplots(2, 1, figsize=(7, 6.5), height_ratios=(2.6, 1), layout="constrained")
    upper.plot(100 * (1 - one[:, 0] / HALF), one[:, 1], "o-", label="one mesh, to where an element folds")
    upper.plot(100 * (1 - anew[:, 0] / HALF), anew[:, 1], ".-", label="drawn anew")
    upper.set(xlabel="reduction of the height [%]", ylabel="force [kN]", ylim=(0, None))
    upper.legend()
    for mesh, side in ((before, -1), (after, 1)):
        x, y = mesh.nodes[mesh.elements[:, [0, 1, 2, 3, 0]]].T
        lower.plot(side * x, y, color="C0" if side < 0 else "C1", linewidth=0.8)
    lower.set(xlabel="r [mm]; left the mesh after a stage, right the one drawn anew", ylabel="z [mm]", aspect="equal")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
