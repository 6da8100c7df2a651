"""A mesh from a file: a barrel of nine quadrilaterals with a curved side (Gmsh, physical groups) under a punch.

Reading needs the extra ``mesh``: pip install bipot[mesh].
"""

# %%
from pathlib import Path

from bipot import Elasticity, FlatTool, Geometry, Mesh, Scene, Schedule, Support, Symmetry, Voce, VonMises, march

BARREL = Path(__file__).with_name("barrel.msh")


def main(increments: int = 10, path: Path = BARREL, mu: float = 0.1) -> dict[str, int]:
    """How many edges every boundary of the file has; prints the force while the barrel is upset."""
    mesh = Mesh.from_meshio(path)
    height = float(mesh.nodes[:, 1].max())
    barrel = Scene(
        mesh=mesh,
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(young=210_000.0, poisson=0.3), Voce(300.0, 400.0, 0.1)),
        supports=(Support("axis", 0), Symmetry("base", 1)),
        tools=(FlatTool((0.0, height), (0.0, -1.0), (0.0, -0.1 * height), ("top", "side"), mu),),
    )
    for accepted in march(barrel, Schedule(increments, first=0.005)):
        gap = accepted.solved.certificate.relative_gap
        print(f"tau = {accepted.state.tau:.3f}: force {-accepted.tool_force(0)[1]:9.1f} N, relative gap {gap:.1e}")
    return {name: len(edges) for name, edges in mesh.boundaries.items()}


# %%
if __name__ == "__main__":
    main()
