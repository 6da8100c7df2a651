"""Increments by accuracy: the error is what was asked, at no more cost; nothing is lost by an interruption."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import columns
from bipot.contact import carries
from bipot.elements import Element
from bipot.errors import LimitPassed
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.landing import Locate
from bipot.laws.flow import Integration
from bipot.laws.hardening import Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.loads import Traction
from bipot.marching import Control, march
from bipot.mesh import block, ring
from bipot.pacing import QUICK, REFUSED, Pacer, error_estimate
from bipot.reason import ReasonKind
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from bipot.scene import Scene, upsetting
from bipot.schedule import Schedule
from bipot.supports import Support, Symmetry
from bipot.tools import FlatTool
from studies.upsetting_case import cases, parser
from tests.courses import March, Refusing, stored, unlike
from tests.scenes import refused

STEEL = VonMises(Elasticity(210_000.0, 0.3), Perfect(300.0))
CONTROL = Control(Newton(), (Tangent(), Dissipation()))
FINER = 8
BACK = ((0.0, 0.0), (0.5, 1.0), (1.0, 0.9))


def cylinder(mu, reduction=0.3, elements=5, path=((0.0, 0.0), (1.0, 1.0))):
    scene = upsetting(mu=mu, reduction=reduction, elements=elements)
    return replace(scene, tools=(replace(scene.tools[0], path=path),))


def pressed_ring():
    tool = FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -0.5), ("top", "bore", "side"), 0.15)
    return Scene(
        ring(3.0, 6.0, 2.0, 6, 4, element=Element.Q8), Geometry.AXISYMMETRIC, STEEL, (Symmetry("base", 1),), (tool,)
    )


def pressed_block():
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.2), ("top", "right"), 0.2)
    planes = (Symmetry("base", 1), Symmetry("left", 0))
    return Scene(block(2.0, 1.0, 6, 3, element=Element.Q8), Geometry.PLANE_STRAIN, STEEL, planes, (tool,))


SCENES = {
    "mu = 0.1": lambda: cylinder(0.1),
    "mu = 0.3": lambda: cylinder(0.3),
    "ring": pressed_ring,
    "block": pressed_block,
    "unloading": lambda: cylinder(0.1, elements=4, path=BACK),
}


def run(scene, schedule, **options):
    return list(march(scene, schedule, CONTROL, **options))


def true_error(scene, steps):
    """The largest error of the force over the largest force, landings apart, against each increment in FINER parts."""
    ends = np.array([0.0, *(step.state.tau for step in steps)])
    parts = [tau for a, b in itertools.pairwise(ends) for tau in np.linspace(a, b, FINER + 1)[1:]]
    fine = run(scene, Schedule(1, landings=tuple(parts[:-1])))
    force = {step.state.tau: step.tool_forces[0, 1] for step in fine}
    touched = np.array([carries(step.solved.r) for step in fine])
    known = np.logical_or.accumulate(touched)
    landings = np.array([step.state.tau for step in fine[1:]])[(touched[1:] & ~known[:-1]).any(axis=1)]
    scale = max(map(abs, force.values()))
    return max(
        abs(step.tool_forces[0, 1] - force[step.state.tau]) / scale
        for step in steps
        if not ((landings > step.start.tau) & (landings <= step.state.tau)).any()
    )


def passes(steps):
    return sum(step.passes for step in steps)


@cache
def paced(name, accuracy):
    """True error and passes of the scene of that name."""
    scene = SCENES[name]()
    steps = run(scene, Schedule(accuracy=accuracy))
    return true_error(scene, steps), passes(steps)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("accuracy", [1e-3, 1e-4])
def test_the_error_is_what_was_asked(name, accuracy):
    assert 1 / 3 <= paced(name, accuracy)[0] / accuracy <= 3


@pytest.mark.parametrize(("name", "increments"), [("mu = 0.1", 7), ("mu = 0.3", 8), ("ring", 7)])
def test_uniform_increments_of_that_error_cost_as_much(name, increments):
    """``increments`` is the least number whose error is not above that of the accuracy: fewer err more."""
    scene = SCENES[name]()
    error, cost = paced(name, 1e-3)
    assert true_error(scene, run(scene, Schedule(increments - 1))) > error
    assert cost <= passes(run(scene, Schedule(increments)))


def test_less_is_asked_at_no_more_cost():
    """Above the cheapest accuracy increments are not longer."""
    scene = cylinder(0.3)
    assert passes(run(scene, Schedule(accuracy=1e-2))) <= passes(run(scene, Schedule(accuracy=1e-3)))


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


def test_a_limit_load_ends_the_march():
    with pytest.raises(LimitPassed):
        run(pulled(300.0), Schedule(accuracy=1e-3))


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
    pacer = Pacer(1e-4)
    assert pacer.next(0.1, 1e-4) == pytest.approx(0.105)
    assert pacer.next(0.1, 4e-4) == pytest.approx(0.0525)
    assert pacer.next(0.1, 0.0) == 0.2
    assert pacer.next(0.1, 0.0, QUICK + 1) == 0.1
    assert pacer.next(0.1, 1.0) == pytest.approx(0.02)
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
        ({"accuracy": 0}, r"accuracy = 0: must be in \[0.0001, 0.1\]"),
        ({"accuracy": float("nan")}, "accuracy = nan: must be in"),
        ({"accuracy": 2}, "accuracy = 2: must be in"),
        ({"accuracy": -1e-3}, "accuracy = -0.001: must be in"),
        ({"accuracy": "1e-3"}, "accuracy = '1e-3': must be a number"),
        ({"accuracy": True}, "accuracy = True: must be a number"),
        ({"accuracy": 1e-3, "increments": 5}, "increments = 5: must be left out with an accuracy"),
        ({"accuracy": 1e-3, "first": 0.01}, "first = 0.01: must be left out with an accuracy"),
        ({}, "increments = None: must be a whole number"),
    ],
)
def test_bad_input_is_refused_by_name(options, words):
    refused(lambda: Schedule(**options), words)


def test_backward_euler_has_no_estimate():
    euler = Control(integration=Integration.BACKWARD_EULER)
    refused(lambda: march(cylinder(0.1, elements=1), Schedule(accuracy=1e-3), euler), "integration = 'backward Euler'")


def test_the_study_takes_an_accuracy_or_increments():
    (case,) = cases(parser().parse_args(["--mu", "0.1", "--accuracy", "1e-3", "--fast"]))
    assert case.schedule() == Schedule(accuracy=1e-3)
    both = parser().parse_args(["--mu", "0.1", "--accuracy", "1e-3", "--increments", "5"])
    refused(lambda: cases(both), "--increments has no effect")
