r"""Loads and prescribed displacements against closed forms and published numbers.

    python -m studies.load_cases [--fast] [--resume | --overwrite] [--out DIR]

Writes ``load_cases.csv`` (case, quantity, reference, measured, difference, allowed) and ends with exit code 1 where a
difference, relative to the reference, exceeds what is allowed. Units N, mm, MPa.

* tube: a thick cylinder in plane strain, a = 100, b = 200, E = 210000, nu = 0.3, sigma_Y = 240, perfect plasticity,
  small strain. Outer displacement at the pressures that bring the plastic front to c = 140 and 160 (Tresca's form with
  2k = 2 sigma_Y / sqrt 3); the limit pressure 2k ln(b/a), by the bore driven outwards and by a pressure, between the
  largest that is carried and the smallest that is not.
* huge strain: a0 = 10, b0 = 20, sigma_Y = 0.5, E = 10000 sigma_Y, bore driven to a = 15 and 30: the pressure is
  2k ln(b/a) with b^2 = a^2 + 300, and falls.
* block: on a rigid plane with stick, slip and separation (Raous, Chabrand and Lebon; Code_Aster's case SSNV128):
  40 x 40, E = 130000, nu = 0.2, mu = 1, pressures 50 on top and 150 on the left; u_x of five points, an average of
  codes, known to about 5 %.
* shear lag: a bar (EA = 1000) on a rigid plane whose friction holds q = 10 a unit of length at most, pulled by F = 5
  and released: end displacement F^2 / (2 q EA), half of it left, F^3 / (6 q EA) dissipated in loading.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bipot import (
    Accepted,
    Amplitude,
    Configuration,
    Control,
    Dissipation,
    Elastic,
    Elasticity,
    FlatTool,
    Geometry,
    IncrementFailed,
    Newton,
    Perfect,
    Prescribed,
    Pressure,
    Quadrature,
    Scene,
    Schedule,
    Support,
    Tangent,
    Traction,
    VonMises,
    block,
    march,
    ring,
)
from bipot.elements import Element
from bipot.typing import Floats
from studies.command import command, say
from studies.outputs import add_options, opened
from studies.tables import text

NAME = "load_cases"
CONTROL = Control(Newton(), (Tangent(), Dissipation()))
INNER, OUTER, DEPTH, YIELD = 100.0, 200.0, 10.0, 240.0
LIMIT = 2 * YIELD / np.sqrt(3) * np.log(OUTER / INNER)


@dataclass(frozen=True)
class Row:
    """One number: its reference, what was measured, their relative difference, and how much of it is allowed."""

    case: str
    quantity: str
    reference: float
    measured: float
    difference: float
    allowed: float

    @staticmethod
    def of(case: str, quantity: str, reference: float, measured: float, allowed: float) -> Row:
        """With its difference."""
        return Row(case, quantity, reference, measured, measured / reference - 1, allowed)


def tube(elements: int) -> Scene:
    """The thick cylinder, small strain; 2 x 2 points, because seven are too many for flow without change of volume."""
    return Scene(
        mesh=ring(INNER, OUTER, DEPTH, elements, 1, element=Element.Q8),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(210_000.0, 0.3), Perfect(YIELD)),
        supports=(Support("base", 1), Support("top", 1)),
        quadrature=Quadrature.GAUSS2,
        configuration=Configuration.SMALL,
    )


def last(scene: Scene, schedule: Schedule) -> Accepted:
    """The end of a march."""
    *_, end = march(scene, schedule, CONTROL)
    return end


def pressure_on(accepted: Accepted, boundary: str) -> float:
    """Mean pressure that supports put on a boundary of the ring, over its area where the body is in equilibrium."""
    iterate = accepted.solved.iterate
    mesh = iterate.increment.system.body.scene.mesh
    nodes = mesh.boundary_nodes(boundary)
    force = iterate.reactions(accepted.solved.r)[nodes, 0].sum()
    radius, heights = iterate.balanced[nodes].T
    return float(force / (2 * np.pi * radius.mean() * np.ptp(heights)))


def tubes(elements: int) -> Iterator[Row]:
    """Displacements, and the limit by the bore's displacement and by pressure."""
    scene = tube(elements)
    side = scene.mesh.boundary_nodes("side")
    for front, pressure, reference in ((140, 163.914, 0.117687), (160, 180.134, 0.153714)):
        end = last(replace(scene, loads=(Pressure("bore", pressure),)), Schedule(10))
        outer = float((end.state.nodes[side, 0] - OUTER).mean())
        yield Row.of("tube", f"u_b at c = {front}", reference, outer, 0.01)
    driven = replace(scene, supports=(*scene.supports, Prescribed("bore", 0, 1.0)))
    yield Row.of("tube", "limit, bore driven", LIMIT, pressure_on(last(driven, Schedule(10)), "bore"), 0.005)
    carried = [carries(scene, share * LIMIT) for share in (0.995, 1.005)]
    for share, good in zip((0.995, 1.005), (carried[0], not carried[1]), strict=True):
        said = f"pressure {share:g} of the limit is {'carried' if share < 1 else 'not carried'}"
        yield Row.of("tube", said, 1.0, float(good), 0.0)


def carries(scene: Scene, pressure: float) -> bool:
    """Whether the tube carries a pressure."""
    try:
        last(replace(scene, loads=(Pressure("bore", pressure),)), Schedule(10))
    except IncrementFailed:
        return False
    return True


def huge(elements: int, increments: int) -> Iterator[Row]:
    """The pressure of the expanding tube."""
    a, area = 10.0, 300.0
    scene = Scene(
        mesh=ring(a, 20.0, 1.0, elements, 1, element=Element.Q8),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(5000.0, 0.3), Perfect(0.5)),
        supports=(Support("base", 1), Support("top", 1), Prescribed("bore", 0, 2 * a)),
        quadrature=Quadrature.GAUSS2,
    )
    for step in march(scene, Schedule(increments, landings=(0.25,)), CONTROL):
        if step.state.tau in (0.25, 1.0):
            radius = a * (1 + 2 * step.state.tau)
            exact = 1 / np.sqrt(3) * np.log(np.sqrt(radius**2 + area) / radius)
            yield Row.of("huge strain", f"p at a = {radius:g}", exact, pressure_on(step, "bore"), 0.005)


def blocks(elements: int) -> Iterator[Row]:
    """Tangential displacements of the block's base."""
    scene = Scene(
        mesh=block(40.0, 40.0, elements, elements, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(Elasticity(130_000.0, 0.2)),
        supports=(Support("right", 0),),
        tools=(FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 1.0),),
        loads=(Pressure("top", 50.0), Pressure("left", 150.0)),
        configuration=Configuration.SMALL,
    )
    end = last(scene, Schedule(5))
    base = scene.mesh.boundary_nodes("base")
    base = base[np.argsort(scene.mesh.nodes[base, 0])]
    moved: Floats = end.state.nodes[base, 0] - scene.mesh.nodes[base, 0]
    for x, reference in ((0.0, 0.0286), (1.25, 0.0272), (5.0, 0.0228), (7.5, 0.0198), (11.25, 0.0150)):
        measured = float(np.interp(x, scene.mesh.nodes[base, 0], moved))
        yield Row.of("block", f"u_x at x = {x:g}", reference, measured, 0.05)


def bars(elements: int) -> Iterator[Row]:
    """The bar that slips on its plane, so thin that the eccentricity of its pull does not matter."""
    thick, stiffness, friction, pull, mu = 1e-3, 1000.0, 10.0, 5.0, 0.5
    press = Amplitude(((0.0, 0.0), (0.1, 1.0), (1.0, 1.0)))
    there_and_back = Amplitude(((0.0, 0.0), (0.1, 0.0), (0.5, 1.0), (1.0, 0.0)))
    scene = Scene(
        mesh=block(1.0, thick, elements, 1, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(Elasticity(stiffness / thick, 0.0)),
        supports=(),
        tools=(FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), mu),),
        loads=(Pressure("top", friction / mu, press), Traction("right", (pull / thick, 0.0), there_and_back)),
        configuration=Configuration.SMALL,
    )
    right, free = scene.mesh.boundary_nodes("right"), pull**2 / (2 * friction * stiffness)
    for step in march(scene, Schedule(20, landings=(0.1, 0.5)), CONTROL):
        end = float((step.state.nodes - scene.mesh.nodes)[right, 0].mean())
        if step.state.tau == 0.5:
            yield Row.of("shear lag", "end displacement", free, end, 0.01)
            lost = pull**3 / (6 * friction * stiffness)
            yield Row.of("shear lag", "dissipated in loading", lost, step.energies.friction, 0.01)
        if step.state.tau == 1.0:
            yield Row.of("shear lag", "end displacement left", free / 2, end, 0.01)


class Case(NamedTuple):
    """A case of the table: its name, how many rows it makes, and how, on meshes ``coarser`` by a factor."""

    name: str
    rows: int
    run: Callable[[int], Iterator[Row]]


CASES = (
    Case("tube", 5, lambda coarser: tubes(10)),
    Case("huge strain", 2, lambda coarser: huge(20 // coarser, 80 // coarser)),
    Case("block", 5, lambda coarser: blocks(32 // coarser)),
    Case("shear lag", 3, lambda coarser: bars(100 // coarser)),
)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, rewriting the table after each case."""
    parser = argparse.ArgumentParser(prog=f"studies.{NAME}", description="Loads, checked.", allow_abbrev=False)
    parser.add_argument("--fast", action="store_true", help="coarser meshes and fewer increments")
    parser.add_argument("--out", type=Path, default=Path("results"))
    add_options(parser)
    asked = parser.parse_args(argv)
    coarser = 2 if asked.fast else 1
    table = opened(
        asked.out,
        NAME,
        Row,
        lambda row: (row.case, row.quantity),
        asked.policy,
        parameters={"coarser": coarser},
    )
    for case in CASES:
        if sum(row.case == case.name for row in table.rows) < case.rows:
            table.add(*case.run(coarser))
    say(text(table.rows, ("case", "quantity", "reference", "measured", "difference", "allowed")))
    return int(any(not abs(row.difference) <= row.allowed for row in table.rows))


if __name__ == "__main__":
    sys.exit(main())
