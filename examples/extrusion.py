"""
Extrusion through a wedge die
=============================

Container and die are one profile; the punch is flat. At this reduction the pressure is known from Hill's slip-line
field: p/2k = 2 sin a (1 + a)/(1 + 2 sin a).
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp
from bipot import plot

ANGLE = np.pi / 6
BACK, LENGTH, YIELD, YOUNG = 1.5, 3.0, 300.0, 3e5  # mm below the entry, and in all (half-height one); MPa
EXIT = 1 / (1 + 2 * np.sin(ANGLE))
CONE, KNOWN = (1 - EXIT) / np.tan(ANGLE), (1 - EXIT) * (1 + ANGLE)
DIE = bp.Profile(((1.0, -4.0), (1.0, 0.0), (EXIT, CONE), (EXIT + 0.5, CONE + 3.0)), fillets=0.05)


def billet(elements: int) -> bp.Mesh:
    """Half of the billet, which fills the die at rest, a hair inside it."""
    even = bp.block(1.0, LENGTH, elements, 3 * elements)
    x, y = even.nodes[:, 0], even.nodes[:, 1] - BACK
    width = np.ones_like(y)
    for _ in range(60):  # the gap to the die is at most the way across to it
        width -= np.maximum(-DIE.distance(np.column_stack([width, y])).gap, 0.0)
    return bp.Mesh(np.column_stack([x * np.where(y > CONE, EXIT, width), y]), even.elements, even.boundaries)


def main(increments: int = 60, elements: int = 10, travel: float = 0.4) -> tuple[np.ndarray, bp.Accepted]:
    """p/2k by the punch and by the dies (k, 2) at every increment, and the last one."""
    scene = bp.Scene(
        mesh=billet(elements),
        geometry=bp.Geometry.PLANE_STRAIN,
        material=bp.VonMises(bp.Elasticity(YOUNG, 0.3), bp.Perfect(YIELD)),
        supports=(bp.Symmetry("left", 0),),
        tools=(
            bp.FlatTool((0.0, -BACK), (0.0, 1.0), (0.0, travel), ("base",), 0.0),
            bp.ShapedTool(DIE, (0.0, 0.0), ("right",), 0.0),
        ),
    )
    unit, rows, steps = 2 * YIELD / np.sqrt(3), [], []
    for accepted in bp.march(scene, bp.Schedule(increments)):
        steps.append(accepted)
        punch, die = (float(accepted.tool_force(k)[1]) for k in range(2))
        rows.append((punch / 2 / unit, -die / unit))  # the punch presses on both halves, the die on one
        print(f"punch at {accepted.state.tau * travel:.3f} mm: p/2k = {rows[-1][0]:.4f}, by the dies {rows[-1][1]:.4f}")
    print(f"mean of the second half {np.mean(rows[len(rows) // 2 :]):.4f}, known {KNOWN:.4f}")
    return np.array(rows), steps[-1]


def draw(found: tuple[np.ndarray, bp.Accepted]) -> None:
    """The pressure over the increments, and the half of the billet, coloured by its equivalent plastic strain."""
    rows, last = found
    _, (left, right) = plt.subplots(1, 2, figsize=(9, 5), layout="constrained")
    left.plot(rows, label=["punch", "dies"])
    left.axhline(KNOWN, color="0.4", ls="--", label="Hill")
    left.set(xlabel="increment", ylabel="p/2k", ylim=(0, 1))
    left.legend()
    plot.body(last, last.peeq.mean(axis=1), right, label="plastic strain", lw=0.2)
    right.plot(*np.transpose(DIE.points[1:]), color="black")
    right.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", xlim=(0, 1.3), ylim=(-BACK, 2.3))


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
