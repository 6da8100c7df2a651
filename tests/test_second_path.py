"""Marches that begin at tau = 0 with a body that another path has left: nothing of that path goes on."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import (
    Amplitude,
    BodyForce,
    Elasticity,
    Geometry,
    Linear,
    Mesh,
    Prescribed,
    Scene,
    Schedule,
    Support,
    Traction,
    VonMises,
    block,
    march,
)

MATERIAL = VonMises(Elasticity(200e3, 0.3), Linear(300.0, 1000.0))
MESH = block(1.0, 1.0, 2, 2)
HELD = Support("base", 0), Support("base", 1)


def scene(mesh, *supports, loads=()):
    return Scene(mesh, Geometry.PLANE_STRAIN, MATERIAL, (*HELD, *supports), loads=loads)


@cache
def stretched():
    """The state of a block pulled far beyond yield, at the beginning of another path."""
    *_, end = march(scene(MESH, Support("top", 0), Prescribed("top", 1, 0.04)), Schedule(8))
    return replace(end.state, tau=0.0)


def test_the_flow_of_another_path_is_not_carried_on():
    """The second path shears what the first one stretched: flow turns, though at no corner of its own path."""
    start = stretched()
    sheared = scene(Mesh(start.nodes, MESH.elements, MESH.boundaries), Support("top", 1), Prescribed("top", 0, 0.04))
    forgotten = replace(start, length=0.0, flow=None)
    for given, alone in zip(*(march(sheared, Schedule(8), start=state) for state in (start, forgotten)), strict=True):
        np.testing.assert_array_equal(given.state.stress, alone.state.stress)
        np.testing.assert_array_equal(given.state.nodes, alone.state.nodes)
        assert given.passes == alone.passes


@pytest.mark.parametrize("load", [Traction("right", (20.0, 0.0)), BodyForce((0.0, -20.0))])
def test_the_work_of_loads_that_are_on_at_once_is_that_of_loads_that_grow_also_on_a_stressed_body(load):
    """Elastic work does not depend on the way, and a start that carries the load already takes up no more of it."""
    *_, free = march(scene(MESH), Schedule(1), start=stretched())
    start, at_once = replace(free.state, tau=0.0), Amplitude(((0.0, 1.0), (1.0, 1.0)))
    assert np.abs(start.stress).max() > 10.0
    (grown,) = march(scene(MESH, loads=(load,)), Schedule(1), start=start)
    loaded = scene(MESH, loads=(replace(load, amplitude=at_once),))
    (jumped,) = march(loaded, Schedule(1), start=start)
    assert jumped.energies.work == pytest.approx(grown.energies.work, rel=1e-9)
    assert abs(jumped.energies.energy_error) < 1e-3
    (stays,) = march(loaded, Schedule(1), start=replace(jumped.state, tau=0.0))
    assert abs(stays.energies.work) < 1e-6 * jumped.energies.work


@pytest.mark.parametrize("part", [0.0, 0.2, 0.6, 1.4, 2.0])
def test_loads_that_are_on_at_once_take_over_from_those_of_the_path_before(part):
    """Elastic: the start carries the whole load; its work is stored, and given back where the new load is smaller."""
    load = Traction("top", (0.0, 100.0))
    (full,) = march(scene(MESH, loads=(load,)), Schedule(1))
    loads = (replace(load, amplitude=Amplitude(((0.0, part), (1.0, part)))),) if part else ()
    (after,) = march(scene(MESH, loads=loads), Schedule(1), start=replace(full.state, tau=0.0))
    assert after.energies.work == pytest.approx((part**2 - 1) * full.energies.work, rel=3e-3)
    assert abs(after.energies.energy_error) < 3e-3
