"""
Rolling a strip
===============

The strip enters more slowly than the roll's surface and leaves faster; in between the friction reverses.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp
from bipot import plot

RADIUS, LENGTH, HEIGHT = 100.0, 35.0, 10.0  # mm; the upper half of the strip is modelled
CENTRE, DOWN, ANGLE, PRESSED = (25.0, HEIGHT / 2 + RADIUS), 0.75, 0.15, 0.2

ROLL = bp.ShapedTool(
    bp.Circle(CENTRE, RADIUS),
    travel=(0.0, -DOWN),
    candidates=("top",),
    mu=0.2,
    path=((0.0, 0.0), (PRESSED, 1.0), (1.0, 1.0)),  # into the strip first; then it turns
    turn=bp.Turn(ANGLE, CENTRE, bp.Amplitude(((0.0, 0.0), (PRESSED, 0.0), (1.0, 1.0)))),
)


def strip(elements: int) -> bp.Scene:
    """Square elements, so many through the half height."""
    return bp.Scene(
        mesh=bp.block(LENGTH, HEIGHT / 2, round(2 * LENGTH / HEIGHT) * elements, elements),
        geometry=bp.Geometry.PLANE_STRAIN,
        material=bp.VonMises(bp.Elasticity(young=70_000.0, poisson=0.3), bp.Perfect(140.0)),
        supports=(bp.Symmetry("base", 1),),
        tools=(ROLL,),
    )


def main(increments: int = 160, elements: int = 4) -> tuple[list[tuple[float, float, float, float]], bp.Accepted]:
    """Angle, torque on the roll (N), speeds of the strip's back and front over the roll's; the last increment."""
    scene, rows, steps = strip(elements), [], []
    back, front = (scene.mesh.boundary_nodes(name) for name in ("left", "right"))
    for accepted in bp.march(scene, bp.Schedule(increments, first=0.002, landings=(PRESSED,))):
        steps.append(accepted)
        turned = ROLL.pose(accepted.state.tau)[2] - ROLL.pose(accepted.start.tau)[2]
        if turned == 0.0:
            continue
        speeds = [float(np.mean(accepted.state.du[nodes, 0])) / (RADIUS * turned) for nodes in (back, front)]
        rows.append((float(ROLL.pose(accepted.state.tau)[2]), accepted.tool_moment(0), *speeds))
        print("angle {:.4f}: torque {:7.0f} N, strip over roll {:.3f} before, {:.3f} behind".format(*rows[-1]))
    return rows, steps[-1]


def draw(found: tuple[list[tuple[float, float, float, float]], bp.Accepted]) -> None:
    """The speeds of the strip over the roll's, and the strip, coloured by its equivalent plastic strain."""
    rows, last = found
    angle, _torque, before, behind = np.transpose(rows)
    _, (above, below) = plt.subplots(2, figsize=(8, 6), layout="constrained")
    above.plot(angle, before, label="before the roll")
    above.plot(angle, behind, label="behind it")
    above.set(xlabel="angle of the roll [rad]", ylabel="speed over the roll's", ylim=(0.7, 1.1))
    above.legend()
    plot.body(last, last.peeq.mean(axis=1), below, label="plastic strain", shrink=0.6, lw=0.4)
    around = np.linspace(1.35, 1.65, 50) * np.pi
    below.plot(CENTRE[0] + RADIUS * np.cos(around), CENTRE[1] - DOWN + RADIUS * np.sin(around), color="black")
    below.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", xlim=(0, 55), ylim=(0, 8))


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
