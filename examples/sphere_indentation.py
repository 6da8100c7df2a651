"""
A sphere in perfect plasticity
==============================

The mean pressure tends to three yield stresses, and the rim piles up.
"""

# %%
from math import pi

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from bipot import (
    Accepted,
    Circle,
    Elasticity,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    VonMises,
    cylinder,
    march,
)

SIZE, RADIUS, DEPTH, YIELD = 10.0, 5.0, 0.1, 200.0  # mm, MPa


def dented(elements: int) -> Scene:
    """So many elements along the surface and the axis, finer towards the contact."""
    return Scene(
        mesh=cylinder(SIZE, SIZE, elements, elements, grading=(20.0, 0.05)),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(young=200_000.0, poisson=0.3), Perfect(YIELD)),
        supports=(Support("base", 0), Support("base", 1), Support("axis", 0)),
        tools=(ShapedTool(Circle((0.0, SIZE + RADIUS), RADIUS), (0.0, -DEPTH), ("top",), mu=0.0),),
    )


def main(increments: int = 20, elements: int = 24) -> tuple[list[tuple[float, float, float]], Accepted]:
    """Depth (mm), mean pressure over the yield stress, the rim's height above the surface (mm); the last increment."""
    scene, rows, steps = dented(elements), [], []
    top = scene.mesh.boundary_nodes("top")
    for accepted in march(scene, Schedule(increments)):
        steps.append(accepted)
        r, z = accepted.state.nodes[top].T
        nodes = accepted.solved.iterate.increment.system.candidates.node
        edge = accepted.state.nodes[nodes[accepted.solved.r[:, 0] > 0], 0].max()
        edge = (edge + r[r > edge].min()) / 2
        pressure = -float(accepted.tool_force(0)[1]) / (pi * edge**2)
        rows.append((DEPTH * accepted.state.tau, pressure / YIELD, float(z.max()) - SIZE))
        print("depth {:.3f} mm: a mean pressure of {:.2f} yield stresses, pile-up {:+.4f} mm".format(*rows[-1]))
    return rows, steps[-1]


def draw(found: tuple[list[tuple[float, float, float]], Accepted]) -> None:
    """The mean pressure over the depth, and the dent at the end, coloured by its equivalent plastic strain."""
    rows, last = found
    _, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    depth, pressure, _pile = np.transpose(rows)
    left.plot(depth, pressure, "o-")
    left.set(xlabel="depth [mm]", ylabel="mean pressure / yield stress", ylim=(0, 3.2))
    body = list(last.state.nodes[last.scene.mesh.elements])
    patches = right.add_collection(PolyCollection(body, array=last.peeq.mean(axis=1), edgecolor="0.6", lw=0.4))
    right.set(xlabel="r [mm]", ylabel="z [mm]", aspect="equal", xlim=(0, 2.5), ylim=(SIZE - 2, SIZE + 0.2))
    plt.colorbar(patches, ax=right, label="plastic strain")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
