"""The march: the exact solution without friction, the factors of `paper`, both forms alike, units, hardening."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from bipot.certificate import Bounds
from bipot.fem.elements import RULES
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, FormName, Tangent
from bipot.increment import Limits
from bipot.laws.hardening import Linear, Perfect, Swift, Tabulated, Voce
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.paper import upsetting
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
def histories(mu, elements=8):
    """Force, nodes and the increments of both forms at 45 %, fifteen uniform increments."""
    scene = upsetting(mu=mu, elements=elements)
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
    for accepted in histories(mu, 4)[form][1]:
        c = accepted.solved.certificate
        assert c.equilibrium <= 1e-6
        assert c.yield_violation <= 1e-6
        assert c.penetration <= 1e-10
        assert c.cone_violation <= 1e-8
        assert c.relative_gap <= 1e-7


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_energy_balance_closes_to_a_thousandth(mu):
    energies = histories(mu, 4)[FormName.TANGENT][1][-1].energies
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


def test_an_increment_is_shown_in_one_line():
    first = next(march(upsetting(mu=0.1, reduction=0.1, elements=1), Schedule(4)))
    shown = repr(first)
    assert shown.startswith(f"Accepted(1: tau=0.25, tangent, {first.passes} passes, forces=[[")
    assert len(shown) < 150
    assert repr(first.state) == "State(tau=0.25, 8 nodes, 4 candidates)"
    assert repr(first.course) == "Course(increment 1, State(tau=0.25, 8 nodes, 4 candidates))"
