"""
A sphere in perfect plasticity
==============================

The mean pressure tends to about three yield stresses, and material piles up at the rim.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp
from bipot import plot

SIZE, RADIUS, DEPTH, YIELD = 10.0, 5.0, 0.1, 200.0  # mm, MPa


def dented(elements: int) -> bp.Scene:
    """So many elements along the surface and the axis, finer towards the contact."""
    return bp.Scene(
        mesh=bp.cylinder(SIZE, SIZE, elements, elements, grading=(20.0, 0.05)),
        geometry=bp.Geometry.AXISYMMETRIC,
        material=bp.VonMises(bp.Elasticity(young=200_000.0, poisson=0.3), bp.Perfect(YIELD)),
        supports=(bp.Support("base", 0), bp.Support("base", 1), bp.Support("axis", 0)),
        tools=(bp.ShapedTool(bp.Circle((0.0, SIZE + RADIUS), RADIUS), (0.0, -DEPTH), ("top",), mu=0.0),),
    )


def main(increments: int = 20, elements: int = 24) -> tuple[list[tuple[float, float, float]], bp.Accepted]:
    """Depth (mm), mean pressure over the yield stress, the rim's height above the surface (mm); the last increment."""
    scene, rows, steps = dented(elements), [], []
    top = scene.mesh.boundary_nodes("top")
    for accepted in bp.march(scene, bp.Schedule(increments)):
        steps.append(accepted)
        r, z = accepted.state.nodes[top].T
        nodes = accepted.solved.iterate.increment.system.candidates.node
        edge = accepted.state.nodes[nodes[accepted.solved.r[:, 0] > 0], 0].max()
        edge = (edge + r[r > edge].min()) / 2
        pressure = -float(accepted.tool_force(0)[1]) / (np.pi * edge**2)
        rows.append((DEPTH * accepted.state.tau, pressure / YIELD, float(z.max()) - SIZE))
        print("depth {:.3f} mm: a mean pressure of {:.2f} yield stresses, pile-up {:+.4f} mm".format(*rows[-1]))
    return rows, steps[-1]


def draw(found: tuple[list[tuple[float, float, float]], bp.Accepted]) -> None:
    """The mean pressure over the depth, and the dent at the end, coloured by its equivalent plastic strain."""
    rows, last = found
    _, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    depth, pressure, _pile = np.transpose(rows)
    left.plot(depth, pressure, "o-")
    left.set(xlabel="depth [mm]", ylabel="mean pressure / yield stress", ylim=(0, 3.2))
    plot.body(last, last.peeq.mean(axis=1), right, label="plastic strain", lw=0.4)
    right.set(xlabel="r [mm]", ylabel="z [mm]", aspect="equal", xlim=(0, 2.5), ylim=(SIZE - 2, SIZE + 0.2))


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
