r"""Oscillation of the contact pressure near the corner, and of the pressure inside, by quadrature rule.

    python -m studies.corner [--fast] [--resume | --overwrite] [--out DIR]

The seed paper's cylinder at 20 %, mu = 0.1 and 0.3, 5, 10 and 20 elements a side, all rules of
:class:`bipot.fem.elements.Quadrature`. ``DIR/corner.csv`` has a row a run, ``DIR/corner.h5`` the same and, along the
punch from axis to corner, tractions recovered in two ways (:mod:`bipot.traction`): edge means, and nodal p_0 .. p_m by
the consistent mass, kept here because their oscillation is what is measured. Measures:

    line     sqrt(mean_i A_i^2) / p_mean,    corner   A_{m-2} / p_mean,
    A_i    = |p_{i-2} - 4 p_{i-1} + 6 p_i - 4 p_{i+1} + p_{i+2}| / 16,       2 <= i <= m - 2,

the amplitude of a pressure that alternates from node to node (A_i = a for p_i = (-1)^i a, 0 for a cubic in i), and

    inside   rms over elements and points of p - (its best linear fit in the element's coordinates), over sigma_Y,

with p = -tr sigma/3 and the rule's weights; ``corner_inside`` is that of the corner element. A fit to the four points
of 2x2 leaves one number of four, one to seven leaves four.

Constraint counts: ``per_element`` is 6 (unknowns of an eight-node element in a large mesh) over the rank of the
element's volumetric strains at its points, 2 being ideal and less than 1 meaning more constraints than unknowns;
``isochoric`` is the share of motions of the mesh at rest, free of the punch, that change the volume at no point.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bipot.contact.closeness import carries
from bipot.control.accepted import Accepted
from bipot.fem.elements import RULES, Quadrature, tabulated
from bipot.fem.kinematics import gradients
from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.system import System
from bipot.tensors import identity, trace
from bipot.traction import contact_edges
from bipot.typing import Floats
from studies.command import command, progressing, say
from studies.outputs import opened, parser_of
from studies.recovered import consistent_tractions, edge_tractions
from studies.upsetting_march import FIRST

NAME = "corner"
COMMAND = "python -m studies.corner --out {out}"
REDUCTION, DOFS_AN_ELEMENT = 0.20, 6
Key = tuple[float, str, int]
SHOWN = (
    "mu",
    "quadrature",
    "elements",
    "force_N",
    "line",
    "corner",
    "inside",
    "corner_inside",
    "per_element",
    "isochoric",
)


@dataclass(frozen=True)
class Plan:
    """Coefficients, elements a side, increments."""

    mus: tuple[float, ...] = (0.1, 0.3)
    elements: tuple[int, ...] = (5, 10, 20)
    increments: int = 20


FAST = Plan(elements=(4,), increments=3)


@dataclass(frozen=True)
class Row:
    """One run: force (N), mean pressure (MPa), the measures of the module docstring, forms that had to help."""

    mu: float
    quadrature: str
    elements: int
    force_N: float
    mean_pressure_MPa: float
    line: float
    corner: float
    inside: float
    corner_inside: float
    per_element: float
    isochoric: float
    accepted: int
    passes: int
    fallbacks: int
    worst_relative_gap: float


@dataclass(frozen=True)
class Profile:
    """Recovered tractions (MPa) along the punch, axis to corner, over the radius (mm).

    By the consistent mass at the nodes, radius (m + 1,); as means over the edges between their ends (m/2, 2).
    """

    radius: Floats
    consistent_pressure: Floats
    consistent_shear: Floats
    ends: Floats
    mean_pressure: Floats
    mean_shear: Floats


def alternation(p: Floats) -> Floats:
    """Amplitudes A_i (m - 3,) of what alternates from node to node in p (m + 1,).

    >>> alternation(np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])).tolist()
    [1.0, 1.0]
    >>> float(alternation(np.arange(6.0) ** 3).max())
    0.0
    """
    return np.abs(p[:-4] - 4 * p[1:-3] + 6 * p[2:-2] - 4 * p[3:-1] + p[4:]) / 16


def unevenness(pressure: Floats, points: Floats, weights: Floats) -> Floats:
    """Weighted rms (e,) of the pressure (e, q) minus its best linear fit over the points (q, 2).

    >>> rule = tabulated(Element.Q8, Quadrature.RADON7)
    >>> linear = 3 + rule.points @ np.array([[1.0], [2.0]])
    >>> float(unevenness(linear.T, rule.points, rule.weights).max().round(12))
    0.0
    """
    root = np.sqrt(weights / weights.sum())
    basis, _ = np.linalg.qr(root[:, None] * np.column_stack([np.ones(len(points)), points]))
    weighted = pressure * root
    return np.linalg.norm(weighted - weighted @ basis @ basis.T, axis=1)


def constraints(scene: Scene) -> tuple[float, float]:
    """Unknowns per volumetric constraint of an element in a large mesh, and isochoric motions per unknown of this."""
    mesh, space = scene.mesh, system_of(scene).body.space
    B = gradients(mesh.nodes, mesh.elements, tabulated(mesh.element, scene.rule), scene.geometry).B
    volumetric = identity(B.shape[2]) @ B
    rank = int(np.linalg.matrix_rank(volumetric[len(mesh.elements) // 2]))
    V = space.operator(volumetric.reshape(volumetric.shape[0] * volumetric.shape[1], 1, -1)).toarray()
    return DOFS_AN_ELEMENT / rank, 1 - int(np.linalg.matrix_rank(V.T @ V, hermitian=True)) / space.size


def profile(system: System, accepted: Accepted) -> Profile:
    """The recovered tractions along the punch's own boundary."""
    r, nodes, points, scene = accepted.solved.r, accepted.state.nodes, system.candidates, system.body.scene
    closed = carries(r)
    pressure, shear = consistent_tractions(points, nodes, r, closed)
    top = np.isin(points.node, scene.mesh.boundary_nodes("top"))
    edges = contact_edges(points, 0, closed)
    means = edge_tractions(nodes[points.node], edges, scene.geometry, r)
    radius = nodes[points.node, 0]
    line = np.flatnonzero(top & np.isfinite(pressure))
    line = line[np.argsort(radius[line])]
    along = np.flatnonzero(top[edges].all(axis=1))
    ends = np.sort(radius[edges[along][:, [0, -1]]], axis=1)
    order = np.argsort(ends[:, 0])
    mean = means[along][order]
    return Profile(
        radius=radius[line],
        consistent_pressure=pressure[line],
        consistent_shear=shear[line],
        ends=ends[order],
        mean_pressure=mean[:, 0],
        mean_shear=mean[:, 1],
    )


def measure(mu: float, quadrature: Quadrature, elements: int, increments: int) -> tuple[Row, Profile]:
    """Run one upsetting to 20 %."""
    scene = upsetting(mu=mu, reduction=REDUCTION, elements=elements, quadrature=quadrature)
    system, mesh, rule = system_of(scene), scene.mesh, tabulated(scene.mesh.element, quadrature)
    schedule = Schedule(increments, FIRST / REDUCTION)
    accepted = list(march(scene, schedule, Control(Newton(), (Tangent(), Dissipation()))))
    end, along = accepted[-1], profile(system, accepted[-1])
    force = float(-end.tool_forces[0, 1])
    mean = force / (np.pi * along.radius[-1] ** 2)
    uneven = unevenness(-trace(end.state.stress) / 3, rule.points, rule.weights)
    corner = np.isin(mesh.elements, np.intersect1d(mesh.boundary_nodes("top"), mesh.boundary_nodes("side"))).any(axis=1)
    amplitude, sigma_y = alternation(along.consistent_pressure), float(scene.material.yield_stress(0.0))
    row = Row(
        mu,
        quadrature.value,
        elements,
        force,
        mean,
        float(np.sqrt(np.mean(amplitude**2))) / mean,
        float(amplitude[-1]) / mean,
        float(np.sqrt(np.mean(uneven**2))) / sigma_y,
        float(uneven[corner][0]) / sigma_y,
        *constraints(scene),
        len(accepted),
        sum(a.passes for a in accepted),
        sum(a.form is not Newton.name for a in accepted),
        max(a.solved.certificate.relative_gap for a in accepted),
    )
    return row, along


def curve_name(mu: float, quadrature: str, elements: int) -> str:
    """Of a profile in the results."""
    return f"mu{mu:g} {quadrature} {elements}"


def key(row: Row) -> Key:
    """What tells one run from another."""
    return row.mu, row.quadrature, row.elements


def planned(plan: Plan) -> list[Key]:
    """All runs."""
    return [(mu, rule.value, n) for mu in plan.mus for n in plan.elements for rule in RULES[Element.Q8]]


def measures(runs: Sequence[Key], increments: int) -> Iterator[tuple[Row, Profile]]:
    """These runs, with progress."""
    with progressing(NAME) as progress:
        for done, (mu, rule, n) in enumerate(runs):
            yield measure(mu, Quadrature(rule), n, increments)
            progress.advance((done + 1) / len(runs), f"mu = {mu:g}, {rule}, {n} elements")


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    parser = parser_of(NAME, "Pressure oscillation by quadrature rule.", fast="one small mesh and few increments")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    runs, fixed = planned(plan), {"increments": plan.increments}
    table = opened(
        asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=runs, curve=lambda row: curve_name(*key(row))
    )
    for row, along in measures([run for run in runs if run not in table], plan.increments):
        table.add(row, curves={curve_name(*key(row)): vars(along)})
    say(table.words(SHOWN))
    return 0


if __name__ == "__main__":
    sys.exit(main())
