"""From which strain on a body has long yielded, by hand."""

import numpy as np
import pytest

from bipot import Geometry, Linear, Pressure, Schedule, Support, VonMises, march
from bipot.laws.von_mises import Elasticity
from bipot.marching import system_of
from bipot.yielding import follows_yield, is_past_yield, strain_of, yielded_strain
from tests.scenes import scene, tool

AT_YIELD = 300.0 / 210_000.0


@pytest.mark.parametrize(("geometry", "confined"), [(Geometry.PLANE_STRAIN, 1.2), (Geometry.AXISYMMETRIC, 1.0)])
def test_a_body_has_long_yielded_at_ten_times_its_yield_strain(geometry, confined):
    """A fifth farther in plane strain, twice as far after it has turned round, by its yield stress there."""
    material = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 1000.0))
    system = system_of(scene(geometry=geometry, material=material))
    assert yielded_strain(system, None) == pytest.approx(10 * confined * AT_YIELD)
    for peeq, harder in ((0.0, 1.0), (0.3, 2.0)):
        hardened = np.full_like(system.rest().peeq, peeq)
        assert yielded_strain(system, hardened) == pytest.approx(20 * confined * harder * AT_YIELD)


def increments(sinks, loads=()):
    """The increments of a block of unit height that a punch presses in two."""
    pressed = scene(tools=(tool(travel=(0.0, -sinks)),), loads=loads, supports=(Support("base", 1), Support("left", 0)))
    return [accepted.solved.iterate.increment for accepted in march(pressed, Schedule(2))]


def test_where_a_body_has_long_yielded_is_told_by_how_far_tools_go_from_each_other():
    """In each half by half the way, which is summed from rest."""
    far = 12 * AT_YIELD
    first, second = increments(1.01 * far)
    assert strain_of(first) == pytest.approx(1.01 * far / 2)
    assert not is_past_yield(first)
    assert is_past_yield(second)
    assert not follows_yield(second)
    first, second = increments(2.02 * far)
    assert is_past_yield(first)
    assert follows_yield(second)
    assert not any(map(is_past_yield, increments(0.99 * far)))


@pytest.mark.parametrize("path", [((0.0, 0.0), (1.0, 1.0)), ((0.0, 0.0), (2 / 3, 1.0), (1.0, 0.5))])
def test_only_the_second_increment_follows_yield(path):
    """The third goes on as long past it, or begins anew where the path has turned round."""
    pressed = scene(tools=(tool(travel=(0.0, -72 * AT_YIELD), path=path),))
    steps = march(pressed, Schedule(3, landings=(2 / 3,)))
    assert [follows_yield(step.solved.iterate.increment) for step in steps] == [False, True, False]


@pytest.mark.parametrize(("load", "past"), [((), True), ((Pressure("right", 1.0),), False)])
def test_where_nothing_but_a_load_strains_a_body_it_yields_to_the_end(load, past):
    assert [is_past_yield(increment) for increment in increments(0.0, load)] == [past] * 2
    assert np.array([strain_of(increment) for increment in increments(0.0, load)]).max() == 0.0
