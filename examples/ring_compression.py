"""The ring compression test: the bore opens where friction is low and closes where it is high.

A ring 6 : 3 : 2 (outer diameter, inner diameter, height) between flat platens, its upper half modelled. The change of
the inner diameter measures the friction, without a measured force.
"""

# %%
from bipot import Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Symmetry, VonMises, march, ring

INNER, OUTER, HALF = 3.0, 6.0, 2.0  # mm: radii and half the height


def upper_half(mu: float, reduction: float) -> Scene:
    """The ring above its plane of symmetry, under one platen."""
    return Scene(
        mesh=ring(INNER, OUTER, HALF, 6, 4),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(young=210_000.0, poisson=0.3), Perfect(300.0)),
        supports=(Symmetry("base", 1),),
        tools=(FlatTool((0.0, HALF), (0.0, -1.0), (0.0, -reduction * HALF), ("top", "bore", "side"), mu),),
    )


def main(increments: int = 20, reduction: float = 0.2, friction: tuple[float, ...] = (0.02, 0.3)) -> dict[float, float]:
    """Relative change of the inner radius, at half the height, by friction."""
    changes = {}
    for mu in friction:
        scene = upper_half(mu, reduction)
        middle = min(scene.mesh.boundary_nodes("bore"), key=lambda node: scene.mesh.nodes[node, 1])
        *_, last = march(scene, Schedule(increments, first=0.005))
        changes[mu] = float(last.displacement[middle, 0]) / INNER
        print(f"mu = {mu:.2f}: the bore changes by {100 * changes[mu]:+.2f} % at a reduction of {reduction:.0%}")
    return changes


# %%
if __name__ == "__main__":
    main()
