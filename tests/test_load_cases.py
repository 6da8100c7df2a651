"""Closed forms and published numbers of bodies under loads, by the short form of the study."""

from studies import load_cases
from studies.tables import read_csv


def test_every_case_is_within_what_is_allowed(tmp_path):
    assert load_cases.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_csv(tmp_path / "load_cases.csv", "load_cases")
    assert {row["case"] for row in rows} == {"tube", "huge strain", "block", "shear lag"}
    assert len(rows) == 15


def test_a_difference_that_is_too_large_ends_with_exit_code_one(tmp_path, monkeypatch):
    monkeypatch.setattr(load_cases, "LIMIT", 1.01 * load_cases.LIMIT)
    assert load_cases.main(["--fast", "--out", str(tmp_path)]) == 1
