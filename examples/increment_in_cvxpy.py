"""
An increment as a cvxpy problem
===============================

With the friction threshold s given by its own normal forces, an increment is one convex program of plasticity, contact
and friction: minimise energy + dissipation + s times the slip over the displacements, subject to non-negative gaps. Two
solvers find the same solution, and its multipliers are the contact forces.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp

# An interior-point and a splitting method, each with its own names for a tight tolerance. At 1e-12 Clarabel reaches
# round-off, which it reports as "optimal_inaccurate".
SOLVERS = {
    "CLARABEL": {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11},
    "SCS": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iters": 200_000},
}

BLOCK = bp.Scene(
    mesh=bp.block(20.0, 10.0, 6, 3),
    geometry=bp.Geometry.PLANE_STRAIN,
    material=bp.VonMises(bp.Elasticity(young=70_000.0, poisson=0.33), bp.Linear(sigma_y=100.0, modulus=200.0)),
    supports=(bp.Support("left", 0), bp.Support("base", 1)),
    tools=(bp.FlatTool((0.0, 10.0), (0.0, -1.0), (0.0, -1.0), ("top",), mu=0.2),),
)


def main(increments: int = 10) -> dict[str, tuple[float, float]]:
    """Of each solver the objective, and how far its multipliers are from the forces of the march, over the largest."""
    *_, accepted = bp.march(BLOCK, bp.Schedule(increments, first=0.005))
    normal, tangential = accepted.state.forces.T
    stated = bp.conic_program(accepted, bp.Dissipation()).statement()
    print("minimise over", ", ".join(f"{name} {value.shape}" for name, value in stated.blocks.items()))
    found = {}
    for solver, options in SOLVERS.items():
        stated.problem.solve(solver=solver, **options)
        # The multiplier of "gap >= 0" is the normal force; those of the cone |slip| <= t are s and the friction.
        pushes, rubs = (stated.dual(term)[:, -1] * accepted.units.force for term in ("gap", "friction"))
        # On the symmetry plane nothing can slip: that contact has no friction.
        off = max(np.abs(pushes - normal).max(), np.abs(rubs - tangential[tangential != 0]).max())
        found[solver] = stated.value, float(off / normal.max())
        print("{}: objective {:.9f}, contact forces differ by {:.1e}".format(solver, *found[solver]))
    return found


def draw(found: dict[str, tuple[float, float]]) -> None:
    """How far each solver's multipliers are from the forces of the march."""
    plt.bar(list(found), [off for _, off in found.values()], log=True)
    plt.ylabel("contact forces off by, over the largest")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
