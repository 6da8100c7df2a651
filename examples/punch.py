"""
A punch driven by a force
=========================

A flat punch is pressed into a strip by a force, which is held, partly removed and applied again.
"""

# %%
import matplotlib.pyplot as plt

import bipot as bp

WIDTH, DEPTH, PUNCH = 12.0, 6.0, 3.0  # mm; half of the strip and half of the punch are modelled
LOAD = bp.Amplitude(((0.0, 0.0), (0.5, 1.0), (0.7, 0.2), (0.9, 1.0), (1.0, 1.0)))


def strip(force: float) -> bp.Scene:
    """The half x >= 0; the punch may touch the edges of the top below it, which get a name of their own."""
    mesh = bp.block(WIDTH, DEPTH, 16, 8)
    top = mesh.boundary("top")
    below = top[(mesh.nodes[top, 0] <= PUNCH + 1e-9).all(axis=1)]
    mesh = bp.Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "below": below})
    push = bp.Force((0.0, -force), LOAD)
    return bp.Scene(
        mesh=mesh,
        geometry=bp.Geometry.PLANE_STRAIN,
        material=bp.VonMises(bp.Elasticity(young=70_000.0, poisson=0.33), bp.Linear(sigma_y=100.0, modulus=700.0)),
        supports=(bp.Symmetry("left", 0), bp.Support("right", 0), bp.Support("base", 1)),
        tools=(bp.FlatTool((0.0, DEPTH), (0.0, -1.0), (0.0, 0.0), ("below",), 0.2, driven_by=push),),
    )


def main(increments: int = 20, force: float = 2200.0) -> list[tuple[float, float]]:
    """Force on the whole punch (N/mm) and how far it has sunk in (mm)."""
    rows = []
    for accepted in bp.march(strip(force), bp.Schedule(increments, first=0.01)):
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
