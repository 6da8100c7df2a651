"""Attacks on tools that forces drive and on claims of collapse: nothing false is certified or claimed."""

import numpy as np
import pytest

from bipot import (
    Amplitude,
    Control,
    Delassus,
    Dissipation,
    Elasticity,
    FlatTool,
    Force,
    Geometry,
    IncrementFailed,
    LimitPassed,
    Limits,
    Newton,
    Perfect,
    Prescribed,
    Scene,
    SceneError,
    Schedule,
    Support,
    Tangent,
    Traction,
    VonMises,
    block,
    march,
    ring,
)
from bipot.meshes.elements import Element

ALLOY = VonMises(Elasticity(70_000.0, 0.33), Perfect(100.0))
CLAMPED = (Support("base", 0), Support("base", 1))
LEFT = (Support("left", 0),)
ALONE = [Tangent(), Dissipation(), Newton(), Delassus()]


def on_top(force=None, x=0.0, y=10.0, **changes):
    given = {"point": (x, y), "normal": (0.0, -1.0), "travel": (0.0, 0.0), "candidates": ("top",), "mu": 0.1}
    return FlatTool(**(given | {"driven_by": force and Force((0.0, -force))} | changes))


def body(supports=CLAMPED, tools=(), **more):
    return Scene(block(20.0, 10.0, 4, 2, element=Element.Q8), Geometry.PLANE_STRAIN, ALLOY, supports, tools, **more)


def last(scene, increments=3, control=None):
    return list(march(scene, Schedule(increments), control or Control()))[-1]


@pytest.mark.parametrize("motion", [1e-10, 1e-8, 1e-6])
def test_a_motion_that_does_not_matter_makes_no_limit_load(motion):
    """A hundredth of the yield stress was called above the limit: the program's units were those of the motion."""
    supports = (Support("base", 0), Prescribed("base", 1, motion))
    scene = body(supports, loads=(Traction("top", (0.5, -1.0)),))
    still = body((Support("base", 0), Support("base", 1)), loads=(Traction("top", (0.5, -1.0)),))
    by_program = last(scene, 1, Control(Dissipation(), ()))
    np.testing.assert_allclose(by_program.state.stress, last(still, 1).state.stress, atol=1e-3)
    with pytest.raises(IncrementFailed) as caught:
        last(scene, 1, Control(Newton(), (), Limits(passes=1), cuts=0))
    assert not isinstance(caught.value, LimitPassed)


@pytest.mark.parametrize("form", ALONE, ids=lambda form: form.name.value)
def test_forces_that_two_driven_tools_share_are_said_to_be_undetermined(form):
    found = last(body(tools=(on_top(1000.0), on_top(500.0))), control=Control(form, ()))
    assert found.tool_forces[:, 1] == pytest.approx([-1000.0, -500.0], rel=1e-6)
    assert not found.unique
    assert any(words.startswith("forces at node") for words in found.solved.undetermined)


def test_forces_at_nodes_that_supports_hold_under_a_driven_tool_are_undetermined_but_for_their_sum():
    mesh = block(20.0, 10.0, 4, 2, element=Element.Q8)
    top = mesh.boundary("top")
    mesh = type(mesh)(mesh.nodes, mesh.elements, {**mesh.boundaries, "part": top[:2]})
    held = (*CLAMPED, Support("part", 1))
    pulled = (Traction("right", (1.0, 0.0)),)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, ALLOY, held, (on_top(100.0),), loads=pulled)
    found = last(scene)
    assert found.tool_forces[0, 1] == pytest.approx(-100.0, rel=1e-7)
    assert not found.unique


@pytest.mark.parametrize("gap", [0.0, 1e-3, 1.0])
def test_a_driven_tool_lifts_a_body_through_a_gap_to_a_tool_that_stops_it(gap):
    lift = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.1, driven_by=Force((0.0, 200.0)))
    found = last(body(LEFT, (lift, on_top(y=10.0 + gap))))
    assert found.tool_forces[:, 1] == pytest.approx([200.0, -200.0], rel=1e-7)
    assert found.state.translation[0] == pytest.approx(gap, abs=2e-3)


def test_a_tool_in_the_air_is_no_collapse():
    scene = body((*LEFT, Support("base", 1)), (on_top(100.0, y=10.5),))
    with pytest.raises(IncrementFailed) as caught:
        last(scene, 1, Control(Newton(), (), Limits(passes=1), cuts=0))
    assert not isinstance(caught.value, LimitPassed)
    assert last(scene, 1).tool_forces[0, 1] == pytest.approx(-100.0, rel=1e-7)


def test_a_tool_that_rests_on_a_held_corner_is_carried_by_it():
    found = last(body((Support("left", 0), Support("left", 1)), (on_top(10.0),)))
    assert found.tool_forces[0, 1] == pytest.approx(-10.0, rel=1e-7)
    assert np.abs(found.state.stress).max() < 1e-9


def wall(force, amplitude):
    """A ring in a wall that presses it by its path and is pulled along it by a force."""
    return Scene(
        mesh=ring(5.0, 10.0, 10.0, 3, 4, element=Element.Q8),
        geometry=Geometry.AXISYMMETRIC,
        material=ALLOY,
        supports=(Support("base", 1), Support("top", 1)),
        tools=(
            FlatTool(
                (10.0, 0.0),
                (-1.0, 0.0),
                (-0.01, 0.0),
                ("side",),
                0.1,
                driven_by=Force((0.0, force), amplitude),
            ),
        ),
    )


@pytest.mark.parametrize("form", [Tangent(), Newton(), Delassus()], ids=lambda form: form.name.value)
def test_a_tool_dragged_by_friction_is_held_by_it_from_the_first_increment_on(form):
    found = last(wall(2900.0, Amplitude()), 4, Control(form, ()))
    assert found.tool_forces[0, 1] == pytest.approx(2900.0, rel=1e-7)
    assert found.tool_forces[0, 1] < 0.1 * -found.tool_forces[0, 0]
    with pytest.raises(IncrementFailed):
        last(wall(4000.0, Amplitude()), 4)


def test_a_driven_tool_that_starts_inside_the_body_is_refused():
    with pytest.raises(SceneError, match=r"tools\[0\].point .* not inside it by 1: a force drives it"):
        body(tools=(on_top(1000.0, y=9.0),))


@pytest.mark.parametrize("form", ALONE[:3], ids=lambda form: form.name.value)
def test_a_force_that_stays_moves_nothing_more(form):
    """The matrix was solved for the forces and not for their changes: their round-off moved contacts that rest."""
    jump = Amplitude(((0.0, 1.0), (1.0, 1.0)))
    pressed = body(tools=(on_top(driven_by=Force((0.0, -1000.0), jump)),))
    first, *others = march(pressed, Schedule(4), Control(form, ()))
    for step in others:
        assert step.tool_forces[0, 1] == pytest.approx(-1000.0, rel=1e-7)
        assert np.abs(step.state.du).max() < 1e-6 * np.abs(first.state.du).max()
