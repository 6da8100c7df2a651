"""The march: the exact solution without friction, the factors of `paper`, both forms alike, cuts, units, refusals."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from bipot import marching
from bipot.certificate import Bounds
from bipot.errors import IncrementFailed, NotConverged, SceneError
from bipot.fem.elements import RULES
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, FormName, Tangent
from bipot.increment import Limits
from bipot.laws.hardening import Linear, Perfect, Swift, Tabulated, Voce
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.scene.scene import upsetting
from tests.scenes import DIRECT, path

# Uniform upsetting by 45 %: closed form of the elastoplastic cylinder without friction (N, mm, 1).
EXACT_FORCE, EXACT_RADIUS, EXACT_VOLUME = 42815.427, 6.7400726, 0.9994287
BRACKET = (42815.427, 63050.0)


TANGENT = Control(DIRECT)


def force(accepted):
    return float(-accepted.tool_forces[0, 1])


def last(scene, schedule, control=TANGENT):
    *_, accepted = march(scene, schedule, control)
    return accepted


@pytest.fixture(scope="module")
def frictionless():
    scene = upsetting(mu=0.0)
    tight = Control(DIRECT, limits=Limits(Bounds(equilibrium=1e-11)))
    return scene, list(march(scene, Schedule(20), tight))


def test_frictionless_force_radius_and_volume_are_exact_to_1e_4(frictionless):
    _, accepted = frictionless
    assert len(accepted) == 20
    end = accepted[-1]
    assert force(end) == pytest.approx(EXACT_FORCE, rel=1e-4)
    assert end.state.nodes[:, 0].max() == pytest.approx(EXACT_RADIUS, rel=1e-4)
    volume = end.solved.response.kinematics.volume.sum() / (np.pi * 125)
    assert volume == pytest.approx(EXACT_VOLUME, abs=1e-4)


def test_frictionless_pressure_is_uniform(frictionless):
    _, accepted = frictionless
    end = accepted[-1]
    pressure = end.traction.recovered_pressure
    on_top = pressure[np.isfinite(pressure)]
    assert len(on_top) == 21
    np.testing.assert_allclose(on_top, on_top.mean(), rtol=1e-6)


@pytest.mark.parametrize(("increments", "volume", "force_factor"), [(10, 0.973860, 0.904), (45, 0.993939, 0.976)])
def test_paper_configuration_loses_the_two_factors(increments, volume, force_factor):
    """Closed form of the rigid-plastic law: volume falls by 3 e^2/4 an increment, and force by the area of x_n."""
    scene = upsetting(mu=0.0, elements=4, configuration=Configuration.PAPER)
    accepted = list(march(scene, Schedule(increments), Control(DIRECT)))
    end = accepted[-1]
    geometry = np.prod(end.state.nodes.max(axis=0) ** [2, 1]) / 125
    elastic = EXACT_VOLUME
    assert geometry / elastic == pytest.approx(volume, abs=1e-3)
    area = (accepted[-2].state.nodes[:, 0].max() / end.state.nodes[:, 0].max()) ** 2
    assert force(end) / EXACT_FORCE == pytest.approx(volume * area, abs=1e-3)
    assert force(end) / EXACT_FORCE == pytest.approx(force_factor, abs=1e-3)


@cache
def histories(mu):
    """Force, nodes and the increments of both forms at 45 %, 8 x 8, fifteen uniform increments."""
    scene = upsetting(mu=mu, elements=8)
    out = {}
    for form in (DIRECT, Dissipation()):
        accepted = list(march(scene, path(0.45, 15), Control(form)))
        out[form.name] = (scene, accepted)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_both_forms_agree_on_identical_increments(mu):
    _, tangent = histories(mu)[FormName.TANGENT]
    _, dissipation = histories(mu)[FormName.DISSIPATION]
    assert [a.state.tau for a in tangent] == [a.state.tau for a in dissipation]
    assert {a.form for a in dissipation} == {FormName.DISSIPATION}
    for a, b in zip(tangent, dissipation, strict=True):
        assert force(a) == pytest.approx(force(b), rel=1e-5)
        np.testing.assert_allclose(a.state.nodes, b.state.nodes, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_the_force_lies_in_the_rigorous_bracket(mu):
    _, tangent = histories(mu)[FormName.TANGENT]
    assert BRACKET[0] < force(tangent[-1]) < BRACKET[1]


@pytest.mark.parametrize("mu", [0.1, pytest.param(0.3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("form", [FormName.TANGENT, FormName.DISSIPATION])
def test_every_accepted_increment_is_certified(mu, form):
    for accepted in histories(mu)[form][1]:
        c = accepted.solved.certificate
        assert c.equilibrium <= 1e-6
        assert c.yield_violation <= 1e-6
        assert c.penetration <= 1e-10
        assert c.cone_violation <= 1e-8
        assert c.relative_gap <= 1e-7


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_energy_balance_closes_to_a_thousandth(mu):
    energies = histories(mu)[FormName.TANGENT][1][-1].energies
    spent = energies.elastic + energies.plastic + energies.friction
    assert energies.work == pytest.approx(spent, rel=2e-3)


def metres(mu, hardening=None):
    return upsetting(
        mu=mu,
        reduction=0.1,
        elements=4,
        height=0.01,
        diameter=0.01,
        young=210e9,
        hardening=Perfect(300e6) if hardening is None else hardening,
    )


@pytest.mark.parametrize("form", [DIRECT, Tangent(), Dissipation()])
def test_units_do_not_matter(form):
    """mm and MPa, m and Pa: positions by 1e3, forces alike, energies by 1e3, certificate of the same size."""
    pairs = zip(
        march(upsetting(mu=0.3, reduction=0.1, elements=4), path(0.1, 4), Control(form)),
        march(metres(0.3), path(0.1, 4), Control(form)),
        strict=True,
    )
    for mm, m in pairs:
        np.testing.assert_allclose(mm.state.nodes * 1e-3, m.state.nodes, atol=1e-6 * 5e-3)
        np.testing.assert_allclose(mm.solved.r, m.solved.r, atol=1e-6 * mm.solved.r.max())
        np.testing.assert_allclose(mm.state.peeq, m.state.peeq, atol=1e-6)
        np.testing.assert_allclose(mm.state.stress * 1e6, m.state.stress, atol=1e-6 * 3e8)
        for name in ("work", "elastic", "plastic", "friction"):
            joule = getattr(mm.energies, name) * 1e-3
            assert getattr(m.energies, name) == pytest.approx(joule, rel=1e-6, abs=1e-9)
        assert mm.passes == m.passes


@pytest.mark.parametrize(
    "curve", [Linear(300.0, 500.0), Voce(300.0, 100.0, 8.0), Tabulated((0.0, 0.1, 0.5), (300.0, 360.0, 400.0))]
)
def test_hardening_certified_and_forms_agree(curve):
    scene = upsetting(mu=0.1, reduction=0.1, elements=3, hardening=curve)
    ends = [last(scene, path(0.1, 4), Control(form, fallbacks=())) for form in (DIRECT, Dissipation())]
    assert force(ends[0]) == pytest.approx(force(ends[1]), rel=1e-6)
    assert force(ends[0]) > force(last(upsetting(mu=0.1, reduction=0.1, elements=3), path(0.1, 4)))


@pytest.mark.parametrize("curve", [Linear(300.0, 500.0), Swift(500.0, 0.02, 0.2)], ids=lambda c: type(c).__name__)
def test_frictionless_hardening_is_exact(curve):
    """F = sigma_Y(eps_p) pi R^2 of the homogeneous solution with logarithmic strain."""
    scene = upsetting(mu=0.0, reduction=0.3, elements=2, hardening=curve)
    end = last(scene, Schedule(40))
    total, young = -np.log(0.7), 210_000.0
    eps_p = brentq(lambda p: p + float(curve.yield_stress(p)) / young - total, 0, total, xtol=1e-15)
    stress = float(curve.yield_stress(eps_p))
    radius = 5 * np.exp(eps_p / 2 + 0.3 * stress / young)
    assert end.state.peeq.mean() == pytest.approx(eps_p, rel=1e-4)
    assert force(end) == pytest.approx(stress * np.pi * radius**2, rel=1e-4)


@pytest.mark.parametrize("rule", RULES[Element.Q8])
def test_other_rules_run(rule):
    scene = upsetting(mu=0.1, reduction=0.05, elements=3, quadrature=rule)
    end = last(scene, path(0.05, 2))
    assert 0.98 < force(end) / (300 * np.pi * end.state.nodes[:, 0].max() ** 2) < 1.1


def test_welded_is_stiffer_than_slipping_and_keeps_the_top_in_place():
    scene = upsetting(mu=np.inf, reduction=0.1, elements=4)
    end = last(scene, path(0.1, 4))
    top = scene.mesh.boundary_nodes("top")
    np.testing.assert_allclose(end.state.nodes[top, 0], scene.mesh.nodes[top, 0], atol=1e-12)
    loose = upsetting(mu=0.1, reduction=0.1, elements=4)
    assert force(end) > force(last(loose, path(0.1, 4)))
    assert end.energies.friction == pytest.approx(0.0, abs=1e-9)


def test_the_schedule_lands_exactly_and_starts_small_under_friction():
    times = path(0.45, 10).times()
    np.testing.assert_allclose(np.array(times[:5]) * 0.45, 0.001 * np.arange(1, 6))
    assert times[-1] == 1.0
    steps = np.diff(times)
    np.testing.assert_allclose(steps[-10:], steps[-1])
    assert np.all(steps[1:] >= steps[:-1] * (1 - 1e-12))
    assert Schedule(4).times() == [0.25, 0.5, 0.75, 1.0]
    landed = Schedule(10, landings=(0.44,)).times()
    assert 0.44 in landed
    assert len(landed) == 10


def test_a_failing_form_falls_back_and_says_so():
    """One pass is never enough for `tangent` here: every increment is then solved by the first fallback."""
    scene = upsetting(mu=0.1, reduction=0.01, elements=2)
    helpless = FailsAlways()
    for accepted in march(scene, Schedule(2, first=0.1), Control(helpless)):
        assert accepted.form is FormName.NEWTON
        assert accepted.reason.startswith("tangent: nothing doing")


class FailsAlways:
    """A form that never converges."""

    name = FormName.TANGENT
    init = DIRECT.init

    def step(self, iterate, r, state):
        raise NotConverged("nothing doing")


class FailsAbove:
    """The tangent form, refusing increments longer than ``limit``."""

    name = FormName.TANGENT
    init = DIRECT.init

    def __init__(self, limit):
        self.limit = limit

    def step(self, iterate, r, state):
        if iterate.increment.units.length > self.limit:
            raise NotConverged("too long")
        return DIRECT.step(iterate, r, state)


def test_cuts_are_recorded_and_the_schedule_is_still_met():
    scene = upsetting(mu=0.0, reduction=0.1, elements=2)
    accepted = list(march(scene, Schedule(2), Control(FailsAbove(0.1), fallbacks=())))
    taus = [a.state.tau for a in accepted]
    assert {0.5, 1.0} <= set(taus)
    assert accepted[0].cuts == 2
    assert accepted[0].reason == "tangent: too long; cut; tangent: too long; cut"
    assert accepted[0].state.tau == 0.125


def test_an_increment_that_fails_for_good_carries_the_state_and_advice():
    scene = upsetting(mu=0.0, reduction=0.1, elements=2)
    control = Control(FailsAlways(), fallbacks=(), cuts=2)
    with pytest.raises(IncrementFailed, match=r"from tau = 0 to .* failed \(.*nothing doing.*\)\. Use more") as caught:
        list(march(scene, Schedule(1), control))
    assert caught.value.state.tau == 0.0


def test_inversion_is_cut_with_the_reason():
    """45 % in one increment inverts nothing: it is certified or cut with its reason recorded."""
    scene = upsetting(mu=0.3, reduction=0.6, elements=2)
    accepted = list(march(scene, Schedule(1, first=0.001), Control(DIRECT)))
    assert accepted[-1].state.tau == 1.0
    assert all(a.reason for a in accepted if a.cuts)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Schedule(0), "increments = 0"),
        (lambda: Schedule(5, first=-0.1), "first = -0.1"),
        (lambda: Schedule(5, first=0.3), "start-up = 1.5"),
        (lambda: Schedule(5, first=1.5), r"first = 1.5: must be zero, or in \[1e-09, 1\)"),
        (lambda: Schedule(first=np.array([0.1, 0.2]), accuracy=1e-3), "first = array.*: must be a number"),
        (lambda: Schedule(5, growth=1.0), "growth = 1.0"),
        (lambda: Schedule(5, first=0.1, landings=(0.3,)), "landing = 0.3"),
        (lambda: Schedule(5, settling=0), "settling = 0"),
        (lambda: Control(cuts=-1), "cuts = -1"),
    ],
)
def test_bad_control_is_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_tighter_bounds_are_met_or_refused():
    scene = upsetting(mu=0.1, reduction=0.01, elements=2)
    tight = Limits(replace(Bounds(), equilibrium=1e-12))
    for accepted in march(scene, Schedule(1, first=0.1), Control(DIRECT, limits=tight)):
        assert accepted.solved.certificate.equilibrium <= 1e-12


@pytest.mark.parametrize("schedule", [Schedule(2), Schedule(accuracy=1e-3)])
def test_an_increment_that_never_succeeds_ends_where_a_pseudo_time_has_no_more_digits_to_halve(schedule, monkeypatch):
    """From 0.6 on, steps of 1e-7 halved fifty times would be of 1e-22: a sum that is rounded has none below 1e-16."""
    scene = upsetting(mu=0.0, elements=1)
    begun = next(march(scene, Schedule(1, landings=(0.6,)))).course
    ends = list[float]()

    def fails(increment, *_):
        ends.append(increment.tau)
        assert len(ends) < 120
        raise NotConverged("never")

    monkeypatch.setattr(marching, "solve_increment", fails)
    with pytest.raises(IncrementFailed, match="never"):
        next(march(scene, schedule, Control(DIRECT, (), cuts=50), replace(begun, size=1e-7, uncut=1e-7)))
    tried = list(dict.fromkeys(ends))
    assert len(tried) > 20
    assert all(0.6 < later < earlier for earlier, later in pairwise(tried))
