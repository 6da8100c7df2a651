"""Rolling: a roll that turns takes a strip through, thinner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot import (
    Accepted,
    Amplitude,
    Circle,
    Elasticity,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    ShapedTool,
    Symmetry,
    Turn,
    VonMises,
    block,
)
from studies.verification.case import Asked, Case, Sense, Subject, Watch

RADIUS, HALF, DRAFT, MU = 10.0, 0.5, 0.075, 0.2
"""Of the roll; half the strip's height, and how far the roll goes into it."""

LENGTH, BITTEN = 4.0, 3.0
"""Of the strip, and from its back to the roll's middle."""

ANGLE, PRESSED = 0.2, 0.15
"""Radians that it turns, from this pseudo-time on."""

STEADY = (0.4, 0.85)
"""Pseudo-times between which all is measured: the roll has left its dent, and the strip's back is far."""


def rolled(n: int) -> Scene:
    """The upper half of the strip, n square elements high, under the roll."""
    centre = (BITTEN, HALF + RADIUS)
    roll = ShapedTool(
        Circle(centre, RADIUS),
        (0.0, -DRAFT),
        ("top",),
        MU,
        path=((0.0, 0.0), (PRESSED, 1.0), (1.0, 1.0)),
        turn=Turn(ANGLE, centre, Amplitude(((0.0, 0.0), (PRESSED, 0.0), (1.0, 1.0)))),
    )
    return Scene(
        mesh=block(LENGTH, HALF, round(LENGTH / HALF) * n, n),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(500.0, 0.3), Perfect(1.0)),
        supports=(Symmetry("base", 1),),
        tools=(roll,),
    )


@dataclass(frozen=True)
class Bite:
    """What an increment shows: angles, torque, energy taken up by half the strip, friction, ways of both its ends."""

    angle: float
    torque: float
    taken: float
    entering: float
    leaving: float
    neutral: float
    turned: float
    gone: float
    come: float

    @classmethod
    def of(cls, scene: Scene, accepted: Accepted) -> Bite:
        """Friction over mu times pressure on the first and last third of the arc, along the strip's way."""
        (roll,), r = scene.tools, accepted.solved.r
        nodes = accepted.solved.iterate.increment.system.candidates.node
        order = np.argsort(accepted.state.nodes[nodes, 0])
        order = order[r[order, 0] > 0]
        x, pushed, along = accepted.state.nodes[nodes[order], 0], r[order, 0], -r[order, 1]
        part = (x - x[0]) / (x[-1] - x[0])
        rubs = [float(along[third].sum() / (MU * pushed[third].sum())) for third in (part < 1 / 3, part > 2 / 3)]
        # Until there the roll has pulled as much as it does: from there on it holds back.
        last = int(np.argmax(np.cumsum(along)))
        energies, angle = accepted.energies, roll.pose(accepted.state.tau)[2]
        return cls(
            angle=float(angle),
            torque=accepted.tool_moment(0),
            taken=(energies.elastic + energies.plastic + energies.friction) / scene.images,
            entering=rubs[0],
            leaving=rubs[1],
            neutral=float((x[last : last + 2].mean() - x[0]) / (x[-1] - x[0])),
            turned=float(angle - roll.pose(accepted.start.tau)[2]),
            gone=float(accepted.state.du[scene.mesh.boundary_nodes("right"), 0].mean()),
            come=float(accepted.state.du[scene.mesh.boundary_nodes("left"), 0].mean()),
        )


def left_height(scene: Scene, accepted: Accepted) -> float:
    """Half the strip's height behind the roll, from a tenth to one of it on."""
    x, y = accepted.state.nodes[scene.mesh.boundary_nodes("top")].T
    return float(y[(x > BITTEN + HALF / 5) & (x < BITTEN + 2 * HALF)].mean())


def finer(n: int, watch: Watch) -> list[float]:
    """The march that forms are compared on."""
    for _ in watch.march(rolled(n), Schedule(60 * n, first=0.002, landings=(PRESSED, *STEADY))):
        pass
    return []


def run(n: int, watch: Watch) -> list[float]:
    """Energy twice, friction at both ends of the arc, neutral point, exit speed, what leaves of what comes in."""
    scene, bites, height, missing = rolled(n), list[Bite](), 0.0, 0.0
    for accepted in watch.march(scene, Schedule(40 * n, first=0.002, landings=(PRESSED, *STEADY))):
        missing = accepted.energies.energy_error
        if STEADY[0] <= accepted.state.tau <= STEADY[1]:
            bites.append(Bite.of(scene, accepted))
            height = left_height(scene, accepted)
    angle, torque, taken = np.array([(bite.angle, bite.torque, bite.taken) for bite in bites]).T
    gone, come = sum(bite.gone for bite in bites), sum(bite.come for bite in bites)
    return [
        missing,
        float(np.trapezoid(torque, angle) / (taken[-1] - taken[0])),
        float(np.mean([bite.entering for bite in bites])),
        float(np.mean([bite.leaving for bite in bites])),
        min(bite.neutral for bite in bites),
        max(bite.neutral for bite in bites),
        gone / (RADIUS * sum(bite.turned for bite in bites)),
        gone * height / (come * HALF),
    ]


CASE = Case(
    name="strip_rolling",
    subject=Subject.TOOLS,
    source="derived: energy balance, Coulomb slip on both sides of a neutral point, conservation of volume",
    purpose=(
        "A roll that turns with friction: the strip enters more slowly than the roll and leaves faster; speeds, "
        "torque and energy."
    ),
    setup=(
        "A strip of height one, E = 500 sigma_Y, nu = 0.3, perfect plasticity, plane strain, its upper half in n "
        "layers of Q4 with the mean of their volume change. A roll, R = 10, mu = 0.2, is pressed in by 0.075 (15 %),"
        " then turns by 0.2 in 40 n increments. The energy error is that of the whole march. All other values are "
        "those of the steady part, in which the roll's surface moves by 1.06 heights: the integral of the torque "
        "over the angle, over what half the strip stores and dissipates; friction over mu times pressure, along the "
        "strip, on the first and last third of the arc, which is 1 and -1 where all of it slips; the neutral point "
        "between them, from entry (0) to exit (1); the exit speed over the roll's; height times speed at the exit "
        "over that at the entry. Other forms are run in 60 n increments: as the roll begins to turn the flow stops "
        "nearly everywhere, and in longer increments a form that finds no solution with the flow carried on uses "
        "backward Euler where another form does not."
    ),
    asked=(
        Asked("energy error", 0.0, 0.005),
        Asked("torque times angle over energy", 1.0, 0.005),
        Asked("friction on the first third", 0.95, 0.0, Sense.AT_LEAST),
        Asked("friction on the last third", -0.95, 0.0, Sense.AT_MOST),
        Asked("neutral point, after the entry", 0.0, 0.0, Sense.AT_LEAST),
        Asked("neutral point, before the exit", 1.0, 0.0, Sense.AT_MOST),
        Asked("exit speed over the roll's", 1.0, 0.0, Sense.AT_LEAST),
        Asked("volume out over volume in", 1.0, 0.005),
    ),
    counted="elements through half the height",
    meshes=(3, 6, 12),
    run=run,
    beside=finer,
)
