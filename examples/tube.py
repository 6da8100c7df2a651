"""
A thick tube under pressure
===========================

In plane strain the displacement follows Lame's solution while the tube is elastic, and exceeds it afterwards.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import bipot as bp

INNER, OUTER, YOUNG, POISSON = 100.0, 200.0, 210_000.0, 0.3  # mm, MPa


def tube(pressure: float, elements: int = 8) -> bp.Scene:
    """A slice of the tube, elements growing outwards; base and top stay plane."""
    return bp.Scene(
        mesh=bp.ring(INNER, OUTER, 10.0, elements, 1, grading=(2.0, 1.0)),
        geometry=bp.Geometry.AXISYMMETRIC,
        material=bp.VonMises(bp.Elasticity(YOUNG, POISSON), bp.Perfect(240.0)),
        supports=(bp.Support("base", 1), bp.Support("top", 1)),
        loads=(bp.Pressure("bore", pressure),),
    )


def elastic(pressure: float) -> float:
    """Lame's displacement (mm) of the outer surface."""
    return 2 * (1 - POISSON**2) * pressure * INNER**2 * OUTER / (YOUNG * (OUTER**2 - INNER**2))


def main(increments: int = 8, pressure: float = 160.0) -> list[tuple[float, float, float]]:
    """Pressure (MPa), displacement of the outer surface (mm) and Lame's, at every increment."""
    rows = []
    scene = tube(pressure)
    outside = scene.mesh.boundary_nodes("side")
    for accepted in bp.march(scene, bp.Schedule(increments)):
        p = pressure * accepted.state.tau
        u = float(accepted.displacement[outside, 0].mean())
        rows.append((p, u, elastic(p)))
        print(f"p = {p:6.1f} MPa: {u:.6f} mm, elastic {elastic(p):.6f} mm")
    return rows


def draw(rows: list[tuple[float, float, float]]) -> None:
    """The displacement over the pressure."""
    p, u, lame = np.transpose(rows)
    plt.plot(u, p, "o-", label="march")
    plt.plot(lame, p, "--", color="0.4", label="Lame")
    plt.xlabel("displacement of the outer surface [mm]")
    plt.ylabel("pressure [MPa]")
    plt.legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
