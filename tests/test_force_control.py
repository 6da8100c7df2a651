"""Force control: a given load by every form against closed forms, collapse above the limit load, and refusals."""

import csv
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.errors import NotConverged, SceneError, UnboundedProgram
from bipot.fem.strain import Configuration
from bipot.force_control import Seek, press, straight
from bipot.forms import Cache, Dissipation, FormName, Newton, Tangent
from bipot.increment import Limits, advance
from bipot.iterate import Increment
from bipot.laws.hardening import Linear
from bipot.marching import Attempt, Control, attempt_increment, system_of
from bipot.scene import upsetting
from studies import hard_cases
from studies.hard_forms import FORMS
from studies.hard_loads import load_cases, loaded, mechanism
from studies.hard_programs import LIMIT_LOAD, limit_scene
from studies.hard_scenes import Outcome

YIELD_TRAVEL = 5.0 * 300.0 / 210_000.0
DEFAULT = Limits()
EXACT = [name for name in FORMS if name is not FormName.PENALTY]


class Problem:
    """A scene at rest and the ends tried from it."""

    def __init__(self, scene, form=None, fallbacks=(), limits=DEFAULT):
        self.system = system_of(scene)
        self.state = self.system.rest()
        self.control = Control(Newton() if form is None else form, fallbacks, limits)
        self.cache, self.taus = Cache(), []

    def solve(self, tau):
        self.taus.append(tau)
        return attempt_increment(Increment(self.system, self.state, tau), self.control, self.cache, 0.0)

    def press(self, force, **options):
        return press(self.system, self.state, force, self.solve, **options)


def with_punch(scene, **changes):
    return replace(scene, tools=(replace(scene.tools[0], **changes),))


def small(**options):
    return with_punch(upsetting(elements=2, configuration=Configuration.PAPER, **options), candidates=("top",))


@pytest.mark.parametrize("name", EXACT, ids=lambda name: name.value)
def test_below_the_limit_load_the_travel_is_the_elastic_one(name):
    problem = Problem(limit_scene(), *FORMS[name](limit_scene()))
    found = problem.press(0.9 * LIMIT_LOAD)
    assert found.force == pytest.approx(0.9 * LIMIT_LOAD, rel=1e-9)
    assert found.solved.r[:, 0].sum() == pytest.approx(found.force, rel=1e-15)
    assert found.tau * 2.25 == pytest.approx(0.9 * YIELD_TRAVEL, rel=1e-6)
    assert found.solved.certificate.relative_gap <= 1e-7
    assert found.attempt.form is name


@cache
def hardened(force):
    """Linear hardening H from the limit load on: no collapse, and the travel in closed form."""
    return Problem(small(mu=0.0, hardening=Linear(300.0, 1000.0))).press(force)


@pytest.mark.parametrize("factor", [0.5, 1.01, 1.3])
def test_with_hardening_the_limit_load_is_passed(factor):
    stress, strain = 300.0 * factor, max(0.0, factor - 1) * 300.0 / 1000.0
    found = hardened(factor * LIMIT_LOAD)
    assert found.force == pytest.approx(factor * LIMIT_LOAD, rel=1e-9)
    assert found.tau * 2.25 / 5.0 == pytest.approx(stress / 210_000.0 + strain, rel=1e-7)


def test_forms_agree_where_part_of_the_body_yields():
    scene = small(mu=0.3)
    # The default bound on equilibrium, 5e-7, lets the forces of two forms differ by that.
    limits = Limits(Bounds(equilibrium=1e-10))
    taus = [Problem(scene, form, limits=limits).press(LIMIT_LOAD).tau for form in (Newton(), Tangent(), Dissipation())]
    elastic = taus[0] * 2.25 / YIELD_TRAVEL
    np.testing.assert_allclose(taus[1:], taus[0], rtol=1e-8)
    assert 0.9 < elastic < 1.5


def test_the_found_increment_is_the_one_solved_to_its_end():
    problem = Problem(small(mu=0.3))
    found = problem.press(LIMIT_LOAD)
    again = Problem(small(mu=0.3)).solve(found.tau)
    np.testing.assert_allclose(again.solved.r, found.solved.r, atol=1e-8 * np.abs(found.solved.r).max())
    assert found.tau in problem.taus
    assert found.passes >= len(problem.taus)


@pytest.mark.parametrize("name", EXACT, ids=lambda name: name.value)
def test_above_the_limit_load_every_exact_form_finds_a_mechanism(name):
    ended = loaded(1.1, name)
    assert ended.outcome is Outcome.UNBOUNDED, ended.said
    assert "collapse" in ended.said or "limit load" in ended.said


def test_the_collapse_is_told_in_words_and_its_ray_obeys_farkas():
    problem = Problem(limit_scene())
    with pytest.raises(UnboundedProgram, match=r"collapses: the force of tool 0 stays at 23561\.9449") as caught:
        problem.press(1.001 * LIMIT_LOAD)
    farkas = mechanism(problem.system, problem.state, caught.value.ray, 1.001)
    assert farkas.holds
    assert farkas.dissipated == pytest.approx(1 / 1.001, rel=1e-9)
    assert not mechanism(problem.system, problem.state, caught.value.ray, 0.999).holds
    assert not mechanism(problem.system, problem.state, -caught.value.ray, 1.001).holds


def test_an_elastic_motion_is_no_mechanism():
    problem = Problem(limit_scene())
    motion = problem.solve(1e-3).solved.response.x / 1e-3
    farkas = mechanism(problem.system, problem.state, motion, 1.1)
    assert farkas.volume > 1e-2
    assert not farkas.holds


def test_penalty_stands_still_but_its_motion_is_no_mechanism():
    """Its nodes still sink in, each by its own share of the force: what is left of that changes the volume."""
    ended = loaded(1.1, FormName.PENALTY)
    assert ended.outcome is Outcome.FAILED
    assert "stays at" in ended.said
    assert "not a mechanism" in ended.said


def test_a_gap_that_closes_is_no_collapse():
    scene = with_punch(small(mu=0.0), point=(0.0, 5.5))
    found = Problem(scene).press(0.5 * LIMIT_LOAD)
    assert found.tau * 2.25 == pytest.approx(0.5 + 0.5 * YIELD_TRAVEL, rel=1e-9)


def test_a_body_that_stiffens_is_not_called_a_collapse():
    """F = 10^6 tau^2 grows at first by far less than is missing."""
    problem = Problem(small(mu=0.0))

    def stiffening(tau):
        r = np.zeros((len(problem.system.candidates.node), 2))
        r[0, 0] = 1e6 * tau**2
        return SimpleNamespace(solved=SimpleNamespace(r=r), passes=1, failures=[])

    found = press(problem.system, problem.state, 1e5, stiffening)
    assert found.tau == pytest.approx(np.sqrt(0.1), rel=1e-9)


def test_a_path_too_short_is_not_called_a_collapse():
    scene = with_punch(small(mu=0.0), travel=(0.0, -0.5 * YIELD_TRAVEL))
    with pytest.raises(NotConverged, match="straight to tau = 1, where the force is 11780"):
        Problem(scene).press(0.9 * LIMIT_LOAD)


def test_the_search_keeps_to_the_straight_part_of_the_path():
    scene = with_punch(small(mu=0.0), path=((0.0, 0.0), (0.25, 1.0), (1.0, 0.5)))
    problem = Problem(scene)
    assert straight(problem.system, 0.0) == 0.25
    assert straight(problem.system, 0.25) == 1.0
    assert problem.press(0.9 * LIMIT_LOAD).tau * 4 * 2.25 == pytest.approx(0.9 * YIELD_TRAVEL, rel=1e-9)


def test_an_end_no_form_solves_is_backed_off_from():
    problem = Problem(small(mu=0.0))
    limit = 0.95 * YIELD_TRAVEL / 2.25
    tried = problem.solve

    def fragile(tau):
        return tried(tau) if tau < limit else Attempt(None, FormName.NEWTON, 1, ["newton: too far"])

    found = press(problem.system, problem.state, 0.9 * LIMIT_LOAD, fragile, how=Seek(doublings=2, retries=12))
    assert found.tau * 2.25 == pytest.approx(0.9 * YIELD_TRAVEL, rel=1e-9)
    with pytest.raises(NotConverged, match="too far"):
        press(problem.system, problem.state, 0.99 * LIMIT_LOAD, fragile)


def test_solves_are_limited():
    with pytest.raises(NotConverged, match="3 increments solved"):
        Problem(small(mu=0.0)).press(0.9 * LIMIT_LOAD, how=Seek(solves=3))


@pytest.mark.parametrize(
    ("force", "tool", "field"),
    [
        (0.0, 0, "force"),
        (-1.0, 0, "force"),
        (np.inf, 0, "force"),
        (np.nan, 0, "force"),
        (1.0, 1, "tool"),
        (1.0, -1, "tool"),
    ],
)
def test_bad_loads_are_refused(force, tool, field):
    with pytest.raises(SceneError, match=field):
        Problem(small(mu=0.0)).press(force, tool=tool)


def test_a_force_below_the_present_one_and_a_path_at_its_end_are_refused():
    problem = Problem(small(mu=0.0))
    solved = problem.solve(1e-3).solved
    problem.state = advance(problem.state, solved)
    with pytest.raises(SceneError, match="above the present"):
        problem.press(10.0)
    problem.state = replace(problem.state, tau=1.0)
    with pytest.raises(SceneError, match="before the end of the path"):
        problem.press(LIMIT_LOAD)


@pytest.mark.parametrize(
    "bad",
    [{"tolerance": 0.0}, {"doublings": 0}, {"still": 1.0}, {"flat": 0}, {"retries": -1}, {"solves": 0}],
    ids=lambda bad: next(iter(bad)),
)
def test_bad_searches_are_refused(bad):
    with pytest.raises(SceneError, match=f"seek.{next(iter(bad))}"):
        Seek(**bad)


def test_case_8_has_a_row_for_every_form():
    assert [(c.name[:5], c.form) for c in load_cases(FORMS)] == [(f"8 {k}", f) for k in (0.9, 1.1) for f in FORMS]


def test_the_rows_of_case_8_are_written_and_only_penalty_fails(tmp_path):
    assert hard_cases.main(["--only", "8 ", "--out", str(tmp_path)]) == 0
    with (tmp_path / "hard_cases.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 10
    assert {row["fallbacks"] for row in rows} == {"0"}
    assert [(r["case"][:5], r["form"]) for r in rows if r["as_expected"] == "False"] == [("8 1.1", "penalty")]
