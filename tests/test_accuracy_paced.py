"""What increments by accuracy cost beside equal ones: true error, search, a fast run, what is kept of a whole one."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bipot.control.reason import ReasonKind
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.paths import Amplitude
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.tool import FlatTool
from studies.accuracy import paced
from studies.accuracy.paced import CONTROL, FAST, FEWEST, Plan, Row, cheapest, key, run
from studies.accuracy.paced_scenes import SCENES, cylinder, pressed_ring
from studies.closed_forms import Cylinder
from studies.fuzz.unfolded import unfolded
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"
PAPER = Cylinder(10.0, 5.0, 210_000.0, 0.3, 300.0)


@pytest.mark.parametrize("increments", [8, 16])
def test_the_true_error_is_that_of_the_closed_form_without_friction(increments):
    """Of order two: a march of eight times as many leaves a part in 64 of it."""
    course = run(cylinder(0.0, elements=1), Schedule(increments))
    exact = PAPER.exact_force(0.3 * course.taus)
    missed = np.abs(-course.forces - exact).max() / exact.max()
    assert course.error == pytest.approx(missed, rel=0.05)


def known(passes, errors):
    """Marches of so many passes and such errors by the number of their increments, and which of them were asked for."""
    asked = []

    def uniform(increments):
        asked.append(increments)
        return SimpleNamespace(passes=passes(increments), error=errors(increments), increments=increments)

    return uniform, asked


def test_the_cheapest_has_the_fewest_passes_not_the_fewest_increments():
    uniform, asked = known(lambda n: 40 if n == 10 else 30, lambda n: 1 / n)
    assert cheapest(uniform, 0.1, 100).increments == 11
    assert asked == list(range(FEWEST, 30)), "an increment takes a pass at least"


def test_where_none_errs_as_little_there_is_none():
    uniform, asked = known(lambda n: 2 * n, lambda n: 1 / n)
    assert cheapest(uniform, 1 / 21, 20) is None
    assert asked == list(range(FEWEST, 21))
    assert cheapest(uniform, 1 / 20, 20).increments == 20


@pytest.mark.slow
def test_the_fast_study_writes_what_its_marches_come_to(tmp_path):
    assert paced.main(["--fast", "--out", str(tmp_path)]) == 0
    found, none = read_rows(tmp_path / "paced.csv", Row)
    assert [key(found), key(none)] == list(FAST.keys())
    scene = SCENES[found.scene]()
    own, equal = run(scene, Schedule(accuracy=found.accuracy)), run(scene, Schedule(int(found.uniform_increments)))
    assert (found.true_error, found.increments, found.passes) == (own.error, len(own.taus), own.passes)
    assert (found.uniform_error, found.uniform_passes) == (equal.error, equal.passes)
    assert found.uniform_error <= found.true_error
    assert found.ratio == own.passes / equal.passes
    beside = [run(scene, Schedule(n)).passes for n in range(4, 9) if abs(n - found.uniform_increments) <= 2]
    assert found.near_passes == np.mean(beside)
    assert np.isnan(
        [none.near_passes, none.uniform_error, none.uniform_increments, none.uniform_passes, none.ratio]
    ).all()


def test_the_kept_rows_are_all_that_the_plan_asks_for():
    """At most three times what was asked; at 1e-3 and 1e-4 a third of it, but on coarse meshes."""
    rows = read_rows(KEPT / "paced.csv", Row)
    assert [key(row) for row in rows] == list(Plan().keys())
    for row in rows:
        over = row.true_error / row.accuracy
        assert over <= 3
        assert over >= 1 / 3 or row.accuracy == 3e-4 or row.scene.startswith("coarse")
        assert not row.uniform_error > row.true_error


def test_the_kept_costs_are_as_the_page_says():
    """Less than the cheapest equal increments in the mean, nowhere more by a sixth, at 1e-4 by a tenth."""
    rows = read_rows(KEPT / "paced.csv", Row)
    ratios = {asked: [row.ratio for row in rows if row.accuracy == asked] for asked in (1e-3, 1e-4)}
    assert np.nanmean(np.log(ratios[1e-3])) < 0
    assert np.nanmax(ratios[1e-3]) < 7 / 6
    assert np.nanmean(np.log(ratios[1e-4])) < 0
    assert np.nanmax(ratios[1e-4]) < 1.1
    assert 2 * np.isnan(ratios[1e-4]).sum() >= len(ratios[1e-4])


@pytest.mark.xfail(strict=True, reason="26 equal increments at mu = 0.1 take 39 passes, those by accuracy 40")
def test_at_1e_4_increments_by_accuracy_cost_no_more_on_the_papers_mesh():
    named = ("mu = 0.1", "mu = 0.3", "ring", "block", "unloading")
    rows = [row for row in read_rows(KEPT / "paced.csv", Row) if row.scene in named and row.accuracy == 1e-4]
    assert len(rows) == len(named)
    assert all(not row.ratio > 1 for row in rows)


def test_what_first_yield_does_to_the_velocity_shortens_no_increment_after_it():
    """They were solved again, 0.3 of the first, as if something had happened there that they go through."""
    steps = list(march(pressed_ring(element=Element.Q4), Schedule(accuracy=1e-4), CONTROL))
    first, *others = np.diff([0.0, *(step.state.tau for step in steps[:5])])
    assert min(others) > first / 2
    assert not any(reason.kind is ReasonKind.ACCURACY for step in steps[:5] for reason in step.reasons)


@pytest.mark.parametrize("away", [1.0, 1e9, 1e17])
def test_a_tool_that_goes_away_out_of_reach_sets_no_increments(away):
    pressing = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.1, path=((0, 0), (0.5, 0.5), (1, 0.9)))
    leaving = FlatTool((50.0, 0.0), (-1.0, 0.0), (away, 0.0), ("right",), 0.1)
    material, held = VonMises(Elasticity(1000.0, 0.3), Linear(3.0, 30.0)), (Support("base", 0), Support("base", 1))
    seen = [
        [
            (a.state.tau, *a.tool_force(0))
            for a in march(
                Scene(block(2.0, 1.0, 4, 2), Geometry.PLANE_STRAIN, material, held, tools), Schedule(accuracy=1e-2)
            )
        ]
        for tools in ((pressing,), (pressing, leaving))
    ]
    np.testing.assert_allclose(seen[1], seen[0], rtol=1e-12, atol=1e-9)


def error_of(scene, accuracy, increments):
    """The largest error of the force at ends of increments over the largest force, beside so many that end there."""
    coarse = [(a.state.tau, a.tool_force(0)) for a in march(scene, Schedule(accuracy=accuracy))]
    ends = tuple(tau for tau, _ in coarse[:-1])
    fine = {a.state.tau: a.tool_force(0) for a in march(scene, Schedule(increments, landings=ends))}
    missed = [fine[tau] - force for tau, force in coarse]
    return np.abs(missed).max() / np.abs(list(fine.values())).max()


@pytest.mark.slow
def test_a_load_that_changes_while_a_tool_presses_sets_increments_too():
    pressing = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.025), ("top",), 0.2)
    material, held = VonMises(Elasticity(1000.0, 0.3), Linear(1.5, 100.0)), (Support("left", 0), Support("base", 1))
    pull = Traction("right", (2.4, 0.0), Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 0.0))))
    scene = Scene(block(2.5, 1.0, 6, 3), Geometry.PLANE_STRAIN, material, held, (pressing,), loads=(pull,))
    assert error_of(scene, 1e-3, 100) < 1e-3


def test_a_large_yield_strain_does_not_make_one_increment_of_the_whole_path():
    punch = FlatTool((0.0, 1.0), (0.0, -1.0), (0.05, -0.075), ("top",), 0.3)
    material, held = VonMises(Elasticity(1000.0, 0.3), Linear(50.0, 100.0)), (Support("base", 0), Support("base", 1))
    scene = Scene(block(2.5, 1.0, 6, 3), Geometry.PLANE_STRAIN, material, held, (punch,))
    assert error_of(scene, 3e-4, 64) < 3 * 3e-4


def test_a_body_that_slides_without_straining_takes_long_increments():
    """What is left of its motion beyond that of its supports is round-off, and no flow begins by that."""
    press = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.05), ("top",), 0.3, path=((0, 0), (0.4, 1), (1, 1)))
    along = Prescribed("base", 0, 0.075, Amplitude(((0.0, 0.0), (0.4, 0.0), (1.0, 1.0))))
    material, held = VonMises(Elasticity(200_000.0, 0.3), Linear(300.0, 500.0)), (Support("base", 1), along)
    scene = Scene(block(2.0, 1.0, 6, 3), Geometry.PLANE_STRAIN, material, held, (press,))
    steps = list(march(scene, Schedule(accuracy=1e-3, landings=(0.45,)), CONTROL))
    assert len(steps) < 40
    assert steps[-1].state.length > 0.1


def test_half_a_body_takes_the_increments_of_the_whole():
    """Between two platens the whole strains by what both go, and has nodes in its middle once."""
    platen = FlatTool((0.0, 10.0), (0.0, -1.0), (0.0, -2.0), ("top",), 0.1)
    mesh, held = block(20.0, 10.0, 4, 2), (Symmetry("base", 1), Support("left", 0))
    half = Scene(mesh, Geometry.PLANE_STRAIN, VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 0.0)), held, (platen,))
    (seen,) = unfolded(half)
    ends = [[a.state.tau for a in march(scene, Schedule(accuracy=1e-4))] for scene in (half, seen.scene)]
    assert len(ends[0]) > 10
    assert ends[0] == pytest.approx(ends[1], rel=1e-6)


@pytest.mark.parametrize(("back", "strains"), [(False, 2.0), (False, 5.0), (True, 3.0), (True, 6.0)])
def test_a_path_that_ends_soon_after_yielding_errs_by_what_was_asked(back, strains):
    """Of a clamped block that is pressed, or let off and pulled after it was pressed by thirty yield strains."""
    at_yield, most, begun = 300.0 / 2e5, 30.0 if back else strains, 0.5 if back else 0.0
    turns = ((0.5, 1.0), (1.0, 1 - strains / most)) if back else ((1.0, 1.0),)
    down = Prescribed("top", 1, -most * at_yield, Amplitude(((0.0, 0.0), *turns)))
    held = (Support("base", 0), Support("base", 1), Support("top", 0))
    material = VonMises(Elasticity(2e5, 0.3), Perfect(300.0))
    scene = Scene(block(1.5, 1.0, 3, 2), Geometry.PLANE_STRAIN, material, (*held, down))

    def force(accepted):
        return accepted.solved.iterate.reactions(accepted.solved.r)[scene.mesh.boundary_nodes("top"), 1].sum()

    steps = list(march(scene, Schedule(accuracy=1e-3), CONTROL))
    own = [step for step in steps if step.start.tau >= begun]
    ends = np.array([begun, *(step.state.tau for step in own)])
    finer = np.concatenate([np.linspace(*pair, 6)[1:] for pair in pairwise(ends)])[:-1]
    refined = march(scene, Schedule(1, landings=(*[begun] * back, *finer)), CONTROL, start=own[0].start)
    taus, forces = np.transpose([(step.state.tau, force(step)) for step in refined])
    missed = [force(step) - forces[np.argmin(np.abs(taus - step.state.tau))] for step in own]
    assert np.abs(missed).max() < 3e-3 * max(abs(force(step)) for step in steps)


@pytest.mark.parametrize("way", [3.0, -0.4])
def test_a_body_that_supports_carry_along_has_the_increments_of_one_at_rest(way):
    """It is pressed by a tenth of its height between ends that hold it, of which one rests, or both go along."""
    material = VonMises(Elasticity(2e5, 0.3), Linear(300.0, 2000.0))

    def ends(way):
        driven = Prescribed("base", 1, way), Prescribed("top", 1, way - 0.1)
        sides = Support("base", 0), Support("top", 0)
        scene = Scene(block(1.5, 1.0, 3, 2), Geometry.PLANE_STRAIN, material, (*driven, *sides))
        return [step.state.tau for step in march(scene, Schedule(accuracy=3e-4), CONTROL)]

    assert ends(way) == pytest.approx(ends(0.0), rel=1e-6)
    assert len(ends(0.0)) > 5
