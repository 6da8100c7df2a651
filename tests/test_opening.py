"""Which closed contacts rigid motions can open."""

from __future__ import annotations

import numpy as np
import pytest

from bipot.checks.determinacy import openable


def test_a_block_between_walls_opens_what_its_motion_along_them_opens():
    opened, v = openable(np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]]))
    assert opened.tolist() == [False, False, True]
    assert v == pytest.approx([0.0, 1.0], abs=1e-9) or v[1] > 1


def test_a_row_of_next_to_nothing_is_a_direction_as_any_other():
    """The solver gave up on it, unscaled."""
    normal = np.array(
        [
            [-0.124781126, 0.0694607752, 0.00802108219],
            [-0.0511771973, 0.0306508508, 0.00326156627],
            [-2.11260533e-09, 1.31928820e-09, 0.0],
            [-0.0822733926, -0.107988201, 0.00729166329],
            [-0.0399872687, -0.0499703483, 0.00351120296],
            [0.0103980757, 0.0123143760, -0.000904182242],
        ]
    )
    opened, v = openable(normal)
    assert opened.tolist() == [False, False, True, False, False, False]
    assert (normal @ v >= -1e-9 * np.abs(v).max()).all()


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_units_do_not_choose(scale):
    normal = np.array([[1.0, -2.0, 0.5], [0.3, 1.0, 0.0], [-1.0, -1.0, -0.2]])
    opened, _ = openable(normal)
    np.testing.assert_array_equal(openable(scale * normal)[0], opened)


def test_rows_that_are_nearly_one_direction_end_the_search_too():
    rng = np.random.default_rng(1)
    for _ in range(100):
        count, free = rng.integers(2, 9), rng.integers(1, 7)
        line = rng.normal(size=(count, 1)) * rng.normal(size=(1, free))
        found = openable(line + rng.normal(size=(count, free)) * 10.0 ** rng.uniform(-12, -1))
        assert found is None or (found[0].shape == (count,) and found[1].shape == (free,))
