"""The coupling of friction: its safeguard on maps, on small discrete problems, and inside increments."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.certificate import Bounds
from bipot.control.accepted import Accepted
from bipot.coulomb import CoulombProblem, enumerate_modes
from bipot.errors import IncrementFailed, SceneError
from bipot.forms import Dissipation, Tangent
from bipot.increment import Limits
from bipot.laws.coulomb import bipotential_gap
from bipot.marching import Control, march
from bipot.paper import upsetting
from bipot.programs.condensation import condense
from bipot.programs.conic import TangentProgram, couple, polish
from bipot.programs.fixed_point import Coupled, Coupling, Frozen, Mixing, Route, Safeguard
from bipot.programs.pieces import Law, Mapped, Pieces
from bipot.programs.terms import ContactTerms
from studies import coupling as study
from studies.hard_programs import DISCRETE, SETTLED, Small, coupled, passes_of
from studies.hard_scenes import Outcome
from studies.tables import read_csv
from tests.scenes import path, posed
from tests.test_programs import direct, relative, stated

PLAIN = Safeguard(falls=np.inf)
SHIFT = Safeguard(first=Frozen.SHIFT)
LOOSE, TIGHT = Bounds(equilibrium=5e-7), Bounds(equilibrium=1e-7, law=1e-7)
UNCOUPLED = Tangent(coupled=False)


def iterate(M: np.ndarray, rule: Safeguard, passes: int) -> tuple[int | None, Coupled]:
    """Passes of x <- M x + b until x is its fixed point (of positive entries) to 1e-9, None if it is not in time."""
    fixed = np.arange(1.0, len(M) + 1)
    coupling = Coupling.start(lambda _: np.zeros(len(M)), rule, second=False)
    for number in range(passes):
        if np.abs(coupling.value - fixed).max() <= 1e-9:
            return number, coupling.report
        x = coupling.value
        coupling = coupling.update(lambda _, x=x: M @ (x - fixed) + fixed)
    return None, coupling.report


def turn(degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


@pytest.mark.parametrize("factor", [0.1, 0.2, 0.5, -0.5])
def test_a_contraction_is_left_plain_and_its_factor_seen(factor: float) -> None:
    M = np.diag([factor, factor / 2])
    passes, seen = iterate(M, Safeguard(), 50)
    assert (passes, seen.route) == (iterate(M, PLAIN, 50)[0], Route.PLAIN)
    assert seen.contraction == pytest.approx(abs(factor), rel=0.05)
    assert seen.steps == passes


@pytest.mark.parametrize(
    "M",
    [np.array([[0.95]]), np.diag([0.9, 0.5, 0.1]), turn(60), turn(90) * 1.2, turn(120), np.diag([-2.0, 0.3])],
    ids=["slow", "slow modes", "6-cycle", "spiral out", "3-cycle", "swings out"],
)
def test_where_the_plain_iteration_crawls_or_cycles_the_safeguard_converges(M: np.ndarray) -> None:
    assert iterate(M, PLAIN, 60)[0] is None
    passes, _ = iterate(M, Safeguard(), 60)
    assert passes is not None
    assert passes <= 15


def test_a_swing_is_damped_and_damping_that_holds_back_is_dropped() -> None:
    swinging = Coupling.start(lambda _: np.array([1.0]))
    for target in (2.0, 1.0):
        swinging = swinging.update(lambda _, target=target: np.array([target]))
    assert swinging.value == pytest.approx(1.5)
    assert swinging.update(lambda _: np.array([1.5])).report.route is Route.DAMPED
    lagging = swinging
    for _ in range(2):
        lagging = lagging.update(lambda _: np.array([1.1]))
    assert lagging.update(lambda _: np.array([1.1])).report.route is Route.PLAIN


def test_anderson_begins_anew_where_the_residual_grows() -> None:
    """A map that changes under the iteration: the memory of the old one is dropped, not mixed in."""
    coupling = Coupling.start(lambda _: np.array([0.0, 0.0]), second=False)
    for _ in range(4):
        x = coupling.value
        coupling = coupling.update(lambda _, x=x: 0.9 * x + 0.1)
    assert coupling.mixing is Mixing.ANDERSON
    assert len(coupling.memory.points) > 1
    jumped = coupling.update(lambda _: np.array([50.0, 1.0]))
    assert len(jumped.memory.points) == 1


def test_the_sequence_changes_when_nothing_helps_and_waits_twice_as_long_to_change_back() -> None:
    rng = np.random.default_rng(0)
    coupling, changes = Coupling.start(lambda _: np.ones(3), Safeguard(patience=4)), list[int]()
    for number in range(1, 40):
        before = coupling.frozen
        coupling = coupling.update(lambda _: rng.uniform(1, 2, 3))
        changes += [number] if coupling.frozen is not before else []
    assert changes[0] >= 5
    assert changes[1] - changes[0] >= 9
    alone = Coupling.start(lambda _: np.ones(3), SHIFT, second=False)
    for _ in range(20):
        alone = alone.update(lambda _: rng.uniform(1, 2, 3))
    assert alone.shift is None


def test_welded_points_stay_and_no_threshold_becomes_negative() -> None:
    coupling = Coupling.start(lambda _: np.array([np.inf, 1.0]))
    np.testing.assert_array_equal(coupling.update(lambda _: np.array([np.inf, 2.0])).value, [np.inf, 2.0])
    assert (coupling.update(lambda _: np.array([np.inf, -1.0])).value >= 0).all()


def test_an_exact_pass_starts_the_fixed_point_anew() -> None:
    coupling = Coupling.start(lambda _: np.ones(2)).update(lambda _: np.array([2.0, 3.0]))
    anew = coupling.update(lambda _: np.array([5.0, 7.0]), exact=True)
    np.testing.assert_array_equal(anew.value, [5.0, 7.0])
    assert (anew.report.route, anew.report.steps, anew.memory.points) == (Route.EXACT, 1, ())


@pytest.mark.parametrize(
    ("field", "value"), [("falls", 0.0), ("patience", 0), ("depth", 0), ("least", 0.0), ("least", 1.5)]
)
def test_bad_safeguards_are_refused(field: str, value: float) -> None:
    with pytest.raises(SceneError, match=f"safeguard.{field}"):
        Safeguard(**{field: value})


@pytest.mark.parametrize(
    ("index", "expected"),
    [
        (0, np.array([4, -4, 11, 11]) / 137),
        (1, np.array([204, 204, 188, 188]) / 139),
        (2, np.array([20, 20, 11, 11]) / 228),
    ],
)
@pytest.mark.parametrize("rule", [Safeguard(), SHIFT], ids=["threshold", "shift"])
def test_cycling_fixed_points_converge_through_the_coupling_code(
    index: int, expected: np.ndarray, rule: Safeguard
) -> None:
    """Two published problems and one found by a search: the only solution, from either sequence, in 20 passes."""
    _, W, q, mu = DISCRETE[index]
    assert coupled(W, q, mu)[0] is Outcome.CERTIFIED
    small = next(small for small in islice(passes_of(W, q, mu, rule), 20) if small.distance <= SETTLED)
    np.testing.assert_allclose(small.r.ravel(), expected, atol=1e-8)
    (only,) = enumerate_modes(CoulombProblem(W=sp.csr_array(W), q=q, mu=np.full(2, mu), dim=2)).solutions
    np.testing.assert_allclose(only.r, expected, atol=1e-12)


@pytest.mark.parametrize(("index", "frozen"), [(1, Frozen.SHIFT), (2, Frozen.THRESHOLD)])
def test_the_plain_sequences_do_cycle_there(index: int, frozen: Frozen) -> None:
    _, W, q, mu = DISCRETE[index]
    last: list[Small] = list(islice(passes_of(W, q, mu, Safeguard(first=frozen, falls=np.inf)), 61))[-3:]
    np.testing.assert_allclose(last[0].r, last[2].r, atol=1e-8)
    assert np.abs(last[0].r - last[1].r).max() > 0.1 * np.abs(last[0].r).max()
    assert min(small.distance for small in last) > 1e-2
    assert last[-1].coupled.contraction == pytest.approx(1.0)


@cache
def exact() -> tuple[TangentProgram, np.ndarray, np.ndarray]:
    """The condensed program of one pass, its displacement and forces under Coulomb's law."""
    program = condense(posed(0.3).tangent).program
    found = couple(program.model, *direct(program))
    assert found is not None
    return program, *found


def frozen_at(program: TangentProgram, x: np.ndarray, factor: float) -> TangentProgram:
    rows = program.contact.rows
    return replace(program, contact=ContactTerms(rows, program.contact.threshold, factor * rows.shift(x)))


@pytest.mark.parametrize("route", [direct, stated])
def test_the_shifted_program_returns_the_law_where_its_shift_is_that_of_the_solution(route) -> None:
    program, x, r = exact()
    shifted = frozen_at(program, x, 1.0)
    other_x, other_r = polish(shifted, *route(shifted))
    assert relative(other_x, x) < 1e-10
    assert relative(other_r, r) < 1e-10


def test_both_routes_of_a_shifted_program_agree_and_without_shift_it_is_the_associated_law() -> None:
    """r . (g + du_n, du_t) = 0 there: sliding opens the contact, and friction dissipates nothing."""
    program, x, _ = exact()
    associated = frozen_at(program, x, 0.0)
    answers = [polish(associated, *route(associated)) for route in (direct, stated)]
    assert relative(answers[0][0], answers[1][0]) < 1e-7
    assert relative(answers[0][1], answers[1][1]) < 1e-7
    x, r = answers[0]
    motion = program.contact.rows.motion(x)
    assert np.abs(np.sum(r * motion, axis=1)).max() < 1e-12
    assert bipotential_gap(motion, r, 0.3).max() > 1e-4


@pytest.mark.parametrize("frozen", ["shift", "threshold"])
def test_laws_with_a_part_frozen_have_the_derivatives_they_say(frozen: str) -> None:
    program, x, r = exact()
    rows, rng, h = program.contact.rows, np.random.default_rng(1), 1e-7
    scale, shift, threshold = rng.uniform(1, 3, rows.count), rows.shift(x), rows.threshold(r)
    motion, force, along = rng.normal(size=(3, rows.count, 1 + rows.tangents))

    def at(motion: np.ndarray, force: np.ndarray) -> Law:
        if frozen == "shift":
            return Mapped.shifted_cone(rows, motion, force, scale, shift)
        return Pieces.of(rows, motion, force, scale, threshold=threshold)

    def law(a: float, b: float) -> np.ndarray:
        point = motion + a * along, force + b * along
        return at(*point).value(*point)

    found = at(motion, force)
    for ahead, behind, slope in (
        (law(h, 0), law(-h, 0), found.by_motion),
        (law(0, h), law(0, -h), found.by_force),
    ):
        np.testing.assert_allclose((ahead - behind) / (2 * h), np.einsum("cij,cj->ci", slope, along), atol=1e-6)


def run(mu: float, form: Tangent | Dissipation, rule: Safeguard, bounds: Bounds = LOOSE) -> list[Accepted]:
    scene = upsetting(mu=mu, reduction=0.05, elements=3)
    return list(march(scene, path(0.05, 3), Control(replace(form, safeguard=rule), (), Limits(bounds))))


@pytest.mark.parametrize(("mu", "factor"), [(0.1, 0.1), (0.3, 0.2)])
def test_the_contraction_of_the_design_is_seen(mu: float, factor: float) -> None:
    """Where an increment starts near its end the few steps show less of it."""
    seen = [accepted.solved.coupled for accepted in run(mu, UNCOUPLED, Safeguard())]
    assert {coupled.route for coupled in seen} == {Route.PLAIN}
    assert max(coupled.contraction for coupled in seen) == pytest.approx(factor, rel=0.35)
    assert min(coupled.steps for coupled in seen) >= 4


@pytest.mark.slow
def test_de_saxce_alone_gives_the_increments_of_the_threshold() -> None:
    """Point by point to 1e-6, each accepted with less than that."""
    by_threshold, by_shift = (run(0.3, UNCOUPLED, rule, TIGHT) for rule in (Safeguard(), SHIFT))
    assert {a.solved.coupled.route for a in by_shift} == {Route.DE_SAXCE}
    assert [a.state.tau for a in by_shift] == [a.state.tau for a in by_threshold]
    for one, other in zip(by_threshold, by_shift, strict=True):
        assert relative(other.solved.r, one.solved.r) < 1e-6
        moved = one.state.nodes - one.start.nodes
        assert np.abs(other.state.nodes - one.state.nodes).max() < 1e-6 * np.abs(moved).max()


@pytest.mark.slow
def test_de_saxce_alone_gives_the_force_of_the_threshold_with_plastic_strain_as_a_variable() -> None:
    """The force only: interior points alone leave single nodes the equilibrium that an increment is accepted with."""
    by_threshold, by_shift = (run(0.3, Dissipation(polished=False), rule) for rule in (Safeguard(), SHIFT))
    assert {a.solved.coupled.route for a in by_shift} == {Route.DE_SAXCE}
    forces = [[a.solved.r[:, 0].sum() for a in steps] for steps in (by_threshold, by_shift)]
    np.testing.assert_allclose(*forces, rtol=1e-6)


def test_a_failing_increment_says_how_friction_was_coupled() -> None:
    scene = upsetting(mu=0.3, reduction=0.05, elements=2)
    control = Control(UNCOUPLED, (), Limits(passes=4), cuts=0)
    with pytest.raises(IncrementFailed, match=r"coupling plain, contraction 0\.\d"):
        list(march(scene, path(0.05, 1), control))


def test_the_polish_with_exact_friction_leaves_nothing_to_the_fixed_point() -> None:
    steps = run(0.3, Tangent(), Safeguard())
    assert {a.solved.coupled.route for a in steps} == {Route.EXACT}
    assert np.isnan(steps[-1].solved.coupled.contraction)


@pytest.mark.slow
def test_the_study_shows_what_the_safeguard_adds(tmp_path: Path) -> None:
    assert study.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_csv(tmp_path / "coupling.csv", "")
    guarded = [row for row in rows if row["steps"] == "safeguarded"]
    assert len(guarded) == len(rows) / 2
    assert {row["outcome"] for row in guarded} == {"certified"}
    cycling = {(row["case"], row["sequence"]) for row in rows if row["outcome"] != "certified"}
    assert {
        ("threshold cycles", "threshold"),
        ("De Saxce cycles", "shift"),
        ("upsetting mu 10", "threshold"),
    } <= cycling
