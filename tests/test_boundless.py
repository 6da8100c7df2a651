"""Forces that two tools exchange at a node, of which no law says how large they are."""

import numpy as np
import pytest

from bipot import Control, Dissipation, IncrementFailed, Newton, Tangent, march
from studies.fuzz.scenes import draw

SCENE = draw(30001184)
"""A body without stress: one corner is welded to a tool and slides on a wall, which together press it as they may."""


@pytest.mark.parametrize("form", [Dissipation(), Tangent()])
def test_they_are_refused_where_they_hide_all_else(form):
    """A cone program ended with 8e8 in a body that yields at 2, and friction dissipated 5e6 of energy."""
    with pytest.raises(IncrementFailed, match="contacts press node 11 between them, and nothing says how much"):
        list(march(SCENE.scene, SCENE.schedule, Control(form, (), cuts=0)))


def test_newton_finds_none():
    *_, last = march(SCENE.scene, SCENE.schedule, Control(Newton(), ()))
    np.testing.assert_array_equal(last.state.forces, 0.0)
    assert last.energies.friction == 0.0
    assert last.solved.undetermined == ("forces at node 11",)
