"""
Limit load of a block between rough platens
===========================================

The limit load from the plateau of a march and from limit analysis, compared with the slip-line solution.
"""

# %%
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import bipot as bp
from bipot import plot

WIDTH, HEIGHT, YIELD = 20.0, 10.0, 100.0  # mm, MPa; half of each is modelled
SHEAR, SLIP_LINES = YIELD / np.sqrt(3), 2.42766  # MPa; exact mean pressure over it at WIDTH / HEIGHT = 2


def quarter(elements: int, **platen: Any) -> bp.Scene:
    """The quarter x, y >= 0 under a platen without sliding, in small strain, where the force has a plateau."""
    tool: dict[str, Any] = {"point": (0.0, HEIGHT / 2), "normal": (0.0, -1.0), "candidates": ("top",), "mu": np.inf}
    return bp.Scene(
        mesh=bp.block(WIDTH / 2, HEIGHT / 2, 2 * elements, elements),
        geometry=bp.Geometry.PLANE_STRAIN,
        material=bp.VonMises(bp.Elasticity(young=100_000.0, poisson=0.3), bp.Perfect(YIELD)),
        supports=(bp.Symmetry("left", 0), bp.Symmetry("base", 1)),
        tools=(bp.FlatTool(**(tool | platen)),),
        quadrature=bp.Quadrature.GAUSS2,
        configuration=bp.Configuration.SMALL,
    )


def main(elements: int = 8, increments: int = 20) -> tuple[float, bp.LimitLoad, bp.Scene]:
    """Mean pressure over the shear yield stress at the end of a march; the limit analysis and its scene."""
    *_, last = bp.march(quarter(elements, travel=(0.0, -0.05)), bp.Schedule(increments))
    plateau = -float(last.tool_force(0)[1]) / (WIDTH * SHEAR)
    pressed = quarter(elements, travel=(0.0, 0.0), driven_by=bp.Force((0.0, -WIDTH * SHEAR)))
    found = bp.limit_load(pressed)
    print(f"p/k = {plateau:.4f} at the end of the march, {found.multiple:.4f} by limit analysis, {SLIP_LINES} exactly")
    bulge = float(found.motion[:, 0].max() / -found.motion[:, 1].min())
    print(f"of its mechanism: the side moves outwards {bulge:.3f} times as fast as the platen comes down")
    return plateau, found, pressed


def draw(found: tuple[float, bp.LimitLoad, bp.Scene]) -> None:
    """The mechanism: the nodes' velocities where the platen comes down at one."""
    _, limit, scene = found
    mesh = scene.mesh
    plot.mesh(mesh.nodes, mesh.elements)
    plot.vectors(mesh.nodes, limit.motion / -limit.motion[:, 1].min(), length=0.6)
    plt.title(f"p/k = {limit.multiple:.4f}")
    plt.gca().set(aspect="equal", xlim=(-0.5, 12.5), xlabel="x [mm]", ylabel="y [mm]")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
