"""
Hardening from a CSV file
=========================

Without friction the true stress of an upset cylinder is the flow curve that was read from the file.
"""

# %%
import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from bipot import Schedule, Tabulated, march, upsetting

TABLE = Path(__file__).with_name("hardening.csv")


def main(increments: int = 20, table: Path = TABLE, reduction: float = 0.2) -> list[tuple[float, float, float]]:
    """Equivalent plastic strain, true stress (MPa) from force and area, and the table's, at every increment."""
    hardening, rows = Tabulated.from_csv(table), []
    for accepted in march(
        upsetting(mu=0.0, hardening=hardening, elements=2, reduction=reduction), Schedule(increments)
    ):
        strain = float(accepted.peeq.mean())
        area = math.pi * float(accepted.state.nodes[:, 0].max()) ** 2
        stress = -float(accepted.tool_forces[0, 1]) / area
        rows.append((strain, stress, float(hardening.yield_stress(np.array(strain)))))
        print("strain {:.4f}: stress {:.2f} MPa, table {:.2f} MPa".format(*rows[-1]))
    return rows


def draw(rows: list[tuple[float, float, float]], table: Path = TABLE) -> None:
    """The stress found, on the table's own points."""
    strain, stress, _ = np.transpose(rows)
    points = Tabulated.from_csv(table)
    plt.plot(points.peeq, points.stress, "s-", color="0.6", label="table")
    plt.plot(strain, stress, "o", label="force over area")
    plt.xlim(0, 0.25)
    plt.xlabel("equivalent plastic strain")
    plt.ylabel("true stress [MPa]")
    plt.legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
