"""Parts that contact, friction and loads alone hold, or nothing."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    BodyForce,
    Control,
    DeformableTool,
    Dissipation,
    Elasticity,
    Element,
    Geometry,
    IncrementFailed,
    LimitPassed,
    Newton,
    Perfect,
    Prescribed,
    Pressure,
    Scene,
    Schedule,
    Support,
    Symmetry,
    Traction,
    VonMises,
    block,
    limit_load,
    march,
    together,
)
from tests.deformable import ELASTIC, STEEL, shifted
from tests.scenes import refused

FORMS = [Newton(), Dissipation()]


def between(mu=0.2, press=-0.02, gaps=(0.0, 0.0), material=ELASTIC):
    """A free block between a held one and one that comes down, with these gaps below and above it."""
    below, above = gaps
    parts = {
        "low": block(2.0, 1.0, 4, 2),
        "free": shifted(block(1.0, 1.0, 3, 3), 0.5, 1.0 + below),
        "up": shifted(block(2.0, 1.0, 5, 2), 0.0, 2.0 + below + above),
    }
    held = Support("low/base", 0), Support("low/base", 1), Support("up/top", 0), Prescribed("up/top", 1, press)
    tools = (("low/top",), ("free/base",)), (("up/base",), ("free/top",))
    contacts = tuple(DeformableTool(*sides, mu) for sides in tools)
    return Scene(together(parts), Geometry.PLANE_STRAIN, material, held, contacts)


def on(*loads, mu=0.2, slope=0.0, material=ELASTIC):
    """A block under loads on a wider one, both on a ``slope``."""
    mesh = together({"low": block(2.0, 1.0, 4, 2), "free": shifted(block(1.0, 1.0, 3, 3), 0.5, 1.0)})
    c, s = np.cos(np.arctan(slope)), np.sin(np.arctan(slope))
    mesh = replace(mesh, nodes=mesh.nodes @ np.array([[c, s], [-s, c]]))
    held = Support("low/base", 0), Support("low/base", 1)
    tool = DeformableTool(("low/top",), ("free/base",), mu)
    return Scene(mesh, Geometry.PLANE_STRAIN, material, held, (tool,), loads=loads)


def last(scene, form, increments=3):
    *_, accepted = march(scene, Schedule(increments), Control(form, ()))
    return accepted


@pytest.mark.parametrize("form", FORMS)
def test_a_block_between_two_others_is_pressed_by_both_alike(form):
    accepted = last(between(), form)
    below, above = accepted.tool_forces
    np.testing.assert_allclose(below, -above, atol=1e-6 * below[1])
    assert below[1] > 1000.0
    # It stays in the middle, to which nothing but friction keeps it.
    moved = accepted.displacement[between().mesh.boundary_nodes("free/base", "free/top")]
    assert abs(moved[:, 0].mean()) < 1e-6 * np.abs(moved).max()


@pytest.mark.parametrize("form", FORMS)
def test_a_part_in_the_air_is_taken_along_and_pressed(form):
    """The upper block goes 0.06 to the free one, and this 0.02 to the lower one."""
    scene = between(press=-0.12, gaps=(0.02, 0.04))
    taken, free = [], scene.mesh.boundary_nodes("free/base")
    for accepted in march(scene, Schedule(6), Control(form, ())):
        below, above = accepted.tool_forces[:, 1]
        gone = 0.12 * accepted.state.tau
        assert (below > 1.0) == (gone > 0.06 + 1e-9)
        taken.append((round(gone, 9), -accepted.displacement[free, 1].mean()))
        assert below == pytest.approx(-above, abs=1e-3)
    np.testing.assert_allclose(dict(taken)[0.06], 0.02, atol=1e-9)
    assert dict(taken)[0.04] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("increments", [1, 2, 3, 5])
def test_without_friction_a_part_rests_in_the_dent_that_it_makes(increments):
    """Each configuration pushes the next one away from there."""
    scene = on(Pressure("free/top", 100.0), mu=0.0)
    accepted = last(scene, Newton(), increments=increments)
    assert accepted.tool_force(0)[1] == pytest.approx(100.0, rel=1e-3)
    moved = accepted.displacement[scene.mesh.boundary_nodes("free/base")]
    assert abs(moved[:, 0].mean()) < 1e-3 * np.abs(moved).max()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("slope", "mu"), [(0.3, 0.31), (0.3, 0.29)])
def test_a_block_rests_on_a_slope_as_steep_as_friction(form, slope, mu):
    scene = on(BodyForce((0.0, -10.0)), mu=mu, slope=slope)
    if mu > slope:
        np.testing.assert_allclose(last(scene, form).tool_force(0), (0.0, 10.0), atol=1e-3)
    else:
        with pytest.raises(LimitPassed, match="what friction holds"):
            last(scene, form)


def test_a_part_that_nothing_holds_is_named():
    with pytest.raises(IncrementFailed, match="Nothing holds the part of element 8 against moving along"):
        last(on(Pressure("free/top", -100.0)), Newton())


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("element", [Element.Q4, Element.Q8])
def test_the_limit_load_of_a_stack_is_that_of_a_column(element, mu):
    """2/sqrt(3) sigma_Y in plane strain."""
    mesh = together(
        {"low": block(1.0, 1.0, 4, 2, element=element), "up": shifted(block(1.0, 1.0, 3, 2, element=element), 0.0, 1.0)}
    )
    scene = Scene(
        mesh,
        Geometry.PLANE_STRAIN,
        VonMises(Elasticity(210e3, 0.3), Perfect(300.0)),
        (Symmetry("low/base", 1), Support("low/left", 0)),
        (DeformableTool(("low/top",), ("up/base",), mu),),
        loads=(Pressure("up/top", 100.0),),
    )
    assert limit_load(scene).multiple == pytest.approx(2 / np.sqrt(3) * 3.0, rel=1e-6)


def test_friction_holds_mu_times_what_presses():
    held, slides = (on(Traction("free/top", (along, -10.0)), material=STEEL) for along in (1.9, 2.5))
    np.testing.assert_allclose(last(held, Newton()).tool_force(0), (-1.9, 10.0), atol=1e-3)
    with pytest.raises(LimitPassed):
        last(slides, Newton())


def test_what_only_dents_hold_is_named():
    """Without friction a block under its own weight slides off the hill that it has made below it."""
    mesh = together({"low": block(3.0, 1.0, 9, 2), "up": shifted(block(1.0, 0.5, 4, 2), 1.0, 1.0)})
    held, tool = (Support("low/base", 0), Support("low/base", 1)), DeformableTool(("low/top",), ("up/base",), 0.0)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, held, (tool,), loads=(BodyForce((0.0, -1.0)),))
    with pytest.raises(IncrementFailed, match=r"Nothing but the dents .* part of element 18 against moving along"):
        list(march(scene, Schedule(5), Control(Newton(), ())))


def test_parts_with_a_common_node_are_refused():
    one, other = block(1.0, 1.0, 2, 2), shifted(block(1.0, 1.0, 2, 2), 1.0, 1.0)
    mesh = together({"one": one, "other": other})
    corner, twin = (int(np.flatnonzero((mesh.nodes == 1.0).all(axis=1))[k]) for k in range(2))
    joined = np.where(mesh.elements == twin, corner, mesh.elements)
    kept = np.delete(np.arange(len(mesh.nodes)), twin)
    number = np.searchsorted(kept, joined)
    bounds = {name: np.searchsorted(kept, np.where(of == twin, corner, of)) for name, of in mesh.boundaries.items()}
    touching = replace(mesh, nodes=mesh.nodes[kept], elements=number, boundaries=bounds, regions={})
    tool = DeformableTool(("one/top",), ("other/left",), 0.1)
    refused(
        lambda: Scene(
            touching, Geometry.PLANE_STRAIN, ELASTIC, (Support("one/base", 0), Support("one/base", 1)), (tool,)
        ),
        "in two parts",
    )
