"""What the columns of a block's pressure mean, what of it alternates, and what is a peak at the edge."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Symmetry, VonMises, march
from bipot import block as plane_block
from bipot.contact.closeness import carries
from bipot.fem.surface import facet_mass
from bipot.marching import system_of
from bipot.meshes.layout import Layout
from bipot.results import open as open_results
from bipot.traction import tractions
from studies import block
from studies.block_line import corner, edge, inner, line, written
from studies.corner import alternation
from studies.recovered import consistent_tractions

FALL = 2 - np.sqrt(3)
"""Of what the consistent mass makes of a force on one node, from each node to the next."""


@cache
def pressed(elements):
    """The system and the one increment of a block without friction."""
    (case,) = block.cases(block.parser().parse_args(["--mu", "0", "--elements", str(elements), "--increments", "1"]))
    scene = case.scene()
    return system_of(scene), next(march(scene, Schedule(1), case.control()))


def planted(elements, force):
    """The system, the increment with normal forces ``force(M, i)`` and their mean pressure.

    M (n, n) is the consistent mass of the upper face's nodes, i (n,) their number along x from the middle.
    """
    system, accepted = pressed(elements)
    points, x, mesh = system.candidates, accepted.solved.iterate.balanced, system.body.scene.mesh
    faces, own = mesh.boundary("top"), np.flatnonzero(np.isin(points.node, mesh.boundary_nodes("top")))
    M = np.zeros((len(x), len(x)))
    for face, mass in zip(faces, facet_mass(x, faces, Geometry.SOLID), strict=True):
        M[np.ix_(face, face)] += mass
    at = points.node[own]
    r = np.zeros_like(accepted.solved.r)
    r[own, 0] = force(M[np.ix_(at, at)], np.round(mesh.nodes[at, 0] * elements / 5.0).astype(int))
    whole = r[:, 0].sum()
    given = replace(accepted, solved=replace(accepted.solved, r=r), tool_forces=np.array([[0.0, 0.0, -whole]]))
    return system, given, whole / np.prod(x[:, :2].max(axis=0))


@pytest.mark.slow
def test_nothing_alternates_in_a_uniform_pressure():
    system, accepted = pressed(8)
    assert line(system, accepted) < 1e-6
    assert inner(system, accepted) < 1e-6
    assert written(system, accepted) < 1e-6
    assert edge(system, accepted) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.slow
def test_the_alternation_is_the_amplitude_of_an_alternating_pressure():
    system, given, mean = planted(8, lambda M, i: M @ (7.0 + 0.5 * (-1.0) ** i))
    assert corner(system, given) == pytest.approx(0.5 / mean)
    assert line(system, given) == pytest.approx(0.5 / mean)
    assert inner(system, given) == pytest.approx(0.5 / mean)
    assert written(system, given) == pytest.approx(0.5 / 3 / mean)


@pytest.mark.parametrize("t", [2.0, 3.0])
@pytest.mark.parametrize("m", [6, 8])
def test_a_peak_on_the_edge_alone_is_a_line_but_nothing_that_alternates(m, t):
    """Forces of a uniform pressure, those of the edge ``t`` times as large."""
    system, given, mean = planted(m, lambda M, i: M.sum(axis=1) * np.where(i == m, t, 1.0))
    assert corner(system, given) * mean == pytest.approx(np.sqrt(3) * (1 + FALL) ** 4 / 16 * (t - 1), rel=1e-4)
    assert line(system, given) * mean == pytest.approx(0.29 * (t - 1) / np.sqrt(m - 3), rel=0.01)
    assert inner(system, given) < 1e-9
    assert edge(system, given) * mean == pytest.approx(t)


@pytest.mark.slow
def test_little_alternates_where_friction_is_low_and_much_of_it_is_a_peak_at_the_edge_where_it_is_high(tmp_path):
    assert block.main(["--elements", "8", "--out", str(tmp_path)]) == 0
    low, high = (open_results(tmp_path / f"mu{mu}") for mu in (0.1, 0.3))
    assert (low["line"] < 0.02).all()
    assert (low["inner"] < 0.02).all()
    early = high["reduction"] < 0.1
    assert (high["line"][early] < 0.05).all()
    # Then nothing of the sides' middles has landed, and the peak on the edge grows.
    late = high["reduction"] > 0.25
    assert (high["line"][late] > 0.08).all()
    assert (high["edge"][late] > 2.2).all()


@pytest.mark.slow
def test_fanned_out_little_alternates_at_high_friction_too(tmp_path):
    """Between planes up to 0.1 does."""
    assert block.main(["--elements", "8", "--mu", "0.3", "--layout", "fanned", "--out", str(tmp_path)]) == 0
    history = open_results(tmp_path / "mu0.3")
    assert history["line"].max() > 0.12
    assert (history["inner"][history["reduction"] > 0.05] < 0.03).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layout", "least", "most", "alternates"), [(Layout.TENSOR, 1.3, 1.45, 0.2), (Layout.FANNED, 0.87, 1.05, 0.03)]
)
def test_the_pressure_at_the_edge_grows_as_the_side_turns_until_it_lands(layout, least, most, alternates):
    """In plane strain, p = 2k (1 + theta - pi/2) of slip lines at the angle theta of the platen and the side.

    Fanned elements have it where it matters, as the side lies down; one in the corner has a third more.
    """
    platen = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -1.5), ("top", "right"), 0.3)
    mesh = plane_block(5.0, 5.0, 8, 8, layout=layout)
    material = VonMises(Elasticity(210e3, 0.3), Perfect(300.0))
    scene = Scene(mesh, Geometry.PLANE_STRAIN, material, (Symmetry("left", 0), Symmetry("base", 1)), (platen,))
    points, found = system_of(scene).candidates, []
    own = np.flatnonzero(np.isin(points.node, mesh.boundary_nodes("top")))
    own = own[np.argsort(mesh.nodes[points.node[own], 0])]
    side = mesh.boundary_nodes("right")
    below = side[np.argsort(mesh.nodes[side, 1])[-2]]
    for step in march(scene, Schedule(30, first=1 / 300, settling=5)):
        r, closed, x = step.solved.r, carries(step.solved.r), step.state.nodes
        consistent, nodal = (of(points, x, r, closed)[0][own] for of in (consistent_tractions, tractions))
        away, down = (x[below] - x[points.node[own[-1]]]) * (1, -1)
        of_slip_lines = 600 / np.sqrt(3) * (1 + np.arctan2(away, down))
        line = np.sqrt(np.mean(alternation(consistent) ** 2)) / consistent.mean()
        inner = 3 * np.sqrt(np.mean(alternation(nodal[:-1]) ** 2)) / consistent.mean()
        found.append((closed.sum() - closed[own].sum(), line, inner, nodal[-1] / of_slip_lines, nodal[-1]))
    landed, line, inner, ratio, edge = np.array(found).T
    before = int((landed == 0).sum())
    assert line[before - 1] == line[:before].max() > 0.1
    assert least < ratio[before - 1] < most
    assert edge[before - 1] > 1.6 * edge[5]
    assert line[before] < 0.5 * line[before - 1]
    assert line[-1] < 0.02
    assert inner.max() < alternates
    assert landed[-1] >= 2
