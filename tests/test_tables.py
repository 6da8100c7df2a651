"""Tables of studies: whole or not at all when they are written, refused by line and field where they are none."""

import math
import os

import pytest

from bipot.errors import ResultsError
from studies.tables import write_csv, write_hdf5
from tests.corpus import tables, whole
from tests.corpus.case import damaged
from tests.corpus.refusals import refused

posix = pytest.mark.skipif(os.name != "posix", reason="measured by what POSIX tells of a process")
MODULE = "tests.corpus.tables"


@posix
@pytest.mark.parametrize(
    ("reader", "kinds"),
    [pytest.param("read_csv", tables.TABLES, marks=pytest.mark.slow), ("read_rows", {**tables.TABLES, **tables.TYPED})],
    ids=["read_csv", "read_rows"],
)
def test_what_is_no_table_is_refused_by_line_and_field(reader, kinds, tmp_path):
    valid = tables.valid(tmp_path / "valid.csv")
    (tmp_path / "damaged").mkdir()
    cases = [case for field, all_ in kinds.items() for case in damaged(valid, tmp_path / "damaged", all_, field)]
    refused(f"{MODULE}:{reader}", valid, cases)


@posix
@pytest.mark.parametrize("reader", ["read_csv", "read_rows"])
def test_what_is_no_file_of_text_is_refused(reader, tmp_path):
    valid = tables.valid(tmp_path / "valid.csv")
    (tmp_path / "damaged").mkdir()
    # Half of a table is a table, and rows that are not there are none.
    kept = {"cut to a half", "cut to a tenth", "without its last tenth", "text"}
    kept |= {"missing", "link to itself"} if reader == "read_rows" else set()
    damages = {kind: damage for kind, damage in whole.DAMAGES.items() if kind not in kept}
    refused(f"{MODULE}:{reader}", valid, list(damaged(valid, tmp_path / "damaged", damages)))


def test_rows_come_back(tmp_path):
    first, second, third = tables.read_rows(tables.valid(tmp_path / "a.csv"))
    assert (first, third) == (tables.Row("newton", 10, 1.5), tables.Row('say "so"', 30, 2.5))
    assert (second.method, second.increments) == ("a, b", 20)
    assert math.isnan(second.force)
    assert tables.read_csv(tmp_path / "a.csv")[0] == {"method": "newton", "increments": 10, "force": 1.5}
    assert tables.read_rows(tmp_path / "none.csv") == []


def test_a_table_that_cannot_be_written_is_said_and_keeps_what_it_held(tmp_path):
    rows = [tables.Row("newton", 10, 1.5)]
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.csv").mkdir()
    for write in (write_csv, lambda path, rows: write_hdf5(path, rows, {})):
        for path in (tmp_path / "file" / "a.csv", tmp_path / "folder.csv"):
            with pytest.raises(ResultsError, match="cannot be written"):
                write(path, rows)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.csv"]
