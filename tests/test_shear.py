"""The laws of constant shear and of Coulomb capped on a slab: measures, forms against each other, units, limits."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bipot import (
    Control,
    Delassus,
    Dissipation,
    Force,
    Linear,
    Newton,
    Penalty,
    Tangent,
    Uzawa,
    limit_load,
    march,
)
from bipot.certificate import Bounds
from bipot.checks.examined import Examined
from bipot.control.reason import ReasonKind
from bipot.errors import IncrementFailed, UnsuitedForm
from bipot.exchange import contact_problem
from bipot.forms import contact_penalty
from bipot.forms.newton import Reuse
from bipot.laws.coulomb import Status
from bipot.marching import system_of
from bipot.traction import tractions
from tests.scenes import refused
from tests.sheared import CONSTANT, INF, OROWAN, SHEAR, SHORT, SIGMA_Y, pressed, slab


def lengths_on_top(accepted):
    """Tributary lengths of the nodes (c,) that carry, from the edges of which both ends do.

    The numbers are this test's own: straight linear edges, halved.
    """
    contacts = accepted.solved.iterate.increment.system.candidates
    nodes = accepted.state.nodes
    carries = np.zeros(len(nodes), bool)
    carries[contacts.node[accepted.solved.r[:, 0] > 1e-6 * accepted.solved.r[:, 0].max()]] = True
    own = np.zeros(len(nodes))
    for name in ("top", "right"):
        edges = contacts.scene.mesh.boundary(name)
        for a, b in edges[carries[edges].all(axis=1)].tolist():
            own[[a, b]] += np.linalg.norm(nodes[b] - nodes[a]) / 2
    return own[contacts.node]


def test_a_slab_is_at_the_cap_in_part_and_on_the_cone_in_part():
    last = pressed(0.1, 0.23)[-1]
    r, cap = last.solved.r, last.solved.rows.cap
    slides = last.traction.status == Status.SLIP
    capped = slides & (0.1 * r[:, 0] > 1.01 * cap)
    on_cone = slides & (0.1 * r[:, 0] < 0.99 * cap)
    assert capped.sum() >= 2
    assert on_cone.sum() >= 2
    np.testing.assert_allclose(np.abs(r[capped, 1]), cap[capped], rtol=1e-7)
    np.testing.assert_allclose(np.abs(r[on_cone, 1]), 0.1 * r[on_cone, 0], rtol=1e-7)
    # The caps by hand: m k times half the lengths of the edges beside; to the outermost the side may add a part.
    outermost = np.argmax(last.state.nodes[last.solved.iterate.increment.system.candidates.node, 0] * (r[:, 0] > 0))
    inner = (r[:, 0] > 0) & (np.arange(len(r)) != outermost)
    np.testing.assert_allclose(cap[inner], 0.23 * SHEAR * lengths_on_top(last)[inner], rtol=1e-9)


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_the_measures_are_those_of_a_recomputation(law):
    """Cone, law and gap by plain formulas from forces, motion and caps of the last iterate, and of planted errors."""
    last = pressed(*law, Tangent())[-1]
    iterate = last.solved.iterate
    rho = iterate.increment.system.stiffness
    for planted in (0.0, 1e-3, -1e-2):
        r = last.solved.r.copy()
        worst = int(np.argmax(np.abs(r[:, 1])))
        r[worst, 1] *= 1 + planted
        cone, law_, gap, largest = 0.0, 0.0, 0.0, np.abs(r).max()
        for (r_n, r_t), (g, slip), cap, k in zip(r, iterate.motion, iterate.rows.cap, rho, strict=True):
            s = (cap if r_n > 1e-7 * largest else 0.0) if np.isinf(law[0]) else min(law[0] * r_n, cap)
            cone = max(cone, abs(r_t) - s, -r_n)
            y = r_t - k * slip
            off = r_n - max(r_n - k * g, 0.0), r_t - np.clip(y, -max(s, 0.0), max(s, 0.0))
            law_ = max(law_, float(np.hypot(*off)))
            gap += abs(r_n * g) + abs(s * abs(slip) + r_t * slip)
        found = Examined(iterate, r, largest, Bounds()).certificate
        assert found.cone_violation == pytest.approx(cone / largest, abs=1e-15)
        assert found.law == pytest.approx(law_ / largest, rel=1e-9, abs=1e-14)
        assert found.contact_gap == pytest.approx(gap, rel=1e-9, abs=1e-13)
        assert (found.law > 1e-6) == (planted != 0)


@pytest.mark.slow
@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_the_forms_agree(law):
    K = 200 * contact_penalty(system_of(slab(*law)).candidates)
    force = {}
    for form in (Newton(), Tangent(), Tangent(coupled=False), Dissipation(), Uzawa(K, K)):
        force[form] = -pressed(*law, form)[-1].tool_force(0)[1]
    newton = force[Newton()]
    assert not any(step.cuts for form in force for step in pressed(*law, form))
    np.testing.assert_allclose(list(force.values()), newton, rtol=1e-6)
    off = [abs(-pressed(*law, Penalty(k * K, k * K))[-1].tool_force(0)[1] / newton - 1) for k in (1, 10)]
    assert off[1] < 1e-5
    assert off[1] < 0.2 * off[0]


def test_the_discrete_coulomb_problem_does_not_take_a_cap():
    with pytest.raises(UnsuitedForm, match=r"tool\.shear"):
        contact_problem(pressed(*OROWAN)[-1])
    first = next(march(slab(*OROWAN), SHORT, Control(Delassus(), fallbacks=(Newton(),))))
    assert first.form is Newton.name
    assert any("tool.shear" in str(reason) for reason in first.reasons)
    with pytest.raises(IncrementFailed, match=r"tool\.shear.*\. Take another form, or give it fallbacks\.$"):
        next(march(slab(*OROWAN), SHORT, Control(Delassus(), fallbacks=(), cuts=1)))
    driven = replace(
        slab(*OROWAN), tools=(replace(slab(*OROWAN).tools[0], travel=(0.0, 0.0), driven_by=Force((0.0, -1.0))),)
    )
    refused(lambda: limit_load(driven), r"tools\[0\].shear = 0.4")


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_units_do_not_matter(law):
    """mm and MPa, m and Pa: forces per thickness."""
    force = [
        -list(march(slab(*law, scale=scale, stress=stress), SHORT))[-1].tool_force(0)[1] / (scale * stress)
        for scale, stress in ((1.0, 1.0), (1e-3, 1e6))
    ]
    assert force[1] == pytest.approx(force[0], rel=1e-9)


@pytest.mark.slow
def test_limits_of_the_laws():
    """m = 0 is no friction; a cap that is never reached is Coulomb's law; a large coefficient is constant shear."""
    force = {law: -pressed(*law)[-1].tool_force(0)[1] for law in ((0.0, INF), (INF, 0.0), (0.05, INF), (0.05, 1.0))}
    assert force[INF, 0.0] == pytest.approx(force[0.0, INF], rel=1e-12)
    assert force[0.05, 1.0] == pytest.approx(force[0.05, INF], rel=1e-9)
    steep, constant = (-pressed(mu, 0.3)[-1].tool_force(0)[1] for mu in (50.0, INF))
    assert steep == pytest.approx(constant, rel=1e-6)
    assert force[0.0, INF] < constant < -pressed(INF, 0.6)[-1].tool_force(0)[1]


@pytest.mark.parametrize("law", [(INF, 0.1), (INF, 0.3), (0.3, 0.4)])
@pytest.mark.parametrize("hardening", [None, Linear(SIGMA_Y, 1000.0)])
def test_newton_takes_few_passes_with_caps(law, hardening):
    """The caps are frozen in a pass, and what that leaves falls by more than a factor of ten from pass to pass.

    That is at most 3.6 passes an increment, where Coulomb's law takes 2.3 to 2.6, each with a factor of its own.
    """
    counts, falls, anew = [], list[float](), Control(Newton(reuse=Reuse(near=0.0)), fallbacks=())
    # Where p is about sigma_Y, m k is m p / sqrt 3.
    for mu, shear in ((min(law[0], law[1] / np.sqrt(3)), INF), law):
        off = dict[float, list[float]]()

        def watch(trial, off=off):
            seen = trial.certificate
            off.setdefault(trial.iterate.increment.tau, []).append(max(seen.equilibrium, seen.law))

        steps = tuple(march(slab(mu, shear, hardening), SHORT, anew, observe=watch))
        counts.append(sum(step.passes for step in steps))
        falls = [b / a for each in off.values() for a, b in pairwise(each) if 1e-13 < b and a < 1e-4]
    assert counts[0] <= 2.6 * len(steps)
    assert counts[1] <= 3.6 * len(steps)
    assert np.median(falls) < 0.1


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_recovered_shear_is_below_the_cap_for_any_forces(law):
    """With half as much friction again it is that of the law where this is capped."""
    solved = pressed(*law)[-1].solved
    contacts, rows, nodes = solved.iterate.increment.system.candidates, solved.iterate.rows, solved.iterate.balanced
    capped = np.abs(solved.r[:, 1]) > 0.999 * rows.cap
    _, shear = tractions(contacts, nodes, solved.r * (1.0, 1.5), solved.r[:, 0] > 0, rows)
    known = np.isfinite(shear) & capped
    assert known.sum() >= 2
    np.testing.assert_allclose(np.abs(shear[known]), law[1] * SHEAR, rtol=1e-9)


def test_a_form_that_is_not_suited_leaves_no_doubt_of_the_answer_of_the_next():
    """Only where a suited form strays may an answer be one of several."""
    taken = next(march(slab(*OROWAN), SHORT, Control(Delassus(), (Newton(),))))
    assert [reason.kind for reason in taken.reasons] == [ReasonKind.UNSUITED]
    assert not taken.strayed
    assert taken.unique
