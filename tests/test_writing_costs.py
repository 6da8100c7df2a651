"""What writing its file costs of a run of the study, in processor time and in bytes."""

import pytest

from benchmarks import writing

MOST, LARGEST = 0.1, 3.0
"""Of the time of a run; of the bytes of the numbers that a march goes on from."""


@pytest.mark.serial
def test_writing_takes_a_tenth_of_a_run_at_most(tmp_path):
    found = writing.cost(writing.case("tangent", 10, 5), tmp_path / "run")
    assert found.increments > 5
    assert 0 < found.share < MOST
    assert found.bytes < LARGEST * found.state
