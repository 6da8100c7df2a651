"""
A sphere in a block
===================

The same indentation in space and on a meridian: a quarter of a round block with two planes of symmetry, and an
axisymmetric body. On these coarse meshes the force rises in steps, whenever further nodes touch.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp

SIZE, RADIUS, DEPTH, MU = 4.0, 5.0, 0.5, 0.2  # mm
LEAD = bp.VonMises(bp.Elasticity(young=20_000.0, poisson=0.4), bp.Linear(20.0, 100.0))


def in_space(elements: int) -> bp.Scene:
    """A quarter with so many elements along its axis, finer towards the top."""
    ball = bp.sphere((0.0, 0.0, SIZE + RADIUS), RADIUS)
    return bp.Scene(
        mesh=bp.cylinder_3d(SIZE, SIZE, elements // 2, elements // 2, elements, grading=(3.0, 0.2)),
        geometry=bp.Geometry.SOLID,
        material=LEAD,
        supports=(bp.Symmetry("left", 0), bp.Symmetry("front", 1), bp.Support("base", 2)),
        tools=(bp.ShapedTool(ball, (0.0, 0.0, -DEPTH), ("top",), MU),),
    )


def on_a_meridian(elements: int) -> bp.Scene:
    """The same as a ring, with elements of about the same size."""
    return bp.Scene(
        mesh=bp.cylinder(SIZE, SIZE, elements, elements, grading=(2.0, 0.2)),
        geometry=bp.Geometry.AXISYMMETRIC,
        material=LEAD,
        supports=(bp.Support("base", 1), bp.Support("axis", 0)),
        tools=(bp.ShapedTool(bp.Circle((0.0, SIZE + RADIUS), RADIUS), (0.0, -DEPTH), ("top",), MU),),
    )


def main(increments: int = 12, elements: int = 8) -> tuple[dict[str, list[tuple[float, float]]], bp.Accepted]:
    """Depth (mm) and force on the whole block (N), in space and on a meridian; the last increment in space."""
    curves, ends = {}, []
    for name, scene in (("in space", in_space(elements)), ("on a meridian", on_a_meridian(elements))):
        steps = list(bp.march(scene, bp.Schedule(increments), bp.Control(bp.Newton())))
        curves[name] = [(DEPTH * step.state.tau, -float(step.tool_force(0)[-1])) for step in steps]
        print(f"{name}: a force of {curves[name][-1][1]:.1f} N at a depth of {DEPTH} mm")
        ends.append(steps[-1])
    return curves, ends[0]


def draw(found: tuple[dict[str, list[tuple[float, float]]], bp.Accepted]) -> None:
    """Both forces over the depth, and the pressure on a quarter of the top, from above, with friction as arrows."""
    curves, last = found
    _, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    for name, rows in curves.items():
        left.plot(*np.transpose(rows), ".-", label=name)
    left.set(xlabel="depth [mm]", ylabel="force [N]")
    left.legend()
    solved = last.solved
    contacts = solved.iterate.increment.system.candidates
    force, (x, y, _) = contacts.vectors(solved.r, solved.iterate.frames), last.state.nodes[contacts.node].T
    pressure = np.nan_to_num(last.traction.recovered_pressure)  # none off the contact
    colours = right.tricontourf(x, y, pressure, levels=12, cmap="viridis")
    right.quiver(x, y, *force[:, :2].T, angles="xy", color="w", scale=10 * np.abs(force[:, :2]).max())
    right.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", xlim=(0, SIZE / 2), ylim=(0, SIZE / 2))
    plt.colorbar(colours, ax=right, label="pressure [MPa]")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
