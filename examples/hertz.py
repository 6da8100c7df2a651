"""
Hertz: a sphere on an elastic block
===================================

The force of a rigid sphere on an elastic block and the contact radius, compared with Hertz's closed forms for a
half-space.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp

SIZE, RADIUS, DEPTH = 100.0, 100.0, 0.01  # mm: the contact is one hundredth of the block
STEEL, STIFFNESS = bp.Elasticity(young=210_000.0, poisson=0.3), 210_000.0 / (1 - 0.3**2)


def half_space(elements: int) -> bp.Scene:
    """So many elements along the surface and the axis, finer towards the contact."""
    return bp.Scene(
        mesh=bp.cylinder(SIZE, SIZE, elements, elements, grading=(1000.0, 1e-3), element=bp.Element.Q8),
        geometry=bp.Geometry.AXISYMMETRIC,
        material=bp.Elastic(STEEL),
        supports=(bp.Support("base", 0), bp.Support("base", 1), bp.Support("axis", 0)),
        tools=(bp.ShapedTool(bp.Circle((0.0, SIZE + RADIUS), RADIUS), (0.0, -DEPTH), ("top",), mu=0.0),),
        configuration=bp.Configuration.SMALL,
    )


def main(increments: int = 5, elements: int = 40) -> list[tuple[float, float, float, float]]:
    """Force (N) and radius of the contact (mm), each with Hertz's."""
    rows = []
    for accepted in bp.march(half_space(elements), bp.Schedule(increments)):
        depth, force = DEPTH * accepted.state.tau, -float(accepted.tool_force(0)[1])
        x = accepted.state.nodes[accepted.solved.iterate.increment.system.candidates.node, 0]
        touching = np.sort(x[accepted.solved.r[:, 0] > 0])
        edge = (touching[-1] + x[x > touching[-1]].min()) / 2
        rows.append((force, 4 / 3 * STIFFNESS * np.sqrt(RADIUS * depth**3), edge, np.sqrt(RADIUS * depth)))
        print("F = {:8.2f} N, Hertz {:8.2f} N; a = {:.3f} mm, Hertz {:.3f} mm".format(*rows[-1]))
    return rows


def draw(rows: list[tuple[float, float, float, float]]) -> None:
    """Forces and radii over the depth, with Hertz's."""
    force, expected, radius, known = np.transpose(rows)
    depth = 1000 * DEPTH * np.arange(1, len(rows) + 1) / len(rows)
    _, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    for ax, marched, hertz in ((left, force, expected), (right, radius, known)):
        ax.plot(depth, marched, "o", label="march")
        ax.plot(depth, hertz, "--", color="0.4", label="Hertz")
        ax.set(
            xlabel="depth [µm]", ylabel="force [N]" if ax is left else "radius of the contact [mm], between two nodes"
        )
        ax.legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
