"""Force and work of twelve small scenes by every form that suits them: what a change of the insides may not move.

    OMP_NUM_THREADS=1 python -m tests.golden --out tests/data/golden.csv

writes the table anew: scene, form, increment, ``force`` (sum of the normal contact forces) and ``work`` (of the tools
since the start), both of the modelled part, consistent units N and mm.

Each form is asked for the tightest bounds that it reaches on every scene, without fallbacks and cuts, so that a number
depends on the law alone. Equilibrium is met to 1e-11 but in ``dissipation``: its passes start from an interior point
anew and its polish leaves out how the configuration moves, so it ends between 1e-9 and 1e-10, with Clarabel asked for
1e-13. ``delassus`` meets the law in units of force to 1e-9: round-off of W r is what the discrete problem ends at.
Written with one or two BLAS threads the table is the same to its last digit; with other kernels
(OPENBLAS_CORETYPE=Nehalem, numpy without AVX2) it differs by 1.6e-11 of the largest at most, in ``dissipation``.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from bipot import (
    Configuration,
    Control,
    Dissipation,
    FlatTool,
    Geometry,
    Linear,
    Newton,
    Quadrature,
    Scene,
    Schedule,
    Support,
    Tabulated,
    Tangent,
    Voce,
    march,
    upsetting,
)
from bipot.certificate import Bounds
from bipot.conic.solver import Accuracy
from bipot.coulomb import Limits as Effort
from bipot.coulomb import ProximalPoint
from bipot.forms import Delassus, Form, Penalty, Uzawa
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, ring
from bipot.paper import as_written, unreturned

TABLE = Path(__file__).parent / "data" / "golden.csv"
DIGITS = 13

TIGHT = Bounds(
    equilibrium=1e-11,
    yield_violation=1e-11,
    penetration=1e-13,
    cone_violation=1e-11,
    law=1e-10,
    relative_gap=1e-12,
)
K, K_UZAWA = 1e6, 1e8
"""Nodal penalties, N/mm: about E/h of the contact edge, and what lets Uzawa's refreshing converge in a few passes."""

FIRST = 0.001
"""Start-up increments, a fraction of the height."""


@dataclass(frozen=True)
class Case:
    """A scene, its pseudo-times and how its flow is integrated."""

    scene: Scene
    schedule: Schedule
    integration: Integration = Integration.BDF2

    @property
    def welded(self) -> bool:
        return any(tool.welded for tool in self.scene.tools)

    @property
    def papers(self) -> bool:
        """Whether it is posed in the configuration of the paper."""
        return self.scene.configuration is Configuration.PAPER


@dataclass(frozen=True)
class Row:
    scene: str
    form: str
    increment: int
    force: float
    work: float


def upset(mu: float, reduction: float = 0.03, increments: int = 4, elements: int = 3, **asked: Any) -> Case:
    """The seed's cylinder, upset a little."""
    scene = upsetting(mu=mu, reduction=reduction, elements=elements, **asked)
    return Case(scene, Schedule(increments, first=FIRST / reduction, settling=2, growth=2))


def unloaded() -> Case:
    """The punch goes back by 3 % of its travel: all of the body unloads, some of it slides back."""
    case = upset(0.2, 0.02, 8)
    punch = replace(case.scene.tools[0], path=((0.0, 0.0), (0.6, 1.0), (1.0, 0.97)))
    return replace(case, scene=replace(case.scene, tools=(punch,)))


def inclined() -> Case:
    """A plane block under an inclined tool that slides and touches one node after the other."""
    sine = 0.05
    normal = (sine, -((1 - sine**2) ** 0.5))
    scene = replace(
        upsetting(mu=0.2, elements=1, hardening=Linear(300.0, 1000.0)),
        mesh=block(6.0, 4.0, 4, 3, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        supports=(Support("base", 0), Support("base", 1)),
        tools=(FlatTool((0.0, 4.0), normal, (0.1, -0.06), ("top",), 0.2),),
    )
    return Case(scene, Schedule(5, first=0.01, settling=2, growth=3))


def corner() -> Case:
    """A plane block pressed into a corner of two smooth tools, which share a node; one is met on the way."""
    scene = replace(
        upsetting(mu=0.0, elements=1),
        mesh=block(6.0, 4.0, 3, 3, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        supports=(Support("base", 1), Support("left", 0)),
        tools=(
            FlatTool((0.0, 4.0), (0.0, -1.0), (0.0, -0.12), ("top",), 0.0),
            FlatTool((6.05, 0.0), (-1.0, 0.0), (0.0, 0.0), ("right",), 0.0),
        ),
    )
    return Case(scene, Schedule(5))


def hollow() -> Case:
    """A ring of tabulated hardening, with coefficients of their own at its two edges."""
    mesh = ring(3.0, 6.0, 4.0, 3, 3, element=Element.Q8)
    edge = mesh.boundary_nodes("top")[[0, -1]].tolist()
    punch = FlatTool(
        (0.0, 4.0), (0.0, -1.0), (0.0, -0.16), ("top", "side", "bore"), 0.15, mu_at={edge[0]: 0.3, edge[1]: 0.0}
    )
    curve = Tabulated((0.0, 0.01, 0.1), (300.0, 350.0, 420.0))
    body = upsetting(mu=0.15, elements=1, hardening=curve)
    scene = replace(body, mesh=mesh, supports=(Support("base", 1),), tools=(punch,))
    return Case(scene, Schedule(5, first=0.025, settling=2, growth=3))


CASES: dict[str, Case] = {
    "smooth": upset(0.0, hardening=Linear(300.0, 2000.0)),
    "low_friction": upset(0.1, elements=4),
    "high_friction": upset(0.3, 0.02, 6, elements=4),
    "welded": upset(float("inf")),
    "gauss2": upset(0.3, 0.02, 6, quadrature=Quadrature.GAUSS2),
    "gauss3": upset(0.1, quadrature=Quadrature.GAUSS3),
    "backward_euler": replace(upset(0.3, hardening=Voce(300.0, 100.0, 8.0)), integration=Integration.BACKWARD_EULER),
    "unloading": unloaded(),
    "inclined": inclined(),
    "corner": corner(),
    "ring": hollow(),
    "paper": upset(0.1, configuration=Configuration.PAPER),
}

Posed = Callable[[Case], tuple[Scene, Control]]


def _solved(form: Form, bounds: Bounds = TIGHT) -> Posed:
    """Scene and control of increments iterated to the bounds."""
    limits = Limits(bounds, passes=80, patience=30)
    return lambda case: (case.scene, Control(form, (), limits, cuts=0, integration=case.integration))


FORMS: dict[str, Posed] = {
    "newton": _solved(Newton()),
    "tangent": _solved(Tangent()),
    "dissipation": _solved(Dissipation(accuracy=Accuracy(1e-13)), replace(TIGHT, equilibrium=1e-9)),
    "delassus": _solved(
        Delassus(ProximalPoint(), Effort(tol=1e-15, patience=20)),
        replace(TIGHT, penetration=1e-12, law=1e-9, relative_gap=1e-10),
    ),
    "penalty": _solved(Penalty(K, K)),
    "uzawa": _solved(Uzawa(K_UZAWA, K_UZAWA)),
    "as_written": lambda case: as_written(case.scene, K, K),
    "as_written_rate": lambda case: as_written(unreturned(case.scene), K, K),
}
EXACT = ("newton", "tangent", "dissipation", "delassus", "uzawa")
"""The forms that pose the same law."""


def suits(form: str, case: Case) -> bool:
    """Whether the form takes the case: penalties and discrete problems do not weld, the paper's scheme is one of its
    own configuration.
    """
    if form in ("delassus", "penalty", "uzawa"):
        return not case.welded
    return case.papers or not form.startswith("as_written")


def pairs() -> list[tuple[str, str]]:
    """Every scene with every form that suits it."""
    return [(scene, form) for scene, case in CASES.items() for form in FORMS if suits(form, case)]


def run(scene: str, form: str) -> Iterator[Row]:
    """The increments of one run; raises IncrementFailed where one does not meet its bounds."""
    body, control = FORMS[form](CASES[scene])
    for accepted in march(body, CASES[scene].schedule, control):
        work = accepted.energies.work / body.images  # of the modelled part
        yield Row(scene, form, accepted.number, float(accepted.solved.r[:, 0].sum()), work)


def write(path: Path, rows: Iterable[Row]) -> None:
    """The table as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([f.name for f in fields(Row)])
        writer.writerows(
            (row.scene, row.form, row.increment, *(f"{x:.{DIGITS}g}" for x in (row.force, row.work))) for row in rows
        )


def read(path: Path = TABLE) -> dict[tuple[str, str], list[Row]]:
    """The rows of each scene and form, in their order."""
    found = dict[tuple[str, str], list[Row]]()
    with path.open(newline="", encoding="utf-8") as file:
        for r in csv.DictReader(file):
            row = Row(r["scene"], r["form"], int(r["increment"]), float(r["force"]), float(r["work"]))
            found.setdefault((row.scene, row.form), []).append(row)
    return found


def main(argv: list[str] | None = None) -> int:
    """Write the table."""
    parser = argparse.ArgumentParser(prog="tests.golden", description="Write the golden table.", allow_abbrev=False)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args(argv)
    write(asked.out, [row for pair in pairs() for row in run(*pair)])
    return 0


if __name__ == "__main__":
    sys.exit(main())
