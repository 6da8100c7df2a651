"""Tools that forces drive: a given load by every form against closed forms, collapse above the limit load, refusals."""

import csv
import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import (
    Bounds,
    Configuration,
    Control,
    Delassus,
    Dissipation,
    FlatTool,
    Force,
    Geometry,
    LimitPassed,
    Limits,
    Linear,
    Newton,
    Perfect,
    Quadrature,
    Scene,
    Schedule,
    Support,
    Tangent,
    UnboundedProgram,
    Voce,
    block,
    march,
    upsetting,
)
from bipot.checks.determinacy import branches
from bipot.fem.projection import VolumeChange
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from studies import hard_cases
from studies.hard_forms import FORMS
from studies.hard_loads import FACTORS, LIMIT_LOAD, Farkas, limit_scene, load_cases, loaded
from studies.hard_scenes import Outcome

YIELD_TRAVEL = 5.0 * 300.0 / 210_000.0
EXACT = (Newton(), Tangent(), Dissipation(), Delassus())
EACH = pytest.mark.parametrize("form", EXACT, ids=lambda form: form.name.value)
LOOSE = Limits()
TIGHT = Limits(Bounds(equilibrium=1e-9, law=1e-7, tool_equilibrium=1e-9))


def pushed(force, form=None, increments=1, limits=LOOSE, cuts=8, **options):
    """The last increment of the cylinder pressed by ``force`` (N) on its top, small strain unless said."""
    options = {"mu": 0.3, "elements": 2, "configuration": Configuration.SMALL} | options
    scene = upsetting(**options)
    punch = replace(scene.tools[0], travel=(0.0, 0.0), candidates=("top",), driven_by=Force((0.0, -force)))
    control = Control(form or Newton(), (), limits, cuts)
    *_, last = march(replace(scene, tools=(punch,)), Schedule(increments), control)
    return last


@EACH
@pytest.mark.parametrize("factor", [0.5, 0.9, 0.99])
def test_below_the_limit_load_the_force_is_reached_and_the_travel_elastic(form, factor):
    last = pushed(factor * LIMIT_LOAD, form, limits=TIGHT, mu=0.0)
    assert -last.tool_forces[0, 1] == pytest.approx(factor * LIMIT_LOAD, rel=1e-9)
    assert last.state.translation == pytest.approx([factor * YIELD_TRAVEL], rel=1e-7)
    assert last.solved.certificate.relative_gap <= 1e-7
    assert last.unique


@EACH
@pytest.mark.parametrize("factor", [0.5, 0.9, 0.99])
def test_a_rough_punch_reaches_its_force_by_every_form(form, factor):
    last = pushed(factor * LIMIT_LOAD, form, limits=TIGHT, increments=3)
    assert -last.tool_forces[0, 1] == pytest.approx(factor * LIMIT_LOAD, rel=1e-9)
    assert last.state.translation == pytest.approx(rough(factor), rel=1e-7)


@cache
def rough(factor):
    """The same force by a punch that goes the way the force took it: its own force and its way must agree."""
    way = float(pushed(factor * LIMIT_LOAD, increments=3, limits=TIGHT).state.translation[0])
    scene = upsetting(mu=0.3, elements=2, configuration=Configuration.SMALL)
    punch = replace(scene.tools[0], candidates=("top",), travel=(0.0, -way))
    *_, last = march(replace(scene, tools=(punch,)), Schedule(3), Control(Newton(), (), TIGHT))
    # Three equal increments of the way are not those of the force: the ends differ by the order of the flow.
    assert -last.tool_forces[0, 1] == pytest.approx(factor * LIMIT_LOAD, rel=2e-4)
    return [way]


@EACH
@pytest.mark.parametrize("factor", [1.01, 1.1])
def test_above_the_limit_load_every_form_ends_with_a_mechanism_that_passes_farkas(form, factor):
    scene = limit_scene(factor)
    with pytest.raises(UnboundedProgram, match="passes the limit load") as caught:
        list(march(scene, Schedule(1), Control(form, (), cuts=1)))
    assert isinstance(caught.value, LimitPassed)
    assert caught.value.fraction == pytest.approx(1 / factor, rel=1e-8)
    farkas = Farkas.of(scene, caught.value.ray, factor * LIMIT_LOAD)
    assert farkas.holds
    assert farkas.dissipated == pytest.approx(1 / factor, rel=1e-6)
    assert not Farkas.of(scene, caught.value.ray, 0.999 * LIMIT_LOAD).holds
    assert not Farkas.of(scene, -caught.value.ray, factor * LIMIT_LOAD).holds


def strip(factor, quadrature=Quadrature.GAUSS2):
    """Half of a rough strip punch of width 2 on a block: its corner is singular, and the force creeps up to the end.

    Prandtl's load (2 + pi) k on the half width 1; what the mesh carries is above that.
    """
    k = 100.0 / np.sqrt(3.0)
    mesh = block(4.0, 2.0, 8, 4, element=Element.Q8)
    edges = mesh.boundary("top")
    under = edges[(mesh.nodes[edges, 0] <= 1.0 + 1e-9).all(axis=1)]
    mesh = type(mesh)(mesh.nodes, mesh.elements, dict(mesh.boundaries) | {"punch": under})
    return Scene(
        mesh=mesh,
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(1e7, 0.3), Perfect(100.0)),
        supports=(Support("left", 0), Support("right", 0), Support("base", 1), Support("base", 0)),
        tools=(
            FlatTool(
                (0.0, 2.0),
                (0.0, -1.0),
                (0.0, 0.0),
                ("punch",),
                np.inf,
                driven_by=Force((0.0, -factor * (2 + np.pi) * k)),
            ),
        ),
        quadrature=quadrature,
        configuration=Configuration.SMALL,
        volume=VolumeChange.AS_IS,
    )


@cache
def carried():
    """What the singular punch's mesh carries over Prandtl's load, from a load far above it."""
    with pytest.raises(LimitPassed) as caught:
        list(march(strip(2.0), Schedule(1), Control(cuts=0)))
    return 2.0 * caught.value.fraction


def test_a_singular_punch_is_carried_up_to_its_limit_and_not_beyond():
    limit = carried()
    assert 1.0 < limit < 1.35
    *_, before = march(strip(0.9 * limit), Schedule(1), Control(Newton(), (Dissipation(),)))
    *_, last = march(strip(0.99 * limit), Schedule(1), Control(Newton(), (Dissipation(),)))
    assert 200 < last.state.translation[0] / before.state.translation[0] < 400
    assert -last.tool_forces[0, 1] == pytest.approx(0.99 * limit * (2 + np.pi) * 100 / np.sqrt(3), rel=1e-7)
    for factor in (1.01, 1.1):
        with pytest.raises(LimitPassed) as caught:
            list(march(strip(factor * limit), Schedule(1), Control(cuts=0)))
        assert caught.value.fraction == pytest.approx(1 / factor, rel=1e-7)


@pytest.mark.parametrize("factor", [0.5, 1.01, 1.3])
def test_with_hardening_the_limit_load_is_passed(factor):
    stress, strain = 300.0 * factor, max(0.0, factor - 1) * 300.0 / 1000.0
    last = pushed(factor * LIMIT_LOAD, mu=0.0, hardening=Linear(300.0, 1000.0))
    assert last.state.translation[0] / 5.0 == pytest.approx(stress / 210_000.0 + strain, rel=1e-7)


def test_a_hardening_that_saturates_has_the_limit_load_of_its_last_yield_stress():
    with pytest.raises(LimitPassed) as caught:
        pushed(1.5 * LIMIT_LOAD, cuts=0, mu=0.0, hardening=Voce(300.0, 100.0, 8.0))
    assert caught.value.fraction == pytest.approx(400.0 / 450.0, rel=1e-8)
    # The motion of the proof is that of the tool on which the load gains one.
    assert abs(caught.value.translation[0]) * 1.5 * LIMIT_LOAD == pytest.approx(1.0, rel=1e-6)


@pytest.mark.slow
def test_in_large_strain_the_force_is_that_of_the_grown_section():
    """F = sigma_Y pi R^2: the tool goes where the section has grown to the force (closed form, frictionless)."""
    scene = upsetting(mu=0.0, elements=2)
    punch = replace(scene.tools[0], travel=(0.0, 0.0), driven_by=Force((0.0, -42_815.427)))
    *_, last = march(replace(scene, tools=(punch,)), Schedule(200), Control(Newton(), ()))
    assert last.state.translation[0] / 5.0 == pytest.approx(0.45, rel=2e-4)


def test_a_gap_closes_first():
    scene = upsetting(mu=0.0, elements=2, configuration=Configuration.SMALL)
    punch = replace(
        scene.tools[0],
        point=(0.0, 5.5),
        travel=(0.0, 0.0),
        candidates=("top",),
        driven_by=Force((0.0, -0.5 * LIMIT_LOAD)),
    )
    *_, last = march(replace(scene, tools=(punch,)), Schedule(2))
    assert last.state.translation == pytest.approx([0.5 + 0.5 * YIELD_TRAVEL], rel=1e-9)


@pytest.mark.parametrize("units", [(1.0, 1.0), (1e-3, 1e6), (1e3, 1e-9)])
def test_units_do_not_matter(units):
    length, force = units
    stress = force / length**2
    scene = upsetting(
        mu=0.3,
        elements=2,
        height=10 * length,
        diameter=10 * length,
        young=210_000 * stress,
        hardening=Perfect(300 * stress),
        configuration=Configuration.SMALL,
    )
    push = Force((0.0, -0.9 * LIMIT_LOAD * force))
    punch = replace(scene.tools[0], travel=(0.0, 0.0), candidates=("top",), driven_by=push)
    *_, last = march(replace(scene, tools=(punch,)), Schedule(2))
    here = pushed(0.9 * LIMIT_LOAD, Tangent(), increments=2)
    assert last.state.translation / length == pytest.approx(here.state.translation, rel=1e-8)
    assert last.passes == here.passes


def test_two_tools_that_squeeze_a_body_nothing_else_holds_leave_it_a_place():
    scene = Scene(
        mesh=block(2.0, 2.0, 2, 2, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(1000.0, 0.3), Perfect(1e6)),
        supports=(Support("left", 0),),
        tools=tuple(
            FlatTool((0.0, y), (0.0, n), (0.0, 0.0), (name,), 0.1, driven_by=Force((0.0, 5.0 * n)))
            for y, n, name in ((2.0, -1.0, "top"), (0.0, 1.0, "base"))
        ),
        configuration=Configuration.SMALL,
    )
    *_, last = march(scene, Schedule(2), Control(Dissipation(), (Newton(),)))
    assert last.tool_forces[:, 1] == pytest.approx([-5.0, 5.0], rel=1e-7)
    assert any("position" in words for words in last.solved.undetermined)
    assert not last.unique


def test_the_work_of_a_force_is_that_of_its_tool_and_balances():
    last = pushed(0.9 * LIMIT_LOAD, increments=4)
    assert abs(last.energies.energy_error) < 1e-6
    # The mirror image below has a punch of its own.
    assert last.energies.work == pytest.approx(0.9 * LIMIT_LOAD * last.state.translation[0], rel=0.02)
    assert not branches(last.solved.iterate, last.solved.r)


def test_case_8_has_a_row_for_every_form():
    expected = [(f"8 {k} of the limit load", f) for k in FACTORS for f in FORMS]
    assert [(c.name, c.form) for c in load_cases(FORMS)] == expected
    assert not Farkas.of(limit_scene(1.1), np.zeros(limit_scene(1.1).mesh.nodes.shape), 1.0).holds
    assert loaded(1.1, next(iter(FORMS))).outcome is Outcome.UNBOUNDED


@pytest.mark.slow
def test_the_rows_of_case_8_are_written_as_expected(tmp_path):
    assert hard_cases.main(["--only", "8 ", "--out", str(tmp_path)]) == 0
    with (tmp_path / "hard_cases.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(FACTORS) * len(FORMS)
    assert not [(r["case"], r["form"]) for r in rows if r["as_expected"] == "False"]


def test_what_is_told_of_a_collapse_travels_between_processes():
    with pytest.raises(LimitPassed) as caught:
        pushed(1.1 * LIMIT_LOAD, cuts=0, mu=0.0)
    sent = pickle.loads(pickle.dumps(caught.value))
    assert (str(sent), sent.fraction, sent.tau) == (str(caught.value), caught.value.fraction, 1.0)
    np.testing.assert_array_equal(sent.ray, caught.value.ray)
    np.testing.assert_array_equal(sent.translation, caught.value.translation)
    np.testing.assert_array_equal(sent.state.nodes, caught.value.state.nodes)
