"""FCLIB files that are valid: by hand in every storage, by our writer, and through a writing that fails."""

import os
import subprocess
import sys

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import sparse

from bipot import coulomb
from tests.corpus import fclib

# Sums of few of them are in the range of a problem, whatever its units.
NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False).filter(lambda number: number == 0 or abs(number) >= 1e-50)


@st.composite
def matrices(draw, rows, columns):
    """Sparse ones, often with rows and columns of zeros."""
    there = draw(arrays(bool, (rows, columns)))
    return draw(arrays(float, (rows, columns), elements=NUMBERS)) * there


@st.composite
def problems(draw):
    """Local or global, in the plane or in space, of one to four contacts."""
    dim, contacts = draw(st.sampled_from((2, 3))), draw(st.integers(1, 4))
    rows = dim * contacts
    mu = draw(arrays(float, contacts, elements=st.floats(0, 10, allow_subnormal=False)))
    q = draw(arrays(float, rows, elements=NUMBERS))
    if draw(st.booleans()):
        return coulomb.CoulombProblem(draw(matrices(rows, rows)), q, mu, dim)
    dofs = draw(st.integers(1, 6))
    f = draw(arrays(float, dofs, elements=NUMBERS))
    return coulomb.GlobalCoulombProblem(draw(matrices(dofs, dofs)), draw(matrices(dofs, rows)), f, q, mu, dim)


def parts(problem):
    """Matrices and vectors by name."""
    names = ("W", "q") if isinstance(problem, coulomb.CoulombProblem) else ("M", "H", "f", "w")
    found = {name: getattr(problem, name) for name in (*names, "mu")}
    return {name: value.toarray() if sparse.issparse(value) else value for name, value in found.items()}


def same(one, other):
    assert type(one) is type(other)
    assert one.dim == other.dim
    for name, value in parts(one).items():
        np.testing.assert_array_equal(value, parts(other)[name], err_msg=name)


@pytest.mark.slow
@given(problems(), st.sampled_from(fclib.STORAGES), st.booleans())
def test_a_problem_comes_back_from_every_storage(tmp_path_factory, problem, storage, packed):
    folder = tmp_path_factory.mktemp("round")
    found = parts(problem)
    split = (
        {name: value for name, value in found.items() if value.ndim == 2},
        {name: value for name, value in found.items() if value.ndim == 1},
    )
    # Chunks cannot be made of no numbers.
    whole = packed and all(matrix.any() for matrix in split[0].values())
    options = {"chunks": (1,), "compression": "gzip", "shuffle": True, "fletcher32": True} if whole else {}
    same(coulomb.read_fclib(fclib.write(folder / "theirs.hdf5", problem.dim, *split, storage, **options)), problem)
    coulomb.write_fclib(folder / "ours.hdf5", problem)
    same(coulomb.read_fclib(folder / "ours.hdf5"), problem)


def small():
    return coulomb.CoulombProblem(np.eye(4), np.arange(4.0), [0.1, 0.2], 2)


def test_integers_and_single_floats_are_read_as_numbers(tmp_path):
    path = fclib.local(tmp_path / "a.hdf5")
    for value in (np.arange(6, dtype=np.uint16), np.arange(6, dtype=">f4")):
        with h5py.File(path, "a") as file:
            del file["fclib_local/vectors/q"]
            file["fclib_local/vectors/q"] = value
        np.testing.assert_array_equal(coulomb.read_fclib(path).q, np.arange(6.0))


def test_a_solution_that_was_only_declared_is_none(tmp_path):
    """Others declare r and v of a problem that they have not solved; HDF5 would give zeros."""
    path = fclib.both(tmp_path / "a.hdf5")
    with h5py.File(path, "a") as file:
        del file["solution/r"]
        file.create_dataset("solution/r", (4,), "f8")
    found = coulomb.read_solution(path)
    assert sorted(found) == ["u", "v"]
    np.testing.assert_array_equal(found["v"], np.ones(5))


@pytest.mark.parametrize(
    ("solution", "words"),
    [
        ({"r": np.ones(3)}, r"solution\['r'\] of shape \(3,\)"),
        ({"lambda": np.ones(4)}, r"solution\['lambda'\]"),
        ({"u": np.array([0.0, np.nan, 0.0, 0.0])}, r"solution\['u'\]"),
    ],
)
def test_a_solution_that_would_not_be_read_is_not_written(solution, words, tmp_path):
    with pytest.raises(coulomb.FclibError, match=words):
        coulomb.write_fclib(tmp_path / "a.hdf5", small(), solution=solution)
    assert list(tmp_path.iterdir()) == []


def test_a_larger_file_than_one_may_have_is_read_where_it_is_asked(tmp_path):
    path = fclib.local(tmp_path / "a.hdf5")
    with pytest.raises(coulomb.FclibError, match=r"p: its bytes = 56: must be at most 40"):
        coulomb.read_fclib(path, largest=40)
    assert coulomb.read_fclib(path, largest=288).contacts == 2


def no_folder(path):
    return path / "none" / "a.hdf5"


def file_as_folder(path):
    (path / "file").write_text("")
    return path / "file" / "a.hdf5"


def folder_as_file(path):
    (path / "a.hdf5").mkdir()
    return path / "a.hdf5"


def null(path):
    return f"{path}/a\0.hdf5"


@pytest.mark.parametrize("place", [no_folder, file_as_folder, folder_as_file, null])
def test_what_cannot_be_written_is_said(place, tmp_path):
    with pytest.raises(coulomb.FclibError, match="cannot be written"):
        coulomb.write_fclib(place(tmp_path), small())
    assert not [path for path in tmp_path.rglob("*") if path.suffix == ".part"]


@pytest.mark.skipif(os.name != "posix", reason="no pipes")
def test_a_pipe_or_device_is_not_replaced_by_a_file(tmp_path):
    os.mkfifo(tmp_path / "a.hdf5")
    for path in (tmp_path / "a.hdf5", "/dev/null"):
        with pytest.raises(coulomb.FclibError, match="cannot be written"):
            coulomb.write_fclib(path, small())
    assert (tmp_path / "a.hdf5").is_fifo()


def test_a_link_is_kept_and_its_file_replaced(tmp_path):
    (tmp_path / "to").mkdir()
    (tmp_path / "a.hdf5").symlink_to(tmp_path / "to" / "b.hdf5")
    coulomb.write_fclib(tmp_path / "a.hdf5", small())
    assert (tmp_path / "a.hdf5").is_symlink()
    same(coulomb.read_fclib(tmp_path / "to" / "b.hdf5"), small())


FULL = """
import resource, signal, sys
import numpy as np
from bipot import coulomb
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
try:
    coulomb.write_fclib(sys.argv[1], coulomb.CoulombProblem(np.ones((60, 60)), np.ones(60), 0.3, 3))
except coulomb.FclibError as error:
    print(error)
"""


@pytest.mark.skipif(os.name != "posix", reason="no limit of file sizes")
def test_a_writing_that_fails_keeps_the_file_that_was_there(tmp_path):
    """A disk that is full after some kilobytes."""
    path = tmp_path / "a.hdf5"
    coulomb.write_fclib(path, small())
    done = subprocess.run([sys.executable, "-c", FULL, str(path)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "cannot be written" in done.stdout
    assert list(tmp_path.iterdir()) == [path]
    same(coulomb.read_fclib(path), small())
