"""Marches with contact in weighted means in space: forms, certificate, derivatives, forces and what a run holds."""

from functools import cache

import numpy as np
import pytest

from bipot import (
    Control,
    Dissipation,
    Element,
    FlatTool,
    Force,
    Geometry,
    Mesh,
    Newton,
    Scene,
    Schedule,
    Tangent,
    brick,
    march,
)
from bipot.certificate import Certificate
from bipot.contact.overlap import overlap
from bipot.forms import Delassus, Penalty, contact_penalty
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.system import system_of
from studies.recovered import consistent_tractions
from tests.solids import turned
from tests.test_solid_sampling import PLANES, QUADRATIC, STEEL, TIGHT, WEIGHTED, WELDED, press, upset


@pytest.mark.parametrize("element", QUADRATIC)
def test_turning_the_whole_scene_changes_nothing(element):
    def pressed(Q):
        straight = brick(2.0, 2.0, 1.0, 2, 2, 1, element=element)
        mesh = Mesh(straight.nodes @ Q.T, straight.elements, straight.boundaries)
        tool = FlatTool(
            tuple(Q @ (0.0, 0.0, 1.0)),
            tuple(Q @ (0.0, 0.0, -1.0)),
            tuple(Q @ (0.01, 0.02, -0.02)),
            ("top", "right"),
            0.2,
            sampling=WEIGHTED,
        )
        *_, last = march(
            Scene(mesh, Geometry.SOLID, STEEL, WELDED, (tool,)), Schedule(2), Control(Newton(), limits=TIGHT)
        )
        return last

    Q = turned((0.3, -0.5, 0.8), 0.9)
    here, there = pressed(np.eye(3)), pressed(Q)
    np.testing.assert_allclose(there.tool_forces @ Q, here.tool_forces, atol=1e-9 * abs(here.tool_forces).max())
    np.testing.assert_allclose(there.state.nodes @ Q, here.state.nodes, atol=1e-9)
    on = np.isfinite(here.traction.recovered_pressure)
    assert (on == np.isfinite(there.traction.recovered_pressure)).all()
    for name in ("recovered_pressure", "recovered_shear"):
        one, other = (getattr(end.traction, name)[on] for end in (here, there))
        np.testing.assert_allclose(other, one, atol=1e-9 * 300.0)


@cache
def course(form, element=Element.H20):
    return list(march(upset(element), Schedule(3), Control(form, ())))


@pytest.mark.parametrize("form", [Tangent(), Dissipation(), Delassus()], ids=lambda form: form.name.value)
def test_forms_agree_and_the_certificate_holds(form):
    for newton, other in zip(course(Newton()), course(form), strict=True):
        assert other.tool_forces[0, 2] == pytest.approx(newton.tool_forces[0, 2], rel=1e-5)
        certificate: Certificate = other.solved.certificate
        assert max(certificate.law, certificate.cone_violation, certificate.relative_gap) < 1e-6


def test_the_penalised_form_comes_near():
    K = contact_penalty(system_of(upset()).candidates, 100.0)
    *_, soft = course(Penalty(K, K))
    assert soft.tool_forces[0, 2] == pytest.approx(course(Newton())[-1].tool_forces[0, 2], rel=2e-2)


def test_the_law_holds_in_the_mean_and_pressures_between_points_are_positive():
    last = course(Newton())[-1]
    candidates, r = last.solved.iterate.increment.system.candidates, last.solved.r
    closed = r[:, 0] > 0
    top = np.unique(candidates.number[0][candidates.points[0].point[: len(last.scene.mesh.boundary("top"))]])
    assert closed[top].all()
    pressure, shear = last.traction.recovered_pressure, last.traction.recovered_shear
    assert 150.0 < pressure[top].min() < pressure[top].max() < 600.0
    assert (shear[top] <= 0.2 * pressure[top] * (1 + 1e-12)).all()
    sliding = closed & candidates.tangent_free & (np.linalg.norm(last.solved.iterate.motion[:, 1:], axis=1) > 1e-5)
    assert sliding.sum() >= 4
    np.testing.assert_allclose(np.linalg.norm(r[sliding, 1:], axis=1), 0.2 * r[sliding, 0], rtol=1e-7)
    consistent = consistent_tractions(candidates, last.solved.iterate.balanced, r, closed)
    for one, other in zip(consistent, (pressure, shear), strict=True):
        np.testing.assert_allclose(one[top], other[top], rtol=1e-7, atol=1e-6)
    assert abs(last.energies.energy_error) < 0.02
    # What the means leave in between is little here, and told.
    placed = last.scene.placed(last.state.tau, last.state.translation)
    assert 0.0 < overlap(last.scene, last.state.nodes, placed) < 2e-3


@pytest.mark.parametrize("element", QUADRATIC)
def test_the_tangent_and_the_rows_are_the_derivatives(element):
    last = course(Newton(), element)[1]
    iterate, h = last.solved.iterate, 1e-6
    v = np.random.default_rng(2).normal(size=len(iterate.x)) * 1e-2
    ahead, back = (iterate.increment.at(iterate.x + s * h * v) for s in (1, -1))
    K = iterate.increment.system.body.space.matrix(iterate.tangent(last.solved.r))
    slope = (ahead.residual - back.residual) / (2 * h)
    np.testing.assert_allclose(K @ v, slope, atol=1e-5 * abs(slope).max())
    rows, moved = iterate.rows, (ahead.motion - back.motion) / (2 * h)
    np.testing.assert_allclose(rows.G_n @ v, moved[:, 0], atol=1e-9)
    np.testing.assert_allclose((rows.G_t @ v).reshape(-1, 2), moved[rows.frictional, 1:], atol=1e-9)


def test_a_force_presses_like_the_path_that_it_gives():
    def scene(travel, **given):
        tool = press(2.0, (0.0, 0.0, travel), sampling=WEIGHTED, **given)
        return Scene(brick(2.0, 2.0, 2.0, 1, 1, 1, element=Element.H20), Geometry.SOLID, STEEL, PLANES, (tool,))

    *_, driven = march(scene(-0.002), Schedule(1), Control(Newton()))
    force = Force((0.0, 0.0, float(driven.tool_force(0)[2])))
    *_, led = march(scene(0.0, driven_by=force), Schedule(1), Control(Newton()))
    np.testing.assert_allclose(led.state.nodes, driven.state.nodes, atol=1e-8)


def test_a_run_holds_the_multipliers_at_corners_and_the_forces_at_all_nodes(tmp_path):
    scene = upset()
    with Recorder(tmp_path, scene, (), {}, {}) as out:
        for increment in course(Newton()):
            out.record(increment)
    last = open_results(tmp_path).at()
    pressure, top = last.nodal("contact_pressure"), scene.mesh.boundary("top")
    assert (pressure[np.unique(top[:, :4])] > 0).all()
    assert np.isnan(pressure[np.unique(top[:, 4:])]).all()
    total = last.nodal("contact_force").sum(axis=0)
    np.testing.assert_allclose(total, course(Newton())[-1].tool_forces[0], rtol=1e-9)
