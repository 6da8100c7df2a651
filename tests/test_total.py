"""The study of the total error in fast mode: deck for CalculiX, rows with and without it, errors, ratios, figure."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from bipot.errors import ResultsError
from paper_figs import fig_total_error
from studies.accuracy import calculix, total, total_tables
from studies.accuracy.alone import run
from studies.accuracy.choice import FOREIGN, OWN, Choice, Pace
from studies.accuracy.deck import FACES, NODES, Deck
from studies.accuracy.limits import Limit
from studies.accuracy.spent import Ended, ended
from studies.accuracy.total_plan import FAST, Plan
from studies.accuracy.total_row import MARKS, SOLVED, Ratio, Row, errors, front, key, limits_of, ratios
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"
LIMITS = ["--limits", str(KEPT / "limits.csv")]
INSTALLED = pytest.mark.skipif(calculix.executable() is None, reason=calculix.ABSENT)
DECK = Deck(0.1, "CAX8R", FACES, 2, 0.02, 10.0, 0.1)


def cards(text, name):
    """Lines of data below each card of a name."""
    blocks = [block.splitlines() for block in text.split("*")]
    return [block[1:] for block in blocks if block and block[0].split(",")[0] == name]


def row(program, seconds, error, **changed):
    texts = {"form": "newton", "element": "q4p0", "quadrature": "gauss2", "layout": "tensor", "contact": "nodes"}
    times = {"seconds": seconds, "process_seconds": seconds + (program == OWN)}
    counts = {"elements": 2, "unknowns": 9, "increments": 9, "passes": 9, "runs": 1}
    found = {"end_force_N": 1.0, "force_error": error, "end_error": error, "band": 1e-3}
    words = {"schedule": "12 increments", "version": "1", "outcome": SOLVED}
    return Row(**{"mu": 0.1, "program": program, **texts, **times, **counts, **found, **words, **changed})


def test_the_deck_holds_the_scene():
    text = DECK.text((0.1, 0.45))
    bodies, punch = cards(text, "NODE")
    assert (len(bodies), len(punch)) == (21, 4)
    assert max(float(line.split(",")[1]) for line in bodies) == 5
    assert [len(cells) for cells in cards(text, "ELEMENT")] == [4, 1]
    assert cards(text, "PLASTIC") == [["300, 0", "300, 10"]]
    assert cards(text, "SURFACE BEHAVIOR") == [["840000"]]
    assert cards(text, "FRICTION") == [["0.1, 84000"]]
    assert sorted(cards(text, "SURFACE")[0]) == ["2, S3", "4, S2", "4, S3"]
    assert cards(text, "CONTACT PAIR") == [["SLAVE, MASTER"]]
    assert cards(text, "STATIC") == [["0.02, 1., 1e-6, 0.2"], ["0.0571428571, 1., 1e-6, 0.0571428571"]]
    assert [lines[-1] for lines in cards(text, "BOUNDARY")] == [
        "PUNCH, 1, 1",
        "PUNCH, 2, 2, -0.5",
        "PUNCH, 2, 2, -2.25",
    ]


def test_nodes_in_contact_are_those_of_the_top_and_the_upper_side():
    text = replace(DECK, mu=0.0, contact=NODES, element="CAX4").text((0.1,))
    assert cards(text, "SURFACE")[0] == ["3,", "6,", "8,", "9,"]
    assert not cards(text, "FRICTION")


PRINTED = """
 total force (fx,fy,fz) for set PUNCH and time  0.1000000E+01

        0.000000E+00 -1.000000E+02  0.000000E+00
"""


def test_what_calculix_prints_is_read():
    said = "number of equations\n 220\n\n iteration 1\n\n iteration 2\n\n *ERROR: too many cutbacks\n"
    found = calculix.read(
        Ended(said, 1.5, 201), PRINTED, "SUMMARY\n STEP INC\n  1  1  1  4 0.1 0.1 0.1\n", 2, DECK.force
    )
    assert found == calculix.Calculation((18000.0,), 220, 1, 2, 1.5, "too many cutbacks")
    assert calculix.read(Ended("", 1.0, None), "", "", 2, DECK.force).stopped == calculix.LATE
    assert calculix.read(Ended("", 1.0, -11), "", "", 2, DECK.force).stopped == "exit code -11"
    assert calculix.read(Ended("", 1.0, 0), PRINTED, "", 1, DECK.force).stopped == ""


EXACT = 42815.427
"""Without friction, sigma_Y pi R^2 at 45 %: what every element here has to 2e-6."""


@INSTALLED
@pytest.mark.parametrize(("element", "contact"), [("CAX8R", NODES), ("CAX4", NODES), ("CAX4", FACES)])
def test_without_friction_calculix_has_the_exact_force(element, contact):
    """To the elastic compression, where materials may differ."""
    deck = Deck(0.0, element, contact, 2, 0.02, 10.0, 0.1)
    found = calculix.calculated(deck, MARKS, str(calculix.executable()))
    assert found.stopped == ""
    assert found.forces[-1] == pytest.approx(EXACT, rel=1e-3)


@INSTALLED
@pytest.mark.parametrize(("elements", "part"), [(3, 0.967), (5, 0.994)])
def test_its_contact_between_quadratic_faces_is_soft_without_friction_too(elements, part):
    """So small errors of coarse ones with friction are those of two that cancel."""
    deck = Deck(0.0, "CAX8R", FACES, elements, 0.02, 10.0, 0.1)
    found = calculix.calculated(deck, MARKS, str(calculix.executable()))
    assert found.forces[-1] == pytest.approx(part * EXACT, rel=1e-3)


def test_the_total_error_is_the_largest_at_the_marks_and_counts_as_the_band_below_it():
    limits = [Limit(0.1, mark, "force_N", 100.0, 0.5, "") for mark in MARKS]
    assert errors([100.0, 102.0, 99.0, 100.0, 99.0], limits) == pytest.approx((0.02, 0.01, 0.005))
    error, end, band = errors([100.0], limits)
    assert math.isnan(error)
    assert math.isnan(end)
    assert band == 0.005
    assert row(OWN, 1.0, 1e-4).known == 1e-3


def test_programs_are_compared_at_the_errors_that_both_reach():
    rows = [row(OWN, 0.1, 0.015), row(OWN, 0.5, 0.004), row(FOREIGN, 4.0, 0.008), row(FOREIGN, 1.0, math.nan)]
    found = {one.error: one for one in ratios(rows)}
    assert set(found) == {0.05, 0.02, 0.01}
    assert (found[0.02].ratio, found[0.01].ratio) == (40.0, 8.0)
    assert found[0.01].process_ratio == pytest.approx(4.0 / 1.5)
    assert [one.seconds for one in front([*rows, row(OWN, 0.2, 0.02)], "seconds")] == [0.1, 0.5]


def test_a_file_without_the_limits_is_refused(tmp_path):
    with pytest.raises(ResultsError, match=r"no limit of the force for mu = 0\.1"):
        limits_of(tmp_path / "limits.csv", 0.1)


def test_every_run_has_a_row_of_its_own():
    jobs = [*Plan().jobs(), *Plan().decks()]
    assert len({total.key_of(job) for job in jobs}) == len(jobs)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Of a machine without CalculiX."""
    out = tmp_path_factory.mktemp("total")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", "")
        assert total.main(["--fast", *LIMITS, "--out", str(out)]) == 0
    return out


@pytest.mark.slow
def test_without_calculix_its_rows_are_left_out_and_that_is_said(results, monkeypatch, capsys):
    rows = read_rows(results / "total.csv", Row)
    assert [key(one) for one in rows] == [total.key_of(job) for job in FAST.jobs()]
    assert not (results / "total_ratio.csv").exists()
    for one in rows:
        assert (one.outcome, one.program) == (SOLVED, OWN)
        assert 0 < one.seconds < one.process_seconds
        assert 0 < one.end_error <= one.force_error < 0.03
    monkeypatch.setenv("PATH", "")
    assert total.main(["--fast", *LIMITS, "--resume", "--out", str(results)]) == 0
    assert calculix.ABSENT in capsys.readouterr().err
    assert read_rows(results / "total.csv", Row) == rows


@pytest.mark.slow
@INSTALLED
def test_resumed_where_calculix_is_its_rows_come_in(results, tmp_path, capsys):
    for name in ("total.csv", "total.parameters.json"):
        (tmp_path / name).write_bytes((results / name).read_bytes())
    assert total.main(["--fast", *LIMITS, "--resume", "--out", str(tmp_path)]) == 0
    assert calculix.ABSENT not in capsys.readouterr().err
    rows = read_rows(tmp_path / "total.csv", Row)
    assert [key(one) for one in rows] == [total.key_of(job) for job in (*FAST.jobs(), *FAST.decks())]
    assert {one.outcome for one in rows} == {SOLVED}
    assert all(one.force_error < 0.05 for one in rows)
    head, lines = total_tables.of_ratios(tmp_path)
    assert lines
    assert all(len(line) == len(head) for line in lines)


@pytest.mark.parametrize("pace", [Pace(accuracy=1e-3), Pace(increments=40), Pace(increments=4, plain=True)])
def test_a_pace_is_told_by_its_words(pace):
    assert Pace.of(str(pace)) == pace


def test_a_run_that_folds_is_a_row_with_its_reason():
    came = run(Choice(0.3, OWN, "newton", "q9p1", "gauss3", "tensor", "nodes", 3, "12 increments"), MARKS)
    assert 0 < len(came.forces) < len(MARKS)
    assert came.stopped


@pytest.mark.slow
def test_the_figure_reads_results_only(results, tmp_path, capsys):
    fig_total_error.main(["--results", str(results), "--out", str(tmp_path)])
    assert (tmp_path / "fig_total_error.png").read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.split()) == 2
    with pytest.raises(SystemExit, match=r"run: python -m studies\.accuracy\.total"):
        fig_total_error.main(["--results", str(tmp_path / "nothing")])


def kept(program, **chosen):
    """Rows of the kept results at mu = 0.1."""
    rows = [one for one in read_rows(KEPT / "total.csv", Row) if (one.mu, one.program) == (0.1, program)]
    return [one for one in rows if all(getattr(one, name) == value for name, value in chosen.items())]


def test_the_kept_rows_are_all_that_the_plan_asks_for():
    asked = [total.key_of(job) for job in (*Plan().jobs(), *Plan().decks())]
    assert [key(one) for one in read_rows(KEPT / "total.csv", Row)] == asked


def test_the_kept_ratios_are_as_the_page_says():
    """At equal error some 4 to 15, not 40; on one mesh 30 and more."""
    found = [one for one in read_rows(KEPT / "total_ratio.csv", Ratio) if one.mu == 0.1]
    assert found == [one for one in ratios(read_rows(KEPT / "total.csv", Row)) if one.mu == 0.1]
    assert 3 < min(one.ratio for one in found) < max(one.ratio for one in found) < 15
    for side in (10, 20):
        own = min(one.seconds for one in kept(OWN, element="q8", quadrature="gauss2", elements=side))
        other = min(one.seconds for one in kept(FOREIGN, element="CAX8R", elements=side))
        assert 30 < other / own < 80


def test_a_process_that_is_measured_keeps_what_it_compiles(monkeypatch):
    """Whatever the environment says: else every process would be charged for compiling all that it imports."""
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    asked = "import sys; print(sys.dont_write_bytecode)"
    assert ended([sys.executable, "-c", asked]).said.split() == ["False"]
