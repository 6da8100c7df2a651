"""
A clad billet
=============

A steel cylinder with a copper core, and one of copper with a steel core, upset between rough platens. Both metals are
regions of one mesh, as if welded at their interface. Without friction each carries its own stress on its share of the
area, a quarter and three quarters. Friction makes the interface bulge, and the steel cylinder with a copper core then
needs less force than by these shares.
"""

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import bipot as bp
from bipot import plot

SIZE, CORE, REDUCTION = 5.0, 2.5, 0.4  # mm: radius and half the height, radius of the core; part of the height
METALS = {
    "steel": bp.VonMises(bp.Elasticity(210_000.0, 0.3), bp.Linear(300.0, 1000.0)),
    "copper": bp.VonMises(bp.Elasticity(120_000.0, 0.34), bp.Linear(80.0, 400.0)),
}
BILLETS = {  # core, and what is around it
    "copper": ("copper", "copper"),
    "steel core": ("steel", "copper"),
    "copper core": ("copper", "steel"),
    "steel": ("steel", "steel"),
}


def quarter(core: str, around: str, mu: float, elements: int) -> bp.Scene:
    """The upper half of the meridian, under a platen; an even number of elements puts the interface between two."""
    mesh = bp.cylinder(SIZE, SIZE, elements, elements)
    middle = mesh.nodes[mesh.elements, 0].mean(axis=1)
    return bp.Scene(
        mesh=replace(mesh, regions={"core": middle < CORE}),
        geometry=bp.Geometry.AXISYMMETRIC,
        material=METALS[around],
        regions={"core": METALS[core]},
        supports=(bp.Support("axis", 0), bp.Symmetry("base", 1)),
        tools=(bp.FlatTool((0.0, SIZE), (0.0, -1.0), (0.0, -REDUCTION * SIZE), ("top", "side"), mu),),
    )


def main(
    accuracy: float = 1e-3, elements: int = 16, friction: tuple[float, ...] = (0.0, 0.2)
) -> dict[float, dict[str, bp.Accepted]]:
    """The last increment of each billet at each coefficient of friction."""
    found, share = {}, (CORE / SIZE) ** 2
    for mu in friction:
        scenes = {name: quarter(*metals, mu, elements) for name, metals in BILLETS.items()}
        found[mu] = {name: list(bp.march(scene, bp.Schedule(accuracy=accuracy)))[-1] for name, scene in scenes.items()}
        force = {name: -1e-3 * last.tool_force(0)[1] for name, last in found[mu].items()}
        for name, (core, around) in BILLETS.items():
            shares = share * force[core] + (1 - share) * force[around]
            print(f"mu = {mu}, {name}: {force[name]:.2f} kN, by shares of the area {shares:.2f} kN")
    return found


def draw(found: dict[float, dict[str, bp.Accepted]]) -> None:
    """Plastic strain with most friction, on the modelled quarters; the black lines are interfaces."""
    lasts = found[max(found)]
    peeq = {name: lasts[name].peeq.mean(axis=1) for name in ("copper core", "steel core")}
    limits = np.min(list(peeq.values())), np.max(list(peeq.values()))
    _, axes = plt.subplots(1, 2, figsize=(10, 2.8), sharex=True, sharey=True, layout="constrained")
    for ax, name in zip(axes, peeq, strict=True):
        ax.set(xlabel="r [mm]", title=f"{name} in {BILLETS[name][1]}, mu = {max(found)}", aspect="equal")
    axes[0].set(ylabel="z [mm]")
    faces = [plot.body(lasts[name], peeq[name], ax, lw=0.2, clim=limits) for ax, name in zip(axes, peeq, strict=True)]
    plt.colorbar(faces[0], ax=axes, label="equivalent plastic strain", shrink=0.85)


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
