"""
Twisting a pressed disc
=======================

A plane presses an elastic disc and then turns about its own normal. Slip begins at the rim and spreads inwards;
friction acts around the axis, and its moment tends to two thirds of mu N R.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp

RADIUS, HEIGHT, SINK, ANGLE, MU, PRESSED = 10.0, 5.0, 0.05, 0.01, 0.2, 0.1  # mm, radians


def twisted(elements: int) -> bp.Scene:
    """The whole disc, held below, with 4 * elements around its axis in a quarter."""
    top, later = (0.0, 0.0, HEIGHT), ((0.0, 0.0), (PRESSED, 0.0), (1.0, 1.0))
    lid = bp.ShapedTool(
        bp.Plane(top, (0.0, 0.0, -1.0)),
        travel=(0.0, 0.0, -SINK),
        candidates=("top",),
        mu=MU,
        path=((0.0, 0.0), (PRESSED, 1.0), (1.0, 1.0)),
        turn=bp.Turn(ANGLE, top, bp.Amplitude(later), axis=(0.0, 0.0, 1.0)),
    )
    return bp.Scene(
        mesh=bp.cylinder_3d(RADIUS, HEIGHT, elements, elements, 2, quarter=False),
        geometry=bp.Geometry.SOLID,
        material=bp.Elastic(bp.Elasticity(young=1000.0, poisson=0.0)),
        supports=tuple(bp.Support("base", d) for d in range(3)),
        tools=(lid,),
    )


def main(increments: int = 40, elements: int = 4) -> tuple[list[tuple[float, float]], bp.Accepted]:
    """Angle (radians), moment over mu N R; the last increment."""
    scene, rows, steps = twisted(elements), [], []
    for accepted in bp.march(scene, bp.Schedule(increments), bp.Control(bp.Newton())):
        steps.append(accepted)
        angle = scene.tools[0].pose(accepted.state.tau)[-1]
        rows.append((float(angle), accepted.tool_moment(0) / (MU * -float(accepted.tool_force(0)[2]) * RADIUS)))
        print("turned by {:.5f}: a moment of {:.4f} mu N R".format(*rows[-1]))
    return rows, steps[-1]


def draw(found: tuple[list[tuple[float, float]], bp.Accepted]) -> None:
    """The moment over the angle, and friction on the disc at the end, from above."""
    rows, last = found
    _, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    left.plot(*np.transpose(rows), "o-", ms=3)
    left.axhline(2 / 3, ls="--", color="0.4", label="all slips: 2/3")
    left.set(xlabel="angle [radians]", ylabel="moment / (mu N R)")
    left.legend()
    solved = last.solved
    contacts = solved.iterate.increment.system.candidates
    force, at = contacts.vectors(solved.r, solved.iterate.frames), last.state.nodes[contacts.node]
    right.quiver(*at[:, :2].T, *force[:, :2].T, force[:, 2], angles="xy", width=4e-3)
    right.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
