"""
A punch that a force drives
===========================

A flat punch pressed into a strip by a force, which is held, partly taken off and put on again.
"""

# %%
import matplotlib.pyplot as plt

from bipot import (
    Amplitude,
    Elasticity,
    FlatTool,
    Force,
    Geometry,
    Linear,
    Mesh,
    Scene,
    Schedule,
    Support,
    Symmetry,
    VonMises,
    block,
    march,
)

WIDTH, DEPTH, PUNCH = 12.0, 6.0, 3.0  # mm; half of the strip and half of the punch are modelled
LOAD = Amplitude(((0.0, 0.0), (0.5, 1.0), (0.7, 0.2), (0.9, 1.0), (1.0, 1.0)))


def strip(force: float) -> Scene:
    """The half x >= 0; the punch may touch the edges of the top below it, which get a name of their own."""
    mesh = block(WIDTH, DEPTH, 16, 8)
    top = mesh.boundary("top")
    below = top[(mesh.nodes[top, 0] <= PUNCH + 1e-9).all(axis=1)]
    mesh = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "below": below})
    push = Force((0.0, -force), LOAD)
    return Scene(
        mesh=mesh,
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(young=70_000.0, poisson=0.33), Linear(sigma_y=100.0, modulus=700.0)),
        supports=(Symmetry("left", 0), Support("right", 0), Support("base", 1)),
        tools=(FlatTool((0.0, DEPTH), (0.0, -1.0), (0.0, 0.0), ("below",), 0.2, driven_by=push),),
    )


def main(increments: int = 20, force: float = 2200.0) -> list[tuple[float, float]]:
    """Force on the whole punch (N/mm) and how far it has sunk in (mm)."""
    rows = []
    for accepted in march(strip(force), Schedule(increments, first=0.01)):
        pushed, sunk = -float(accepted.tool_force(0)[1]), float(accepted.state.translation[0])
        rows.append((pushed, sunk))
        print(f"F = {pushed:7.1f} N/mm, sunk by {sunk:.5f} mm, {accepted.form.value}, {accepted.passes} passes")
    return rows


def draw(rows: list[tuple[float, float]]) -> None:
    """The force over how far the punch has sunk in."""
    force, sunk = zip(*rows, strict=True)
    plt.plot([0.0, *sunk], [0.0, *force], "o-")
    plt.xlabel("sunk by [mm]")
    plt.ylabel("force [N/mm]")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
