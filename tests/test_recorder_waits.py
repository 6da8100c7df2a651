"""Increments that wait to be put on disk together: all are there in the end, or those of the last time."""

import time
from contextlib import suppress

import numpy as np
import pytest

from bipot.errors import IncrementFailed, ResultsError
from bipot.hdf5 import journal
from bipot.results import Existing
from bipot.results import open as open_results
from tests.recording import arrays, complete, recorder, steps
from tests.scenes import refused


def numbers(folder):
    return open_results(folder)["increment"].tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    "ends", [None, IncrementFailed("no solution"), KeyboardInterrupt()], ids=["ends", "fails", "is stopped"]
)
def test_what_waits_is_on_disk_when_the_run_ends_however_it_does(ends, tmp_path):
    """And tells the same, to the last bit, as that of a run that puts each increment on disk."""
    late, every = tmp_path / "late", [one.number for one in steps()]
    with suppress(IncrementFailed, KeyboardInterrupt), recorder(late, patience=1e6) as out:
        for one in steps():
            out.record(one)
        assert numbers(late) == []
        assert out.start.number == every[-1]
        if ends is not None:
            raise ends
    one, other = open_results(late), open_results(complete(tmp_path / "early"))
    assert numbers(late) == every
    assert one.text == other.text == (late / "history.csv").read_bytes().decode()
    for k in range(len(every)):
        for a, b in zip(arrays(one.course(k).state), arrays(other.course(k).state), strict=True):
            np.testing.assert_array_equal(a, b)
        for name in ("mises", "contact_pressure", "status", "displacement"):
            np.testing.assert_array_equal(one.snapshot(k).nodal(name), other.snapshot(k).nodal(name))


def test_increments_wait_no_longer_than_asked(tmp_path):
    first, second, *_ = steps()
    with recorder(tmp_path, patience=0.05) as out:
        out.record(first)
        time.sleep(0.06)
        out.record(second)
        assert numbers(tmp_path) == [1, 2]


def test_what_waited_when_the_disk_was_full_is_gone_and_the_rest_is_gone_on_with(tmp_path, monkeypatch):
    first, second, third, *_ = steps()
    with recorder(tmp_path) as out:
        out.record(first)
    out = recorder(tmp_path, Existing.RESUME, patience=1e6)
    out.__enter__()
    out.record(second)
    out.record(third)
    monkeypatch.setattr(journal, "_put", full)
    with pytest.raises(ResultsError, match="increments up to 1 are recorded; make room"):
        out.__exit__(None, None, None)
    monkeypatch.undo()
    with recorder(tmp_path, Existing.RESUME) as out:
        assert out.start.number == 1
        out.record(second)
    assert numbers(tmp_path) == [1, 2]


@pytest.mark.parametrize("wrong", [-1.0, np.nan, np.inf, "long", None])
def test_patience_is_a_time(wrong, tmp_path):
    refused(lambda: recorder(tmp_path, patience=wrong), "patience")


def full(*_):
    raise OSError(28, "No space left on device")
