r"""The paper's upsetting as the mesh is refined, with every element, and what it tends to.

    python -m studies.accuracy.mesh [--fast] [--resume | --overwrite] [--jobs N] [--out DIR]

The seed's cylinder at mu = 0, 0.1 and 0.3, in equal increments after the start-up, 5 to 40 elements a side for a
quadratic element and twice as many for a linear one, between lines or fanned out
(:class:`~bipot.meshes.layout.Layout`), with contact at nodes or in weighted means
(:class:`~bipot.tools.tool.Sampling`). ``DIR/mesh.csv`` has a row at 10, 20, 30, 40 and 45 % of each run that comes so
far (one that does not stops where an element would fold), ``DIR/mesh.h5`` the tractions along the punch at each and the
course of the force until then, ``DIR/limits.csv`` what the runs tend to (:mod:`studies.accuracy.limits`), and
``DIR/scatter.csv`` how far the force jumps as nodes land (:mod:`studies.accuracy.scatter`).

``line`` and ``corner`` are the alternating part of the nodal pressure of the consistent mass over its mean, as in
:mod:`studies.corner`; ``p_min_MPa`` and ``p_max_MPa`` are of the recovered pressure that results hold and figures show,
over nodes that carry. ``passes``, ``cuts``, ``fallbacks`` and ``seconds`` are of the run up to the row.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bipot.contact.closeness import carries
from bipot.contact.overlap import overlap
from bipot.control.accepted import Accepted
from bipot.errors import IncrementFailed
from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, Schedule, march, system_of
from bipot.scene.scene import Scene
from bipot.system import System
from bipot.typing import Floats, Ints
from studies import corner
from studies.accuracy.limits import extrapolated
from studies.accuracy.plan import FAST, Job, Plan
from studies.accuracy.row import Discretisation, Row
from studies.accuracy.scatter import scatters
from studies.accuracy.smooth import AT, QUANTITIES
from studies.command import command, progressing, say
from studies.outputs import opened, parser_of
from studies.pool import completed
from studies.tables import text, write_csv
from studies.upsetting_march import FIRST

NAME, REDUCTION = "mesh", 0.45
CUTS = 3
"""Few: no run that comes to its end has taken one, and a fold is not come round."""

COURSE = (AT, *QUANTITIES, "landed")
"""Reduction, what has a limit, and carrying nodes of the side after each increment."""

MARKS = (0.10, 0.20, 0.30, 0.40, 0.45)
SHOWN = (
    "mu",
    "element",
    "layout",
    "sampling",
    "elements",
    "reduction",
    "force_N",
    "contact_radius_mm",
    "line",
    "p_min_MPa",
    "seconds",
)
Key = tuple[float, Discretisation, int, float]


def key(row: Row) -> Key:
    """What tells one row from another."""
    return row.mu, row.of, row.elements, row.reduction


def named(mu: float, of: Discretisation, elements: int, reduction: float) -> str:
    """The curves of a row in mesh.h5."""
    return f"mu{mu:g} {of} {elements} {reduction:g}"


def name(row: Row) -> str:
    """Those of this one."""
    return named(*key(row))


def profile(system: System, accepted: Accepted) -> dict[str, Floats]:
    """Radius, recovered pressure and shear of what carries, from the axis outwards."""
    node = system.candidates.node
    pressure, shear = accepted.traction.recovered_pressure, accepted.traction.recovered_shear
    carrying = np.flatnonzero(carries(accepted.solved.r) & np.isfinite(pressure))
    order = carrying[np.argsort(accepted.state.nodes[node[carrying], 0])]
    return {"radius": accepted.state.nodes[node[order], 0], "pressure": pressure[order], "shear": shear[order]}


def alternating(system: System, accepted: Accepted, force: float) -> tuple[float, float]:
    """``line`` and ``corner`` along what was the top at rest; no number of fewer than five nodes."""
    along = corner.profile(system, accepted)
    if len(along.radius) < 5:
        return float("nan"), float("nan")
    mean = force / (np.pi * along.radius[-1] ** 2)
    amplitude = corner.alternation(along.consistent_pressure)
    return float(np.sqrt(np.mean(amplitude**2))) / mean, float(amplitude[-1]) / mean


def beside(system: System) -> Ints:
    """Candidates that were beside the punch at rest, not on it."""
    return np.flatnonzero(~np.isin(system.candidates.node, system.body.scene.mesh.boundary_nodes("top")))


def overlapping(scene: Scene, accepted: Accepted) -> float:
    """How deep (mm) an edge goes into the punch, between its nodes too."""
    state = accepted.state
    return overlap(scene, state.nodes, scene.placed(state.tau, state.translation)) * scene.mesh.size


def run(job: Job) -> list[tuple[Row, dict[str, Floats]]]:
    """Rows of a run, as far as it comes, with the tractions there and the course until then."""
    scene, begin = job.scene(), (FIRST / REDUCTION if job.mu else 0.0)
    schedule = Schedule(job.increments, begin, landings=tuple(mark / REDUCTION for mark in MARKS[:-1]))
    system, out = system_of(scene), list[tuple[Row, dict[str, Floats]]]()
    side = beside(system)
    course = list[tuple[float, ...]]()
    passes = cuts = fallbacks = 0
    seconds = 0.0
    try:
        for accepted in march(scene, schedule, Control(Newton(), (Tangent(), Dissipation()), cuts=CUTS)):
            passes, cuts, seconds = passes + accepted.passes, cuts + accepted.cuts, seconds + accepted.seconds
            fallbacks += accepted.form is not Newton.name
            reduction, force = round(accepted.state.tau * REDUCTION, 9), float(-accepted.tool_force(0)[1])
            nodes, carrying = accepted.state.nodes, carries(accepted.solved.r)
            radius = float(nodes[:, 0].max())
            contact = float(nodes[system.candidates.node[carrying], 0].max(initial=0.0))
            course.append((reduction, force, radius, contact, float(carrying[side].sum())))
            if reduction not in MARKS:
                continue
            along = profile(system, accepted) | dict(zip(COURSE, np.array(course).T, strict=True))
            row = Row(
                job.mu,
                job.of.element.value,
                job.of.sampling.value,
                job.elements,
                job.of.layout.value,
                system.body.space.size,
                accepted.number,
                reduction,
                force,
                radius,
                contact,
                *alternating(system, accepted, force),
                float(along["pressure"].min()),
                float(along["pressure"].max()),
                overlapping(scene, accepted),
                passes,
                cuts,
                fallbacks,
                seconds,
            )
            out.append((row, along))
    except IncrementFailed:
        # Where it ends is what the study tells: an element would fold there.
        pass
    return out


def runs(jobs: Sequence[Job], workers: int) -> Iterator[list[tuple[Row, dict[str, Floats]]]]:
    """These runs, with progress."""
    with progressing(f"accuracy.{NAME}") as progress:
        for done, rows in enumerate(completed(run, jobs, workers)):
            yield rows
            last = rows[-1][0] if rows else None
            told = last and f"mu = {last.mu:g}, {last.of}, {last.elements} elements"
            progress.advance((done + 1) / len(jobs), told or "")


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    parser = parser_of(
        "accuracy.mesh",
        "Errors of the mesh, element by element.",
        fast="two small meshes, four discretisations, few increments",
        out=Path("results/accuracy"),
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    order = [(j.mu, j.of, j.elements, mark) for j in plan.jobs() for mark in MARKS]
    fixed = {"increments": plan.increments}
    made = ("limits.csv", "scatter.csv")
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=order, curve=name, derived=made)
    # One that would fold is run again: that it has ended is in no row.
    left = [j for j in plan.jobs() if (j.mu, j.of, j.elements, MARKS[-1]) not in table]
    for found in runs(left, asked.jobs):
        table.add(*(row for row, _ in found), curves={name(row): along for row, along in found})
    curves = {row: table.curves[name(row)] for row in table.rows}
    limits = extrapolated(table.rows, curves)
    for file, found in zip(made, (limits, scatters(table.rows, curves, REDUCTION)), strict=True):
        write_csv(asked.out / file, found)
    say(text(table.rows, SHOWN))
    if limits:
        say(text(limits, ("mu", "reduction", "quantity", "value", "band")))
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
