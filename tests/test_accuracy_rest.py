"""Increments by accuracy of a body whose tools rest: what round-off strains does not shorten them."""

from itertools import islice

import pytest

from bipot.marching import Schedule, march
from studies.accuracy.paced import CONTROL
from studies.fuzz.scenes import draw
from studies.fuzz.variants import variants

MOST = 25


@pytest.mark.parametrize("seed", [3, 28])
def test_a_body_that_rests_at_yield_takes_long_increments_in_all_its_forms(seed):
    """A lid presses it and rests from 0.6 on: there a point or two flow by round-off, in other units others."""
    scene = draw(seed).scene
    assert scene.kinks == (0.6,)
    for other in (scene, *(variant.scene for variant in variants(scene, seed))):
        ends = [step.state.tau for step in islice(march(other, Schedule(accuracy=1e-3), CONTROL), MOST)]
        assert ends[-1] == 1.0
        assert 1 <= sum(tau > 0.6 for tau in ends) < 8


def test_an_elastic_body_that_is_let_go_takes_no_increments_for_what_round_off_leaves_in_it():
    """A lid goes off it from 0.4 to 0.7: at the end there is no stress, and no work to measure one against.

    In two more increments nothing touches it.
    """
    seed = 36
    scene = draw(seed).scene
    assert scene.kinks == (0.4, 0.7)
    for other in (scene, *(variant.scene for variant in variants(scene, seed))):
        steps = list(march(other, Schedule(accuracy=1e-3), CONTROL))
        assert not steps[-1].state.peeq.any()
        pressed = [step for step in steps if step.start.forces.any() or step.state.forces.any()]
        assert [step.state.tau for step in pressed] == [0.4, 0.7, 1.0]
        assert len(steps) == 5
