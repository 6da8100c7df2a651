"""
Drawing a bar through a cone
============================

Friction on the die is m times the shear yield stress of the bar. The drawing stress lies between the homogeneous work
ln(1/(1 - r)) and Avitzur's upper bound for a spherical velocity field.
"""

# %%
from math import inf, log, pi, radians, sqrt, tan

import matplotlib.pyplot as plt
import numpy as np

import bipot as bp

ANGLE, REDUCTION, BOUND = radians(15.0), 0.3, {0.0: 0.56059, 0.1: 0.63744, 0.2: 0.71429}
YIELD, YOUNG, BACK, AHEAD, TRAVEL = 300.0, 3e5, 0.8, 0.6, 0.4  # MPa, mm; the bar has a radius of one
CONE, THIN = (1 - sqrt(1 - REDUCTION)) / tan(ANGLE), sqrt(1 - REDUCTION)
DIE = bp.Profile(((1 + tan(ANGLE), -1.0), (THIN, CONE), (THIN + 0.5, CONE + 3.0)), fillets=0.05)


def bar(elements: int) -> bp.Mesh:
    """The bar's meridian, cone and thin end included."""
    length = BACK + CONE + AHEAD
    even = bp.cylinder(1.0, length, elements, round(elements * length))
    r, z = even.nodes[:, 0], even.nodes[:, 1] - BACK
    return bp.Mesh(np.column_stack([r * np.clip(1 - tan(ANGLE) * z, THIN, 1.0), z]), even.elements, even.boundaries)


def main(increments: int = 60, elements: int = 8, shear: tuple[float, ...] = tuple(BOUND)) -> dict[float, float]:
    """Mean drawing stress over the yield stress, in the second half of the way, by the shear factor m."""
    found = {}
    for m in shear:
        scene = bp.Scene(
            mesh=bar(elements),
            geometry=bp.Geometry.AXISYMMETRIC,
            material=bp.VonMises(bp.Elasticity(YOUNG, 0.3), bp.Perfect(YIELD)),
            supports=(bp.Support("axis", 0), bp.Prescribed("top", 1, TRAVEL)),
            tools=(bp.ShapedTool(DIE, (0.0, 0.0), ("side",), mu=inf if m else 0.0, shear=m or inf),),
        )
        forces = [-float(step.tool_force(0)[1]) for step in bp.march(scene, bp.Schedule(increments))]
        found[m] = float(np.mean(forces[increments // 2 :])) / (pi * THIN**2 * YIELD)
        print(f"m = {m:.1f}: {log(1 / (1 - REDUCTION)):.4f} < {found[m]:.4f} sigma_Y < {BOUND[m]:.4f}")
    return found


def draw(found: dict[float, float]) -> None:
    """The drawing stress over the shear factor, between its bounds."""
    plt.plot(list(found), list(found.values()), "o-", label="march")
    plt.plot(list(BOUND), list(BOUND.values()), "--", color="0.4", label="Avitzur's upper bound")
    plt.axhline(log(1 / (1 - REDUCTION)), color="0.6", ls=":", label="homogeneous work")
    plt.gca().set(xlabel="shear factor m", ylabel="drawing stress / yield stress")
    plt.legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
