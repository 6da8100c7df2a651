"""FCLIB files of strangers: read as they stand where they are valid, refused in words where they are not."""

import os

import h5py
import numpy as np
import pytest

from bipot import coulomb
from bipot.hdf5.isolated import isolated
from tests.corpus import fclib, flips, whole
from tests.corpus.case import damaged
from tests.corpus.child import Outcome
from tests.corpus.hdf5 import longer_chunk, of_dataset, shared_chunks
from tests.corpus.refusals import MEGABYTES, SECONDS, refused

posix = pytest.mark.skipif(os.name != "posix", reason="measured by what POSIX tells of a process")


@posix
def test_files_that_are_none_are_refused(tmp_path):
    valid = fclib.local(tmp_path / "valid.hdf5")
    (tmp_path / "damaged").mkdir()
    answers = refused("bipot.coulomb:read_fclib", valid, list(damaged(valid, tmp_path / "damaged", whole.DAMAGES)))
    assert len(answers) == len(whole.DAMAGES)


@pytest.mark.slow
@posix
def test_fields_that_do_not_fit_are_refused(tmp_path):
    ways = {
        "local": (fclib.local, "rows", fclib.LOCAL, "read_fclib"),
        "global": (fclib.both, "rows", fclib.GLOBAL, "read_fclib"),
        "triplets": (fclib.local, "triplets", fclib.TRIPLETS, "read_fclib"),
        "solution": (fclib.local, "rows", fclib.SOLUTION, "read_solution"),
    }
    for name, (make, storage, table, reader) in ways.items():
        valid = make(tmp_path / f"{name}.hdf5", storage)
        (tmp_path / name).mkdir()
        refused(f"bipot.coulomb:{reader}", valid, list(fclib.cases(valid, tmp_path / name, table)))


@posix
@pytest.mark.parametrize("field", [pytest.param("fclib_local/W/x", marks=pytest.mark.slow), "fclib_local/vectors/mu"])
def test_datasets_that_are_not_what_they_should_be_are_refused(field, tmp_path):
    valid = fclib.local(tmp_path / "valid.hdf5")
    (tmp_path / "damaged").mkdir()
    answers = refused("bipot.coulomb:read_fclib", valid, list(of_dataset(valid, field, tmp_path / "damaged")))
    assert len(answers) > 40


@posix
def test_chunks_in_one_place_are_refused_once_they_declare_more_than_the_file(tmp_path):
    """A thousand entries of noise and 31 thousand that are alike."""
    rng, field, valid = np.random.default_rng(7), "fclib_local/W/x", tmp_path / "valid.hdf5"
    W = np.full((180, 180), 1e-3)
    W[:6] = rng.normal(size=(6, 180))
    vectors = {"q": np.ones(180), "mu": np.ones(60)}
    fclib.write(valid, 3, {"W": W}, vectors, chunks=(1024,), maxshape=(None,), compression="gzip")
    (tmp_path / "damaged").mkdir()
    damage = {"shared chunks": lambda path: shared_chunks(path, field)}
    answers = refused("bipot.coulomb:read_fclib", valid, list(damaged(valid, tmp_path / "damaged", damage, field)))
    assert all("bytes of its chunks" in answer.message for answer in answers.values())


@pytest.mark.slow
@posix
def test_chunks_of_another_size_than_declared_are_refused(tmp_path):
    """HDF5 would write beyond its buffer, and so end the process now or later."""
    valid, field = fclib.local(tmp_path / "valid.hdf5", chunks=(6,)), "fclib_local/W/x"
    (tmp_path / "damaged").mkdir()
    damages = {f"longer {k}": lambda path: longer_chunk(path, field) for k in range(5)}
    refused("bipot.coulomb:read_fclib", valid, list(damaged(valid, tmp_path / "damaged", damages, field)))


@pytest.mark.slow
@posix
def test_no_damaged_bytes_end_the_process_or_raise_what_is_no_error_of_this_package(tmp_path):
    """A short form of ``python -m tests.corpus.flips``."""
    for valid in flips.fclib_files(tmp_path):
        found = flips.flipped(valid, "bipot.coulomb:read_fclib", 80)
        assert found.bad == ()
        assert min(found.counts[Outcome.ACCEPTED], found.counts[Outcome.REFUSED]) > 5
        assert found.seconds < SECONDS
        assert found.megabytes < MEGABYTES


def test_newer_forms_are_read_in_a_process_of_their_own_alone(tmp_path):
    """Their metadata can be crafted to end the process that opens them."""
    with h5py.File(fclib.local(tmp_path / "old.hdf5", chunks=(6,), maxshape=(None,))) as old:
        for name in ("v108", "latest"):
            with h5py.File(tmp_path / f"{name}.hdf5", "w", libver=(name, name)) as new:
                new.attrs["made"] = 3
                group = new.create_group("fclib_local", track_order=True)
                for part in old["fclib_local"]:
                    old.copy(f"fclib_local/{part}", group)
                # In the newest form its chunks are an array that may grow.
                values = group["vectors"].pop("q")[()]
                group["vectors"].create_dataset("q", data=values, chunks=(2,), maxshape=(None,))
    assert coulomb.read_fclib(tmp_path / "v108.hdf5").contacts == 2
    with pytest.raises(coulomb.FclibError, match=r"latest\.hdf5: /fclib_local/vectors/q: version of its layout = 4"):
        coulomb.read_fclib(tmp_path / "latest.hdf5")
    assert coulomb.read_fclib(tmp_path / "latest.hdf5", isolated=True).contacts == 2


def ends(path):
    """A reader that never answers."""
    os.abort()


@pytest.mark.slow
def test_a_process_of_its_own_gives_the_same_problem_or_refusal(tmp_path):
    here, there = (coulomb.read_fclib(fclib.both(tmp_path / "a.hdf5"), isolated=apart) for apart in (False, True))
    np.testing.assert_array_equal(there.M.toarray(), here.M.toarray())
    np.testing.assert_array_equal(np.r_[there.w, there.mu], np.r_[here.w, here.mu])
    assert not there.w.flags.writeable
    with pytest.raises(coulomb.FclibError, match=r"none\.hdf5 cannot be read: there is none"):
        coulomb.read_fclib(tmp_path / "none.hdf5", isolated=True)


@posix
def test_what_ends_or_keeps_its_own_process_is_refused(tmp_path):
    with pytest.raises(coulomb.FclibError, match=r"a\.hdf5: reading it ended its process, exit code -6"):
        isolated(f"{__name__}:ends", tmp_path / "a.hdf5", coulomb.FclibError)
    with pytest.raises(coulomb.FclibError, match=r"2\.0: reading it takes more than 0\.5 s"):
        isolated("time:sleep", 2.0, coulomb.FclibError, seconds=0.5)
