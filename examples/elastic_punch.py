"""
A punch that gives way
======================

A billet is upset by a punch of hard metal, which is a part of the mesh, and by a rigid one. The elastic punch is dented
where the billet presses it most.
"""

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import bipot as bp

RADIUS, HALF, PUNCH = 5.0, 5.0, (8.0, 5.0)  # mm: of the billet, and radius and height of the punch
STEEL = bp.VonMises(bp.Elasticity(210_000.0, 0.3), bp.Linear(sigma_y=300.0, modulus=500.0))

Found = tuple[list[tuple[str, float, float]], bp.Accepted]


def scene(mu: float, young: float | None, travel: float, elements: int = 8) -> bp.Scene:
    """The upper half of the billet, below a punch with that Young's modulus (MPa), or a rigid one."""
    billet = bp.cylinder(RADIUS, HALF, elements, elements)
    rigid = bp.FlatTool((0.0, HALF), (0.0, -1.0), (0.0, -travel), ("top", "side"), mu)
    supports = bp.Support("axis", 0), bp.Symmetry("base", 1)
    alone = bp.Scene(billet, bp.Geometry.AXISYMMETRIC, STEEL, supports, (rigid,))
    if young is None:
        return alone
    punch = bp.cylinder(*PUNCH, elements, elements // 2)
    above = replace(punch, nodes=np.add(punch.nodes, (0.0, HALF)))
    held = bp.Symmetry("billet/base", 1), bp.Support("billet/axis", 0), bp.Support("punch/axis", 0)
    tool = bp.DeformableTool(("punch/base",), ("billet/top", "billet/side"), mu)
    return replace(
        alone,
        mesh=bp.together({"billet": billet, "punch": above}),
        supports=(*held, bp.Prescribed("punch/top", 1, -travel)),
        tools=(tool,),
        regions={"punch": bp.Elastic(bp.Elasticity(young, 0.25))},
    )


def main(mu: float = 0.1, travel: float = 1.0, elements: int = 8) -> Found:
    """For each punch its force (kN) and how far its face is dented on the axis, below its edge (micrometres).

    Beside these rows, how the last punch and its billet are in the end.
    """
    rows, lasts = [], []
    for name, young in (("rigid", None), ("hard metal", 600_000.0), ("steel", 210_000.0)):
        made = scene(mu, young, travel, elements)
        *_, last = bp.march(made, bp.Schedule(accuracy=1e-3))
        lasts.append(last)
        dent = 0.0
        if young is not None:
            face = last.state.nodes[made.mesh.boundary_nodes("punch/base")]
            dent = float(face[np.argmin(face[:, 0]), 1] - face[np.argmax(face[:, 0]), 1])
        rows.append((name, -float(last.tool_forces[0, 1]) / 1000, 1000 * dent))
        print(f"{name:10}  {rows[-1][1]:.2f} kN, dented by {rows[-1][2]:.1f} micrometres")
    return rows, lasts[-1]


def draw(found: Found) -> None:
    """The equivalent stress in billet and punch, both of steel, with their force."""
    rows, last = found
    mises = last.mises.mean(axis=1)
    x = last.state.nodes[last.scene.mesh.elements]
    figure, axes = plt.subplots()
    cells = PolyCollection(list(x), array=mises, cmap="cividis", edgecolor="0.5", lw=0.3)
    axes.add_collection(cells)
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set(xlabel="r [mm]", ylabel="z [mm]", title=f"equivalent stress, steel on steel: {rows[-1][1]:.1f} kN")
    figure.colorbar(cells, label="MPa")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
