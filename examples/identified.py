"""
Friction and hardening from a ring test
=======================================

A ring is compressed; its force, and the radius of its bore at half the height, are read at five reductions. Friction
moves the bore and hardening raises the force, so both follow from one test, by least squares with the slopes of the
marches by what is sought. The test itself is a march on a finer mesh, read to a tenth of a kilonewton and a two
hundredth of a millimetre.
"""

# %%
from functools import cache, partial
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

from bipot import Elasticity, FlatTool, Geometry, Scene, Schedule, Swift, Symmetry, VonMises, ring, sensitivities

INNER, OUTER, HALF, OFFSET = 3.0, 6.0, 2.0, 0.002  # mm: radii, half the height; strain at which yield begins
REDUCTIONS = np.array([0.06, 0.12, 0.18, 0.24, 0.3])
READ = np.array([0.1, 0.005])  # kN, mm: to what the instruments read


class Metal(NamedTuple):
    """Coulomb's coefficient on the platens, and Swift's strength (MPa) and exponent."""

    mu: float
    strength: float
    exponent: float


TRUE, GUESS = Metal(0.12, 620.0, 0.21), Metal(0.05, 400.0, 0.1)


def ring_of(elements: int, **metal: float) -> Scene:
    """Half of the ring, above its plane of symmetry, under one platen."""
    hardening = Swift(strength=metal["strength"], offset=OFFSET, exponent=metal["exponent"])
    platen = FlatTool((0.0, HALF), (0.0, -1.0), (0.0, -REDUCTIONS[-1] * HALF), ("top", "bore", "side"), mu=metal["mu"])
    return Scene(
        mesh=ring(INNER, OUTER, HALF, 3 * elements, 2 * elements),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(young=210_000.0, poisson=0.3), hardening),
        supports=(Symmetry("base", 1),),
        tools=(platen,),
    )


def compressed(metal: Metal, elements: int, increments: int) -> tuple[np.ndarray, np.ndarray]:
    """Force (kN) and radius of the bore (mm) at the reductions, (5, 2), and their slopes (5, 2, 3) by the metal."""
    schedule = Schedule(increments, first=0.005, landings=tuple(REDUCTIONS[:-1] / REDUCTIONS[-1]))
    read, slopes = [], []
    for step, by in sensitivities(partial(ring_of, elements), metal._asdict(), schedule):
        if np.isclose(step.state.tau, REDUCTIONS / REDUCTIONS[-1]).any():
            # The innermost node at half the height.
            bore = np.argmin(step.state.nodes[:, 0] + 100 * step.state.nodes[:, 1])
            read.append((-step.tool_forces[0, 1] / 1000, step.state.nodes[bore, 0]))
            slopes.append(np.transpose([(-s.tool_forces[0, 1] / 1000, s.nodes[bore, 0]) for s in by.values()]))
    return np.array(read), np.array(slopes)


def main(elements: int = 3, increments: int = 20) -> tuple[Metal, np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """The metal found, its standard deviations, what was read, and the curves of the first guess and of that metal."""
    read = np.round(compressed(TRUE, 2 * elements, 2 * increments)[0] / READ) * READ
    march_of = cache(lambda *metal: compressed(Metal(*metal), elements, increments))
    found = least_squares(
        lambda p: ((march_of(*p)[0] - read) / READ).ravel(),
        GUESS,
        lambda p: (march_of(*p)[1] / READ[:, None]).reshape(-1, 3),
        x_scale=GUESS,
        bounds=([1e-6, 1.0, 0.0], [1.0, np.inf, 1.0]),
    )
    metal = Metal(*found.x)
    # By the spread of the readings about the fit: what errors of the mesh shift all the same, it does not see.
    spread = np.sqrt(2 * found.cost / (read.size - len(metal)) * np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    for name, value, deviation, true in zip(Metal._fields, metal, spread, TRUE, strict=True):
        print(f"{name}: {value:.4g} with a standard deviation of {deviation:.1g}, in truth {true:g}")
    return metal, spread, read, {"guess": march_of(*GUESS)[0], "found": march_of(*metal)[0]}


def draw(found: tuple[Metal, np.ndarray, np.ndarray, dict[str, np.ndarray]]) -> None:
    """Readings and curves over the reduction."""
    _, _, read, curves = found
    _, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    for k, (ax, what) in enumerate(zip(axes, ("force [kN]", "radius of the bore [mm]"), strict=True)):
        for (name, curve), line in zip(curves.items(), ("--", "-"), strict=True):
            ax.plot(REDUCTIONS, curve[:, k], line, color="C0" if name == "found" else "0.5", label=name)
        ax.plot(REDUCTIONS, read[:, k], "o", color="C1", label="read")
        ax.set(xlabel="reduction of the height", ylabel=what)
    axes[0].legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
