"""FCLIB files of strangers: read as they stand where they are valid, refused in words where they are not."""

import os

import pytest

from tests.corpus import fclib, whole
from tests.corpus.case import damaged
from tests.corpus.child import Child, Outcome
from tests.corpus.hdf5 import of_dataset, shared_chunk

SECONDS, MEGABYTES = 1.0, 100.0
"""What the refusal of any file may take."""

posix = pytest.mark.skipif(os.name != "posix", reason="measured by what POSIX tells of a process")


def refused(reader, valid, cases):
    """Asserts that every case is refused in words; gives the answers."""
    with Child(reader, valid) as child:
        answers = {case: child.ask(case.path) for case in cases}
    wrong = {
        case.kind: answer
        for case, answer in answers.items()
        if answer.outcome is not Outcome.REFUSED
        or case.path.name not in answer.message
        or case.field not in answer.message
        or len(answer.message) > 600
        or answer.seconds > SECONDS
        or answer.megabytes > MEGABYTES
    }
    assert wrong == {}
    assert sum(answer.megabytes for answer in answers.values()) < MEGABYTES
    return answers


@posix
def test_files_that_are_none_are_refused(tmp_path):
    valid = fclib.local(tmp_path / "valid.hdf5")
    (tmp_path / "damaged").mkdir()
    answers = refused("bipot.coulomb:read_fclib", valid, list(damaged(valid, tmp_path / "damaged", whole.DAMAGES)))
    assert len(answers) == len(whole.DAMAGES)


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
@pytest.mark.parametrize("field", ["fclib_local/W/x", "fclib_local/vectors/mu"])
def test_datasets_that_are_not_what_they_should_be_are_refused(field, tmp_path):
    valid = fclib.local(tmp_path / "valid.hdf5")
    (tmp_path / "damaged").mkdir()
    answers = refused("bipot.coulomb:read_fclib", valid, list(of_dataset(valid, field, tmp_path / "damaged")))
    assert len(answers) > 40


@posix
def test_chunks_in_one_place_are_refused(tmp_path):
    valid = fclib.local(tmp_path / "valid.hdf5", chunks=(6,), compression="gzip")
    (tmp_path / "damaged").mkdir()
    damage = {"shared chunk": lambda path: shared_chunk(path, "fclib_local/W/x")}
    refused("bipot.coulomb:read_fclib", valid, list(damaged(valid, tmp_path / "damaged", damage, "fclib_local/W/x")))
