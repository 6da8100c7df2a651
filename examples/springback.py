"""
Unloading and springback
========================

A cylinder is upset and unloaded: the body loses only its elastic strain.
"""

# %%
import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from bipot import Schedule, march, upsetting

BACK = ((0.0, 0.0), (0.5, 1.0), (1.0, 0.9))
"""The punch moves down in the first half and retracts by a tenth of its travel in the second."""


def main(increments: int = 10, mu: float = 0.0, reduction: float = 0.1) -> tuple[float, float, float, np.ndarray]:
    """Half the height (mm) under load, unloaded, and predicted by sigma_Y / E; heights and forces (n, 2)."""
    scene = upsetting(mu=mu, reduction=reduction, elements=4)
    scene = replace(scene, tools=(replace(scene.tools[0], path=BACK),))
    loaded, height, curve = 0.0, 0.0, []
    for accepted in march(scene, Schedule(increments, first=0.005, landings=(0.5,))):
        height = float(accepted.state.nodes[:, 1].max())
        loaded = height if accepted.state.tau == 0.5 else loaded
        force = -float(accepted.tool_forces[0, 1])
        curve.append((height, force))
        print(f"tau = {accepted.state.tau:.3f}: force {force:9.2f} N, half the height {height:.6f} mm")
    expected = loaded * math.exp(300.0 / 210_000.0)
    print(f"springback {height - loaded:.6f} mm, of a uniaxial bar {expected - loaded:.6f} mm")
    return loaded, height, expected, np.array(curve)


def draw(found: tuple[float, float, float, np.ndarray]) -> None:
    """The force over the height, down and back."""
    height, force = found[-1].T
    plt.plot(height, force / 1000, "o-")
    plt.gca().invert_xaxis()
    plt.xlabel("half the height [mm]")
    plt.ylabel("force [kN]")


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
