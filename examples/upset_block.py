"""
Upsetting a block in space
==========================

An eighth of a cube is compressed between platens by a fifth of its height. Without friction it remains a block, with
friction its sides bulge. Coulomb's law holds at every node of the face under the platen, along two tangents.
"""

# %%
from importlib.util import find_spec

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from bipot import Accepted, Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Symmetry, VonMises, brick, march

SIZE, REDUCTION, YIELD = 10.0, 0.2, 300.0  # mm, of the whole cube; MPa
STRAINS = 0.0, 0.6


def eighth(mu: float, n: int) -> Scene:
    """The eighth x, y, z >= 0 with n elements a side; its sides may come onto the platen."""
    half = SIZE / 2
    travel, sides = (0.0, 0.0, -REDUCTION * half), ("top", "right", "back")
    platen = FlatTool((0.0, 0.0, half), (0.0, 0.0, -1.0), travel, sides, mu)
    return Scene(
        mesh=brick(half, half, half, n, n, n),
        geometry=Geometry.SOLID,
        material=VonMises(Elasticity(young=210_000.0, poisson=0.3), Perfect(YIELD)),
        supports=(Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)),
        tools=(platen,),
    )


def main(
    increments: int = 20, elements: int = 6, friction: tuple[float, ...] = (0.0, 0.1, 0.3)
) -> dict[float, Accepted]:
    """The last increment, by friction."""
    found = {}
    for mu in friction:
        *_, last = march(eighth(mu, elements), Schedule(increments, first=0.005))
        found[mu] = last
        force, wide = -last.tool_force(0)[2], last.state.nodes[last.scene.mesh.boundary_nodes("right"), 0]
        print(
            f"mu = {mu:.1f}: {force:.0f} N on the whole block, half its width {wide.min():.3f} to {wide.max():.3f} mm"
        )
    return found


def picture(last: Accepted) -> np.ndarray:
    """The deformed eighth, coloured by its plastic strain, as pixels."""
    import pyvista

    mesh = last.scene.mesh
    grid = pyvista.UnstructuredGrid({mesh.element.vtk: mesh.elements}, np.array(last.state.nodes))
    grid.cell_data["peeq"] = last.peeq.mean(axis=1)
    view = pyvista.Plotter(off_screen=True, window_size=[600, 600])
    view.add_mesh(grid, show_edges=True, cmap="viridis", clim=STRAINS, lighting=False, show_scalar_bar=False)
    view.camera_position = "iso"
    return np.asarray(view.screenshot(return_img=True))


def draw(found: dict[float, Accepted]) -> None:
    """Pictures of the eighth at the end, beside each other."""
    figure, axes = plt.subplots(1, len(found), figsize=(3.3 * len(found), 3.6), squeeze=False, layout="constrained")
    for ax, (mu, last) in zip(axes.flat, found.items(), strict=True):
        ax.set(title=f"mu = {mu}: {-last.tool_force(0)[2]:.0f} N", xticks=[], yticks=[], frame_on=False)
        if find_spec("pyvista"):
            ax.imshow(picture(last))
        else:
            ax.plot([])
            ax.text(0.5, 0.5, "no picture: pyvista is not installed", ha="center", transform=ax.transAxes)
    figure.colorbar(ScalarMappable(Normalize(*STRAINS), "viridis"), ax=axes, label="plastic strain", shrink=0.8)


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
