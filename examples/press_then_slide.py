"""
Press, then slide
=================

With a path of two components a tool presses a plate and then slides along it; friction over the normal force is mu.
"""

# %%
import matplotlib.pyplot as plt

from bipot import Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Support, VonMises, block, march

MU = 0.2

SLIDER = FlatTool(
    point=(0.0, 1.0),
    normal=(0.0, -1.0),
    travel=(0.1, -0.002),
    candidates=("top",),
    mu=MU,
    path=((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0))),  # first down, then to the right
)

PLATE = Scene(
    mesh=block(3.0, 1.0, 6, 2),
    geometry=Geometry.PLANE_STRAIN,
    material=VonMises(Elasticity(young=210_000.0, poisson=0.3), Perfect(300.0)),
    supports=(Support("base", 0), Support("base", 1)),
    tools=(SLIDER,),
)


def main(increments: int = 10) -> list[tuple[float, float]]:
    """Pseudo-time and friction force over normal force, at every increment."""
    rows = []
    for accepted in march(PLATE, Schedule(increments, landings=(0.5,))):
        along, normal = accepted.tool_forces[0]
        rows.append((accepted.state.tau, float(along / -normal)))
        print(f"tau = {accepted.state.tau:.2f}: normal force {-normal:8.3f}, friction over it {along / -normal:.12f}")
    return rows


def draw(rows: list[tuple[float, float]]) -> None:
    """Friction over normal force, over pseudo-time."""
    plt.plot(*zip(*rows, strict=True), "o-")
    plt.axhline(MU, color="0.4", ls="--", label=f"mu = {MU}")
    plt.xlabel("pseudo-time: pressed until 0.5, then slid")
    plt.ylabel("friction over normal force")
    plt.legend()


# %%
if __name__ == "__main__":
    draw(main())
    plt.show()
