"""Rules by which lengths of increments are accepted and proposed, by hand."""

import math

import pytest

from bipot.control.pacing import Pacer
from bipot.system import system_of
from tests.scenes import scene, tool


def test_coarser_accuracies_have_the_increments_of_the_cheapest():
    assert [Pacer(accuracy).aim for accuracy in (1e-4, 2e-3, 1e-2)] == [1e-4, 2e-3, 2e-3]
    assert Pacer(1e-2).next(0.1, 3e-3) == Pacer(2e-3).next(0.1, 3e-3)


def test_an_estimate_above_three_times_the_aim_is_refused():
    assert not Pacer(1e-3).refuses(2.99e-3)
    assert Pacer(1e-3).refuses(3.01e-3)
    assert Pacer(1e-1).refuses(6.01e-3)


def test_shortening_is_of_use_if_it_takes_three_tenths_off_the_estimate():
    assert Pacer(1e-3).is_cured(0.69, 1.0)
    assert not Pacer(1e-3).is_cured(0.71, 1.0)


def test_the_increment_after_one_in_which_flow_began_is_shorter():
    assert Pacer(1e-3).next(0.1, 0.0, begun=True) == pytest.approx(0.08)
    assert Pacer(1e-3).next(0.1, 4e-3, begun=True) == pytest.approx(0.0525)
    assert Pacer(1e-3).next(0.1, 0.0, passes=100, begun=True) == pytest.approx(0.08)


def test_a_first_increment_is_longer_than_the_round_off_of_time():
    """A tool that goes 1e12 heights strains the body by as much, of which its first strain is next to nothing."""
    system = system_of(scene(tools=(tool(travel=(0.0, -1e12)),)))
    assert Pacer(1e-3).length(system, system.rest(), math.nan, 1.0) == pytest.approx(1e-9, rel=1e-6)
