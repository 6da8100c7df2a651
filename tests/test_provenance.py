"""Where tables were made: every table of the repository has a row, a new one is of this machine and today."""

from datetime import date

import pytest

from bipot.errors import ResultsError
from studies import provenance, site_tables


def test_every_table_of_the_repository_has_a_row():
    assert sorted(provenance.stored(provenance.RESULTS)) == provenance.tables(provenance.RESULTS)


def test_a_table_made_here_is_of_this_machine_and_today(tmp_path):
    (tmp_path / "in").mkdir()
    for name in ("one.csv", "in/other.csv"):
        (tmp_path / name).write_text("a\n1\n")
    assert provenance.main(["one.csv", "--results", str(tmp_path)]) == 0
    (row,) = provenance.stored(tmp_path).values()
    assert (row.table, row.day, row.machine) == ("one.csv", date.today().isoformat(), provenance.machine())
    assert "numpy" in row.versions
    with pytest.raises(ResultsError, match=r"other\.csv: has no row"):
        site_tables.of_provenance(tmp_path)
    provenance.main(["in/other.csv", "--results", str(tmp_path)])
    head, rows = site_tables.of_provenance(tmp_path)
    assert [cells[0] for cells in rows] == ["[in/other.csv](results/in/other.csv)", "[one.csv](results/one.csv)"]
    assert all(len(cells) == len(head) for cells in rows)


def test_a_table_that_is_not_there_and_one_that_the_history_does_not_know_are_refused(tmp_path, capsys):
    (tmp_path / "new.csv").write_text("a\n1\n")
    with pytest.raises(SystemExit, match="2"):
        provenance.main(["none.csv", "--results", str(tmp_path)])
    assert provenance.main(["--from-history", "--results", str(tmp_path)]) == 2
    assert "not in the history" in capsys.readouterr().err
