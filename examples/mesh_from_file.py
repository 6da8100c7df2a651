"""
A mesh from a Gmsh file
=======================

A barrel of nine quadrilaterals with a curved side (physical groups) under a punch. Reading needs the extra ``mesh``:
``pip install ".[mesh]"`` in a copy of the repository.
"""

# %%
from pathlib import Path

import matplotlib.pyplot as plt

import bipot as bp
from bipot import plot

BARREL = Path(__file__).with_name("barrel.msh")


def main(increments: int = 10, path: Path = BARREL, mu: float = 0.1) -> tuple[dict[str, int], bp.Accepted]:
    """How many edges every boundary of the file has, and the last increment of the upsetting."""
    mesh = bp.Mesh.from_meshio(path)
    height = float(mesh.nodes[:, 1].max())
    barrel = bp.Scene(
        mesh=mesh,
        geometry=bp.Geometry.AXISYMMETRIC,
        material=bp.VonMises(bp.Elasticity(young=210_000.0, poisson=0.3), bp.Voce(300.0, 400.0, 0.1)),
        supports=(bp.Support("axis", 0), bp.Symmetry("base", 1)),
        tools=(bp.FlatTool((0.0, height), (0.0, -1.0), (0.0, -0.1 * height), ("top", "side"), mu),),
    )
    steps = []
    for accepted in bp.march(barrel, bp.Schedule(increments, first=0.005)):
        steps.append(accepted)
        gap = accepted.solved.certificate.relative_gap
        print(f"tau = {accepted.state.tau:.3f}: force {-accepted.tool_force(0)[1]:9.1f} N, relative gap {gap:.1e}")
    return {name: len(edges) for name, edges in mesh.boundaries.items()}, steps[-1]


def draw(found: tuple[dict[str, int], bp.Accepted]) -> None:
    """The barrel at the end, its boundaries by name."""
    edges, last = found
    mesh = last.scene.mesh
    plot.mesh(last.state.nodes, mesh.elements)
    for color, (name, count) in enumerate(edges.items()):
        plot.boundary(last.state.nodes, mesh.boundary(name), color=f"C{color}", lw=2, label=f"{name}: {count} edges")
    plt.gca().set(aspect="equal", xlabel="r [mm]", ylabel="z [mm]")
    plt.legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
