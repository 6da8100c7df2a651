"""npz files of strangers where a conic program is asked for: refused in words, before they take time or memory."""

import os

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.conic.file import FileError
from bipot.conic.problem import Claim, Cone, ConicProgram, ConicSolution, Rows, Timing
from bipot.conic.stored import load
from tests.corpus import archives, flips, whole
from tests.corpus.case import damaged
from tests.corpus.child import Outcome as Read
from tests.corpus.refusals import MEGABYTES, SECONDS, refused

posix = pytest.mark.skipif(os.name != "posix", reason="measured by what POSIX tells of a process")


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    """Minimise x'x/2 - x_0 - x_1 with x_0 >= 2, and its answer."""
    path = tmp_path_factory.mktemp("program") / "valid.npz"
    rows = Rows("gap", Cone.NONNEGATIVE, sp.csr_matrix([[1.0, 0.0]]), np.array([-2.0]))
    program = ConicProgram(sp.csc_matrix(np.eye(2)), -np.ones(2), (rows,), {"x": slice(0, 2)})
    dual = {"gap": np.array([[1.0]])}
    program.save(path, ConicSolution(program, np.array([2.0, 1.0]), dual, Claim.SOLVED, 3, Timing()))
    return path


@posix
@pytest.mark.parametrize("damages", [whole.DAMAGES, archives.DAMAGES], ids=["whole", "archives"])
def test_damaged_files_are_refused(damages, valid, tmp_path):
    assert len(refused("bipot.conic.stored:load", valid, list(damaged(valid, tmp_path, damages)))) == len(damages)


@pytest.mark.slow
@posix
def test_no_damaged_bytes_end_the_process_or_raise_what_is_no_error_of_this_package(valid):
    found = flips.flipped(valid, "bipot.conic.stored:load", 400)
    assert found.bad == ()
    assert found.counts[Read.REFUSED] > 100
    assert found.seconds < SECONDS
    assert found.megabytes < MEGABYTES


TWO_WIDE = {"lengths": np.array([2]), "widths": np.array([2])}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"x": np.full(2, 1e200)}, "its answer has optimum"),
        ({"lengths": np.array([2**62] * 4 + [1]), "widths": np.ones(5, int)}, "do not fit together: widths has 5"),
        ({"lengths": np.array([2])}, "do not fit together: lengths"),
        ({"P_indptr": np.array([0, 1, 3])}, "do not fit together"),
        ({"P_indices": np.array([0, 2])}, "do not fit together"),
        ({"A_indices": np.array([-1])}, "do not fit together"),
        ({"starts": np.array([-1])}, "do not fit together: starts"),
        ({"seconds": np.zeros(7)}, "do not fit together"),
        ({"iterations": np.zeros(0, int)}, "do not fit together"),
        # Of (-4, 3) the first would make up for the second, as in a second-order cone.
        (
            {"b": np.array([-2.0, 5.0]), "z": np.ones(2), "A_indptr": np.array([0, 1, 1]), **TWO_WIDE},
            "do not fit together: width = 2: must be 1 in a nonnegative cone",
        ),
        # Px + q = A'z is then no stationarity of x'Px/2 + q'x.
        ({"P_indices": np.array([0, 0]), "P_data": np.array([1.0, 9.0])}, "do not fit together: P is not symmetric"),
        ({"P_indices": np.array([0, 0]), "P_indptr": np.array([0, 2, 2])}, "do not fit together: P has an entry twice"),
        ({"q": np.zeros(3)}, "P_indptr has 3 entries, must have 4, as q has 3"),
    ],
    ids=lambda given: "" if isinstance(given, str) else "-".join(given),
)
def test_numbers_that_do_not_fit_are_refused(changes, words, valid, tmp_path):
    with np.load(valid) as file:
        np.savez(tmp_path / "changed.npz", **{**file, **changes})
    with pytest.raises(FileError, match=words):
        load(tmp_path / "changed.npz")


def test_what_is_not_asked_for_is_not_read(valid, tmp_path):
    """Not even a pickle."""
    archives.member("other", archives.saved(np.array([{}], object)))(valid)
    assert load(valid)[1] is not None


def test_a_file_that_cannot_be_written_is_said(valid, tmp_path):
    program, _ = load(valid)
    with pytest.raises(FileError, match="cannot be written"):
        program.save(tmp_path / "none" / "a.npz")
