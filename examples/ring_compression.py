"""
The ring compression test
=========================

Friction is a constant shear of m times the shear yield stress. The bore of a ring 6 : 3 : 2 opens if m is low and
closes if it is high, so its change measures m without measuring a force. The pressure is compared with Avitzur's upper
bound (parallel velocity field).
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

from bipot import Accepted, Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Symmetry, VonMises, march, ring

INNER, OUTER, HALF, YIELD, YOUNG = 3.0, 6.0, 2.0, 300.0, 3e6  # mm: radii, half the height; MPa: next to rigid
REDUCTIONS = (0.1, 0.3, 0.5)
BOUND = {  # decrease of the inner diameter in %, mean pressure over the yield stress, at these reductions
    0.1: ((-3.32, 1.072), (-10.00, 1.098), (-13.64, 1.146)),
    0.3: ((0.53, 1.173), (3.98, 1.230), (14.92, 1.355)),
    1.0: ((3.89, 1.411), (16.46, 1.595), (44.66, 2.062)),
}


def upper_half(m: float, elements: int) -> Scene:
    """The ring above its plane of symmetry, under one platen."""
    travel = (0.0, -REDUCTIONS[-1] * HALF)
    platen = FlatTool((0.0, HALF), (0.0, -1.0), travel, ("top", "bore", "side"), mu=np.inf, shear=m)
    return Scene(
        mesh=ring(INNER, OUTER, HALF, 3 * elements, 2 * elements),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(YOUNG, 0.3), Perfect(YIELD)),
        supports=(Symmetry("base", 1),),
        tools=(platen,),
    )


def measured(scene: Scene, accepted: Accepted) -> tuple[float, float, float]:
    """Decrease of the bore in %, at half the height and in the mean over it, and F h / (V sigma_Y)."""
    r, z = accepted.state.nodes[scene.mesh.boundary("bore")[:, [0, -1]]].T
    radius = np.array([r[z == 0.0][0], np.abs(np.diff(z, axis=0)[0]) @ r.mean(axis=0) / np.ptp(z)])
    height = 2 * (HALF + accepted.state.tau * scene.tools[0].travel[1])
    pressure = -accepted.tool_force(0)[1] * height / (np.pi * (OUTER**2 - INNER**2) * 2 * HALF * YIELD)
    return (*(100 * (1 - radius / INNER)), pressure)


def main(increments: int = 50, elements: int = 4, shear: tuple[float, ...] = tuple(BOUND)) -> dict[float, np.ndarray]:
    """What is :func:`measured` at each reduction, by the shear factor m."""
    times = [reduction / REDUCTIONS[-1] for reduction in REDUCTIONS]
    found = {}
    for m in shear:
        scene = upper_half(m, elements)
        steps = march(scene, Schedule(increments, first=0.002, landings=tuple(times[:-1])))
        found[m] = np.array([measured(scene, step) for step in steps if step.state.tau in times])
        for reduction, (bore, mean, p), bound in zip(REDUCTIONS, found[m], BOUND.get(m, ("",) * 3), strict=True):
            print(f"m = {m:.2f}, {reduction:.0%}: {bore:+.2f} %, mean {mean:+.2f} %, p = {p:.3f} sigma_Y, {bound}")
    return found


def draw(found: dict[float, np.ndarray]) -> None:
    """The decrease of the bore over the reduction, beside the bound's field (dashed)."""
    for m, rows in found.items():
        (line,) = plt.plot([0, *REDUCTIONS], [0, *rows[:, 0]], "o-", label=f"m = {m}")
        bound = [bore for bore, _ in BOUND.get(m, ())]
        plt.plot([0, *REDUCTIONS][: 1 + len(bound)], [0, *bound], "--", color=line.get_color())
    plt.axhline(0, color="0.8", zorder=0)
    plt.gca().set(xlabel="reduction of the height", ylabel="decrease of the inner diameter [%]")
    plt.legend(title="dashed: Avitzur's field")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
