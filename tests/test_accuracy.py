"""Increments by accuracy: the error is what was asked, at no more cost; nothing is lost by an interruption."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot.control.estimate import error_estimate
from bipot.control.landing import Locate
from bipot.control.pacing import BEGUN, CHEAPEST, QUICK, REFUSED, Pacer
from bipot.control.reason import ReasonKind
from bipot.errors import LimitPassed
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.flow import Integration
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.results import Existing, Recorder, columns
from bipot.results import open as open_results
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from studies.accuracy import paced
from studies.accuracy.paced import CONTROL
from studies.accuracy.paced_scenes import BACK, SCENES, STEEL, cylinder
from studies.upsetting_case import cases, parser
from tests.courses import March, Refusing, stored, unlike
from tests.scenes import refused


def run(scene, schedule, **options):
    return list(march(scene, schedule, CONTROL, **options))


@cache
def accurate(name, accuracy):
    """The march of the scene of that name."""
    return paced.run(SCENES[name](), Schedule(accuracy=accuracy))


QUICKLY = {("mu = 0.1", 1e-3), ("ring", 1e-3), ("ring", 1e-4), ("block", 1e-3), ("block", 1e-4), ("q4p0 block", 1e-3)}


def judged(name, accuracy):
    """The parameters, slow unless :data:`QUICKLY`."""
    return pytest.param(name, accuracy, marks=[] if (name, accuracy) in QUICKLY else [pytest.mark.slow])


@pytest.mark.parametrize(("name", "accuracy"), [judged(name, asked) for name in SCENES for asked in (1e-2, 1e-3, 1e-4)])
def test_the_error_is_what_was_asked(name, accuracy):
    """At most three times that; not below a third, but that none is coarser than the cheapest, nor on coarse meshes."""
    found = accurate(name, accuracy).error / accuracy
    assert found <= 3
    assert found >= 1 / 3 or accuracy > CHEAPEST or name.startswith("coarse")


def test_on_coarse_meshes_errors_of_increments_cancel():
    assert accurate("coarse mu = 0.1", 1e-3).error < accurate("mu = 0.1", 1e-3).error


@pytest.mark.parametrize(("name", "increments"), [("mu = 0.1", 9), ("block", 8), ("q4p0 ring", 8)])
def test_uniform_increments_of_that_error_cost_as_much(name, increments):
    """``increments`` is the least number whose error is not above that of the accuracy: fewer err more."""
    scene, by_accuracy = SCENES[name](), accurate(name, 1e-3)
    assert paced.run(scene, Schedule(increments - 1)).error > by_accuracy.error
    assert by_accuracy.passes <= paced.run(scene, Schedule(increments)).passes


def test_less_is_asked_at_no_more_cost():
    """Above the cheapest accuracy increments are not longer."""
    scene = cylinder(0.3, elements=5)
    assert paced.run(scene, Schedule(accuracy=1e-2)).passes <= paced.run(scene, Schedule(accuracy=1e-3)).passes


def test_it_lands_on_landings_kinks_and_the_end():
    steps = run(cylinder(0.1, elements=2, path=BACK), Schedule(accuracy=1e-3, landings=(0.123, 0.7)))
    assert {0.123, 0.5, 0.7, 1.0} <= {step.state.tau for step in steps}
    assert steps[-1].state.tau == 1.0


def test_the_estimate_halves_to_a_quarter_with_the_increments():
    """Where the solution is smooth: of order two."""
    scene = cylinder(0.1, elements=3)
    coarse, fine = (
        error_estimate(step.start, step.solved)
        for increments in (8, 16)
        for step in run(scene, Schedule(increments))
        if step.state.tau == 0.75
    )
    assert coarse / fine == pytest.approx(4, rel=0.2)


def test_without_a_body_that_yields_increments_grow_to_the_end():
    elastic = replace(cylinder(0.0, reduction=0.001, elements=2), material=Elastic(Elasticity(210_000.0, 0.3)))
    assert len(run(elastic, Schedule(accuracy=1e-3))) == 1


def pulled(traction):
    """A block held at its base and sheared by a traction; perfectly plastic, it carries 140 MPa but not 300."""
    held = (Support("base", 0), Support("base", 1))
    return Scene(
        block(2.0, 1.0, 2, 1, element=Element.Q8),
        Geometry.PLANE_STRAIN,
        STEEL,
        held,
        loads=(Traction("top", (traction, 0.0)),),
    )


def test_loads_alone_have_no_travel_to_begin_with():
    steps = run(pulled(140.0), Schedule(accuracy=1e-3))
    assert steps[-1].state.tau == 1.0
    assert steps[-1].state.peeq.any()
    assert 1 < len(steps) < 20


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-2, 1e-4])
def test_a_limit_load_ends_the_march(accuracy):
    """However short the increments are that follow yielding."""
    with pytest.raises(LimitPassed) as caught:
        run(pulled(300.0), Schedule(accuracy=accuracy))
    assert 0.99 < caught.value.fraction < 1
    assert caught.value.tau - caught.value.state.tau == pytest.approx(1e-3)
    assert f"of that at tau = {caught.value.tau:.6g}" in str(caught.value)


def test_what_is_too_wrong_is_solved_again_and_shorter():
    """A proposal from elsewhere that is far too long."""
    scene, schedule = cylinder(0.3, elements=3), Schedule(accuracy=1e-4)
    course = run(scene, schedule)[4].course
    step = next(march(scene, schedule, CONTROL, replace(course, proposed=0.5)))
    kinds = [reason.kind for reason in step.reasons]
    assert ReasonKind.ACCURACY in kinds
    assert error_estimate(step.start, step.solved) <= REFUSED * 1e-4
    assert step.passes > step.solved.passes


def test_the_length_follows_the_estimate():
    pacer = Pacer(1e-3)
    assert pacer.next(0.1, 1e-3) == pytest.approx(0.105)
    assert pacer.next(0.1, 4e-3) == pytest.approx(0.0525)
    finer = Pacer(1e-4).next(0.1, 1e-4)
    assert finer == pytest.approx(0.105 * 10**-0.03), "landings are of lower order"
    assert pacer.next(0.1, 0.0) == 0.2
    assert pacer.next(0.1, 0.0, QUICK + 1) == 0.1
    assert pacer.next(0.1, 1.0) == pytest.approx(0.02)
    assert pacer.next(1e-9, 1.0) == 1e-9, "rates are not lost in the round-off of pseudo-time"
    assert pacer.next(0.9, 0.0) == 1.0


MARCHES = {
    "landing located": March(cylinder(0.3, 0.2, 2), Schedule(accuracy=1e-3), replace(CONTROL, locate=Locate())),
    "unloading": March(cylinder(0.1, 0.1, 2, BACK), Schedule(accuracy=1e-3), CONTROL),
    "cuts": March(cylinder(0.3, 0.03, 2), Schedule(accuracy=1e-3), Control(Refusing(longest=0.3), ())),
}


@pytest.mark.parametrize("name", MARCHES)
def test_it_goes_on_from_every_course_to_the_last_bit(name):
    asked = MARCHES[name]
    whole = asked.run()
    seen = [asked.seen(step) for step in whole]
    assert len(whole) > 2
    assert any(step.cuts for step in whole) == (name == "cuts")
    for k, step in enumerate(whole[:-1]):
        assert unlike(seen[k + 1 :], [asked.seen(on) for on in asked.run(start=stored(step.course))]) == []


def test_it_goes_on_from_a_file_to_the_last_bit(tmp_path):
    scene, schedule = cylinder(0.3, 0.1, 2), Schedule(accuracy=1e-3)
    whole = run(scene, schedule)
    table = (columns.INCREMENT, columns.ERROR_ESTIMATE)
    for existing in (Existing.REFUSE, Existing.RESUME):
        with Recorder(tmp_path, scene, table, {}, {}, existing=existing) as recorder:
            for step in itertools.islice(march(scene, schedule, CONTROL, recorder.start), 2):
                recorder.record(step)
    history = open_results(tmp_path)
    expected = [error_estimate(step.start, step.solved) for step in whole[: len(history["increment"])]]
    assert len(expected) > 2
    np.testing.assert_array_equal(history["error_estimate"], expected)
    assert history.course(2).proposed == whole[2].course.proposed


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"accuracy": 0}, r"accuracy = 0.0: must be in \[0.0001, 0.1\]"),
        ({"accuracy": float("nan")}, "accuracy = nan: must be in"),
        ({"accuracy": 2}, "accuracy = 2.0: must be in"),
        ({"accuracy": -1e-3}, "accuracy = -0.001: must be in"),
        ({"accuracy": "1e-3"}, "accuracy = '1e-3': must be a number"),
        ({"accuracy": True}, "accuracy = True: must be a number"),
        ({"accuracy": 1e-3, "increments": 5}, "increments = 5: must be left out with an accuracy"),
        ({"accuracy": 1e-3, "first": 0.01}, "first = 0.01: must be left out with an accuracy"),
        ({}, "increments = None: must be given, unless an accuracy is"),
    ],
)
def test_bad_input_is_refused_by_name(options, words):
    refused(lambda: Schedule(**options), words)


def test_backward_euler_has_no_estimate():
    euler = Control(integration=Integration.BACKWARD_EULER)
    refused(lambda: march(cylinder(0.1, elements=1), Schedule(accuracy=1e-3), euler), "integration = 'backward Euler'")


def test_the_strain_of_the_paper_has_none_either():
    """Of order one in an increment: a cylinder was 6 % off at 1e-3."""
    scene = replace(cylinder(0.1, elements=1), configuration=Configuration.PAPER)
    refused(
        lambda: march(scene, Schedule(accuracy=1e-3)), "configuration = 'paper': must be 'midpoint' or 'small' with"
    )
    next(march(replace(scene, configuration=Configuration.SMALL), Schedule(accuracy=1e-2)))


def test_the_study_takes_an_accuracy_or_increments():
    (case,) = cases(parser().parse_args(["--mu", "0.1", "--accuracy", "1e-3", "--fast"]))
    assert case.schedule() == Schedule(accuracy=1e-3)
    both = parser().parse_args(["--mu", "0.1", "--accuracy", "1e-3", "--increments", "5"])
    refused(lambda: cases(both), "--increments has no effect")


def test_the_last_increments_are_longer_rather_than_one_more():
    """Equal parts of the rest, up to a quarter longer than proposed."""
    system = system_of(cylinder(0.1, elements=2))
    state = replace(system.rest(), tau=0.4)
    lengths = {ratio: Pacer(1e-3).length(system, state, 0.6 / ratio, 1.0) / 0.6 for ratio in (1.0, 1.2, 1.3, 2.2, 2.3)}
    assert lengths == pytest.approx({1.0: 1, 1.2: 1, 1.3: 1 / 2, 2.2: 1 / 2, 2.3: 1 / 3})


def test_whether_one_more_increment_is_saved_does_not_hang_on_round_off():
    """Where flow began the next one is shorter: the rest, as long as the last one, is longer by just a quarter."""
    system = system_of(cylinder(0.1, elements=2))
    for begun in np.random.default_rng(1).uniform(0.1, 0.9, 50).tolist():
        middle = (begun + 1) / 2
        length = Pacer(1e-3).length(system, replace(system.rest(), tau=middle), BEGUN * (middle - begun), 1.0)
        assert length == pytest.approx(middle - begun)


def test_the_first_increment_leaves_no_short_rest():
    """Before a mark it is up to a quarter longer, or half of the way where that is past first yield."""
    system = system_of(cylinder(0.1, elements=2))
    first = Pacer(1e-3).length(system, system.rest(), float("nan"), 1.0)
    lengths = {part: Pacer(1e-3).length(system, system.rest(), float("nan"), part * first) for part in (1.2, 1.5)}
    assert lengths == pytest.approx({1.2: 1.2 * first, 1.5: 0.75 * first})
    fine = Pacer(1e-4).length(system, system.rest(), float("nan"), 1.0)
    assert Pacer(1e-4).length(system, system.rest(), float("nan"), 1.5 * fine) == pytest.approx(fine)


def test_a_body_that_is_strained_unevenly_begins_with_shorter_increments():
    """A square with bands of shear beside a block; the estimate is made here of peeq and strain alone."""
    even, uneven = (run(SCENES[name](), Schedule(accuracy=1e-3))[0] for name in ("block", "square"))
    assert [reason.kind for reason in uneven.reasons] == [ReasonKind.ACCURACY]
    assert not even.reasons
    assert 0.35 * uneven.state.tau < 0.6 * 0.2 * even.state.tau, "both are one high"
    kin = uneven.solved.response.kinematics
    square = np.average(np.vecdot(kin.strain, kin.strain), weights=kin.volume)
    variance = np.cov(uneven.state.peeq.ravel(), aweights=kin.volume.ravel(), bias=True)
    assert error_estimate(uneven.start, uneven.solved) == pytest.approx(2.5 * (square / 12 + 0.4 * variance), rel=1e-6)
