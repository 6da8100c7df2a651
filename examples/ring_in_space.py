"""
The ring compression test in space
==================================

An eighth of a ring 6 : 3 : 2 in space is compared with the same ring on a meridian. Friction decides whether the bore
opens or closes, and both models must find the same bore and force. In space the direction of slip is not prescribed.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

from bipot import Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Symmetry, VonMises, march, ring, ring_3d

INNER, OUTER, HALF, REDUCTION = 3.0, 6.0, 2.0, 0.3  # mm: radii and half the height
MATERIAL = VonMises(Elasticity(young=210_000.0, poisson=0.3), Perfect(300.0))
CANDIDATES = ("top", "bore", "side")


def meridian(mu: float, n: int) -> Scene:
    """The ring above its plane of symmetry, n elements over half of its height."""
    platen = FlatTool((0.0, HALF), (0.0, -1.0), (0.0, -REDUCTION * HALF), CANDIDATES, mu)
    mesh = ring(INNER, OUTER, HALF, 2 * n, n)
    return Scene(mesh, Geometry.AXISYMMETRIC, MATERIAL, (Symmetry("base", 1),), (platen,))


def space(mu: float, n: int) -> Scene:
    """A quarter of it in space, whose straight segments have the area of the circles."""
    platen = FlatTool((0.0, 0.0, HALF), (0.0, 0.0, -1.0), (0.0, 0.0, -REDUCTION * HALF), CANDIDATES, mu)
    mesh = ring_3d(INNER, OUTER, HALF, 3 * n, 2 * n, n, inscribed=False)
    planes = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)
    return Scene(mesh, Geometry.SOLID, MATERIAL, planes, (platen,))


def course(scene: Scene, increments: int) -> np.ndarray:
    """Rows of the reduction, the change of the inner diameter at half the height in %, and the whole ring's force."""
    nodes = scene.mesh.boundary_nodes("bore")
    middle = nodes[scene.mesh.nodes[nodes, -1] == 0.0]
    start, rows = np.linalg.norm(scene.mesh.nodes[middle, :-1], axis=1), [(0.0, 0.0, 0.0)]
    for step in march(scene, Schedule(increments, first=0.005)):
        bore = np.linalg.norm(step.state.nodes[middle, :-1], axis=1)
        rows.append((REDUCTION * step.state.tau, 100 * (bore / start - 1).mean(), -step.tool_force(0)[-1]))
    return np.array(rows)


def main(increments: int = 15, elements: int = 3, friction: tuple[float, ...] = (0.05, 0.2)) -> dict:
    """The courses on the meridian and in space, by friction."""
    found = {}
    for mu in friction:
        found[mu] = tuple(course(made(mu, elements), increments) for made in (meridian, space))
        for name, rows in zip(("meridian", "space"), found[mu], strict=True):
            print(f"mu = {mu:.2f}, {name:8}: inner diameter {rows[-1, 1]:+.2f} %, {rows[-1, 2]:.0f} N")
    return found


def draw(found: dict) -> None:
    """The change of the bore over the reduction: the meridian as lines, space as circles."""
    for mu, (flat, solid) in found.items():
        (line,) = plt.plot(flat[:, 0], flat[:, 1], label=f"mu = {mu}, meridian")
        plt.plot(solid[:, 0], solid[:, 1], "o", mfc="none", color=line.get_color(), label=f"mu = {mu}, space")
    plt.axhline(0, color="0.8", zorder=0)
    plt.xlabel("reduction of the height")
    plt.ylabel("change of the inner diameter [%]")
    plt.legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
