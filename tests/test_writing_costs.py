"""What writing its files costs of a run of the study, in processor time and in bytes."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from benchmarks import writing

LARGEST = 3.0
"""Bytes of a file over those of the numbers that a march goes on from."""


@pytest.mark.serial
@pytest.mark.parametrize("form", writing.FORMS[::-1])
def test_writing_takes_a_tenth_of_a_run_at_most(form):
    with ProcessPoolExecutor(1, get_context("spawn")) as alone:
        found = alone.submit(writing.cost, form, 10, 45 if form == "newton" else 5).result()
    assert 0 < found.writing < found.march < found.process
    assert found.writing < writing.MOST * found.process
    assert found.bytes < LARGEST * found.state
