"""An error in a solver of one's own, or an answer of another kind, ends a march with the state and that cause."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.conic.clarabel import Clarabel
from bipot.errors import IncrementFailed, SceneError
from bipot.forms import (
    Delassus,
    Dissipation,
    Newton,
)
from bipot.marching import Control, Schedule, march
from bipot.results.recorder import Recorder
from tests.scenes import scene


class Broken:
    """A solver of a user's own with an error in it."""

    def solve(self, program, accuracy, last=None):
        return {}["x"]


class Answerless:
    """One that forgets the handle."""

    def solve(self, program, accuracy, last=None):
        return Clarabel().solve(program, accuracy)[0]


class Given:
    """One that gives something else for parts of its answers."""

    def __init__(self, **parts):
        self.parts = parts

    def solve(self, program, accuracy, last=None):
        return replace(Clarabel().solve(program, accuracy)[0], **self.parts), None


class Precise:
    """One that gives numbers of more digits."""

    def solve(self, program, accuracy, last=None):
        answer, handle = Clarabel().solve(program, accuracy)
        return replace(answer, x=answer.x.astype(np.longdouble)), handle


class Factorless:
    """A linear solver with an error in it."""

    def factorise(self, transpose, panel):
        return {}["x"]


class Short:
    """One whose answers lack a number, and which is its own factors."""

    def factorise(self, transpose, panel):
        return self

    def solve(self, b):
        return b[:-1]


class Sweeps:
    """A solver of the discrete problem with an error in it."""

    name = "sweeps"

    def init(self, problem, r):
        raise KeyError(self.name)

    def step(self, problem, state):
        return state


@pytest.mark.parametrize(
    ("form", "said", "cause"),
    [
        (Dissipation(solver=Broken()), "Broken raised KeyError", KeyError),
        (Dissipation(solver=Answerless()), "Answerless raised SceneError", SceneError),
        (Dissipation(solver=Given(x=None)), "Given raised SceneError", SceneError),
        (Dissipation(solver=Given(dual={})), "Given raised SceneError", SceneError),
        (Delassus(Sweeps()), "Sweeps raised KeyError", KeyError),
        (Newton(linear=Factorless()), "Factorless raised KeyError", KeyError),
        (Newton(linear=Short()), "Short raised ValueError", ValueError),
    ],
    ids=["broken", "answerless", "placeless", "forceless", "sweeps", "factorless", "short"],
)
def test_an_error_in_a_solver_of_ones_own_is_the_cause_and_no_other_form_hides_it(form, said, cause, tmp_path):
    """It escaped bare, without state and history."""
    control, first = Control(form, (Newton(),)), next(march(scene(), Schedule(2)))

    def recorded():
        with Recorder(tmp_path / "run", scene(), (), {}, {}) as recorder:
            recorder.record(first)
            next(march(scene(), Schedule(2), control, first.course))

    with pytest.raises(IncrementFailed, match=rf"tau = 0.5 to 1 failed \(its solver {said}: .*\). Mend") as failed:
        recorded()
    assert failed.value.state is first.state
    assert len(failed.value.history) == 1
    assert type(failed.value.__cause__) is cause


class Formless:
    """A form of one's own that gives something else for parts of what Newton's gives, or raises an error."""

    name = Newton.name
    init = Newton().init

    def __init__(self, tell):
        self.tell = tell

    def step(self, iterate, r, state):
        step, state = Newton().step(iterate, r, state)
        return self.tell(step), state


@pytest.mark.parametrize(
    ("tell", "said"),
    [
        (lambda step: {}["x"], "KeyError: 'x'"),
        (lambda step: None, "SceneError: step = None: must be a Step"),
        (lambda step: replace(step, r=None), "SceneError: step.r = 'of type object': must be numbers"),
        (lambda step: replace(step, r=step.r[:-1]), r"SceneError: step.r = 'of shape \(\d+, 2\)': must be of shape"),
        (lambda step: replace(step, r=step.r[:1]), r"SceneError: step.r = 'of shape \(1, 2\)': must be of shape"),
    ],
    ids=["error", "nothing", "forceless", "short", "one"],
)
def test_an_error_in_a_form_of_ones_own_is_the_cause_and_no_other_form_hides_it(tell, said):
    """It escaped bare, or forces of one contact were taken for those of all."""
    first = next(march(scene(), Schedule(2)))
    with pytest.raises(IncrementFailed, match=rf"tau = 0.5 to 1 failed \(its form Formless raised {said}") as failed:
        next(march(scene(), Schedule(2), Control(Formless(tell), (Newton(),)), first.course))
    assert failed.value.state is first.state


@pytest.mark.skipif(np.can_cast(np.longdouble, np.float64), reason="this platform's numbers have no more digits")
def test_numbers_of_more_digits_are_no_answer():
    """They ended in a bare TypeError where a sparse matrix met them."""
    with pytest.raises(IncrementFailed, match=r"Precise raised SceneError: answer.x = .*of at most 64 bits"):
        next(march(scene(), Schedule(2), Control(Dissipation(solver=Precise()), ())))
