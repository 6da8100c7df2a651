"""What is concluded from the rows of ``speed_vs_error``, how it is told, and the tables of the comparison page."""

from dataclasses import fields, replace

import pytest

from bipot.errors import ResultsError
from studies import comparison_page, speed_vs_error
from studies.expected import Expected
from studies.speed_jobs import FAST, jobs
from studies.speed_tables import SOLVED, Row, fastest


def row(**changed):
    """A row of speed_vs_error: zero everywhere but where told."""
    kinds = {"str": "", "int": 0, "float": 0.0}
    blank = {f.name: kinds[str(f.type)] for f in fields(Row)}
    return Row(**{**blank, "mu": 0.1, "method": "penalty", "knob": "increments", "outcome": SOLVED, **changed})


def test_the_fastest_within_a_limit_is_found_and_what_others_lack_is_said():
    """Error 1/n: 200 increments reach 5e-3, so 1e-3 needs 1000 and 1e-5 100 000."""
    rows = [row(increments=n, curve_error=1 / n, seconds=float(n)) for n in (50, 100, 200)]
    rows += [row(method="newton", curve_error=1e-4, seconds=s, value=s) for s in (3.0, 2.0)]
    rows += [row(method="newton", curve_error=1e-4, seconds=1.0, outcome="failed: x")]
    found = {(f.family, f.limit): f for f in fastest(rows) if f.measure == "curve_error"}
    assert found["newton", 1e-3].value == 2.0
    short = found["penalty", 1e-3]
    assert (short.increments, short.error) == (200, 5e-3)
    assert short.order == pytest.approx(1)
    assert short.needed == pytest.approx(1000)
    assert found["penalty", 1e-5].needed == pytest.approx(1e5)


def test_long_rows_are_run_once():
    job = next(jobs(FAST))
    assert speed_vs_error.timed(job, replace(FAST, repeats=3)).runs == 3
    assert speed_vs_error.timed(job, replace(FAST, repeats=3, row=1e-6)).runs == 1


def test_what_is_left_follows_the_pace(monkeypatch):
    now = iter([10.0, 40.0])
    monkeypatch.setattr("studies.expected.time.perf_counter", lambda: next(now))
    clock = Expected(4.0)
    clock.done(3.0)
    assert str(clock) == "30 s gone, about 10 s left"


def test_the_fastest_of_nothing_is_said_so():
    assert fastest([]) == []


def test_the_pages_tables_are_those_of_the_results():
    for name, tables in comparison_page.PAGES.items():
        page = comparison_page.PAGE.with_name(name).read_text(encoding="utf-8")
        assert comparison_page.written(page, comparison_page.RESULTS, tables) == page


def test_a_table_without_a_place_or_results_is_refused(tmp_path):
    page = comparison_page.PAGE.read_text(encoding="utf-8")
    with pytest.raises(ResultsError, match="no place for the table optimisers"):
        comparison_page.written(page.replace("table: optimisers", ""), comparison_page.RESULTS)
    with pytest.raises(ResultsError, match=r"run: python -m studies\.optimisers"):
        comparison_page.written(page, tmp_path)


def test_a_table_without_a_row_is_refused(tmp_path):
    tables = {"a": comparison_page.tabled(lambda results: (["x"], []))}
    with pytest.raises(ResultsError, match="the table a has no row"):
        comparison_page.written("<!-- table: a -->\n<!-- end -->", tmp_path, tables)
