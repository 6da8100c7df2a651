"""The verification suite: its kept results are whole, reproduced, and those of the page; what misses ends with one."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from bipot.errors import NotConverged
from paper_figs import fig_verification
from studies.comparison_page import RESULTS
from studies.tables import read_rows
from studies.verification import __main__ as suite
from studies.verification.case import NO, YES, Asked, Case, Row, Sense, Subject
from studies.verification.cases import all_cases
from studies.verification.forms import CERTIFICATE, asked_on, judged_on
from studies.verification.page import FIGURES, NAME, page

DOCS = Path(__file__).parents[1] / "docs"
CASES = {case.name: case for case in all_cases()}

LONG = {
    "bar_drawing",
    "cattaneo_mindlin",
    "contact_patch",
    "curved_beams",
    "hardness",
    "hertz_bodies_in_space",
    "hertz_cylinder",
    "hertz_in_space",
    "hertz_sphere",
    "hertz_two_bodies",
    "punch_rounded",
    "quarter_cylinder",
    "ring_constant_shear",
    "rough_block",
    "slipping_platens",
    "stick_radius",
    "stick_radius_flat",
    "strip_rolling",
    "thick_tube",
    "upsetting_bracket",
    "volume_kept",
    "wedge_extrusion",
    "wedge_indentation",
}
"""Cases whose coarsest mesh takes long; others of the kind are among the rest, in test_examples, test_hertz and
test_two_bodies."""


def kept():
    return read_rows(RESULTS / f"{NAME}.csv", Row)


def test_every_file_is_a_case_of_that_name_with_texts_and_a_series():
    files = {path.stem for path in Path(suite.__file__).with_name("cases").glob("[!_]*.py")}
    assert set(CASES) == files
    for case in CASES.values():
        assert case.purpose.endswith(".")
        assert case.setup.endswith(".")
        assert list(case.meshes) == sorted(set(case.meshes))
        assert len({asked.quantity for asked in case.asked}) == len(case.asked)


def test_the_kept_rows_are_all_numbers_of_all_meshes():
    asked = {
        (case.name, mesh, one.quantity): one
        for case in CASES.values()
        for mesh in case.meshes
        for one in asked_on(case, mesh, others=True)
    }
    assert [(row.case, row.mesh, row.quantity) for row in kept()] == list(asked)
    for row in kept():
        one = asked[row.case, row.mesh, row.quantity]
        assert (row.reference, row.tolerance) == (pytest.approx(one.exact(row.mesh), rel=1e-12), one.tolerance)
        # To what the reference, a closed form, is the same on another machine.
        assert row.error == pytest.approx(one.error(row.value, row.mesh), abs=1e-12, nan_ok=True)
        assert (row.ok == YES) == (abs(row.error) <= one.tolerance)


def test_no_kept_case_misses_a_tolerance_on_its_finest_mesh():
    assert not [row for row in kept() if row.ok == NO and row.mesh == judged_on(CASES[row.case], row.quantity)]


def test_the_page_is_that_of_the_results():
    made = page(list(CASES.values()), kept())
    assert (DOCS / "verification.md").read_text(encoding="utf-8") == made
    for case in CASES.values():
        assert (f"{FIGURES}/{case.name}.png" in made) == (len(case.meshes) > 1)


def run_fast(names, out):
    """The coarsest meshes of these cases: the exit code and the rows."""
    code = suite.main(["--fast", "--only", *names, "--out", str(out), "--page", str(out / "page.md")])
    return code, read_rows(out / f"{NAME}.csv", Row)


@pytest.fixture(scope="module")
def fast(tmp_path_factory):
    """The coarsest mesh of every case that is not long."""
    out = tmp_path_factory.mktemp(NAME)
    return out, *run_fast(CASES.keys() - LONG, out)


def check_kept(names, code, rows):
    """Rows of these cases have the kept values."""
    assert code == 0
    known = {(row.case, row.quantity): row for row in kept() if row.mesh == CASES[row.case].meshes[0]}
    asked = [(case, asked_on(case, case.meshes[0], others=False)) for case in CASES.values() if case.name in names]
    assert {(row.case, row.quantity) for row in rows} == {(case.name, one.quantity) for case, of in asked for one in of}
    for row in rows:
        if row.quantity == CERTIFICATE.quantity:
            assert row.ok == YES, row
            continue
        # Of a reference that is zero what is kept may be round-off.
        old = known[row.case, row.quantity]
        assert row.value == pytest.approx(old.value, rel=1e-6, abs=0.0 if row.reference else row.tolerance), old


def test_the_coarsest_meshes_give_the_kept_values(fast):
    check_kept(CASES.keys() - LONG, *fast[1:])


@pytest.mark.slow
def test_the_coarsest_meshes_of_long_cases_give_the_kept_values(tmp_path):
    check_kept(LONG, *run_fast(LONG, tmp_path))


def test_the_page_of_a_fast_run_has_the_cases_that_are_judged(fast):
    out, _, _ = fast
    made = (out / "page.md").read_text(encoding="utf-8")
    shown = {name for name in CASES if f"### {name}\n" in made}
    assert shown == {case.name for case in CASES.values() if len(case.meshes) == 1}


@pytest.mark.slow
def test_the_pictures_are_drawn_from_results_only(fast, tmp_path):
    fig_verification.main(["--results", str(RESULTS), "--out", str(tmp_path)])
    drawn = {path.stem for path in tmp_path.glob("*.png")}
    assert drawn == {case.name for case in CASES.values() if len(case.meshes) > 1}
    assert drawn == {path.stem for path in (DOCS / FIGURES).glob("*.png")}
    with pytest.raises(SystemExit, match=r"run: python -m studies\.verification"):
        fig_verification.main(["--results", str(tmp_path)])


def off_by(error):
    """A case of two meshes that misses by this on both, or fails where it is None."""

    def run(mesh, watch):
        if error is None:
            raise NotConverged("not today")
        return [1 + error]

    return Case(
        name="small",
        subject=Subject.ELEMENTS,
        source="source",
        purpose="Purpose.",
        setup="Set-up.",
        asked=(Asked("one", 1.0, 0.1),),
        counted="meshes",
        meshes=(1, 2),
        run=run,
        marched=False,
    )


@pytest.mark.parametrize(("error", "code"), [(0.09, 0), (0.11, 1), (-0.11, 1), (math.nan, 1), (None, 1)])
def test_what_misses_on_the_finest_mesh_ends_with_exit_code_one(error, code, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(suite, "all_cases", lambda: (off_by(error),))
    assert suite.main(["--out", str(tmp_path), "--page", str(tmp_path / "page.md")]) == code
    assert [row.mesh for row in read_rows(tmp_path / f"{NAME}.csv", Row)] == [1, 2]
    said, told = capsys.readouterr()
    assert ("missed: small" in said) == bool(code)
    assert ("not today" in told) == (error is None)
    assert (
        "1 of 1 cases misses a tolerance on the finest mesh: `small`. Its section says why."
        in (tmp_path / "page.md").read_text()
    ) == bool(code)


def test_what_was_run_is_kept_where_a_run_is_stopped(tmp_path, monkeypatch):
    def stopped(mesh, watch):
        if mesh == 2:
            raise KeyboardInterrupt
        return [1.0]

    monkeypatch.setattr(suite, "all_cases", lambda: (replace(off_by(0.0), run=stopped),))
    assert suite.main(["--out", str(tmp_path)]) == 130
    assert [row.mesh for row in read_rows(tmp_path / f"{NAME}.csv", Row)] == [1]


def test_an_unknown_case_is_refused(capsys):
    with pytest.raises(SystemExit) as stop:
        suite.main(["--only", "nothing"])
    assert stop.value.code == 2
    assert "invalid choice: 'nothing'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("sense", "value", "error"),
    [(Sense.EQUAL, 1.0, -0.5), (Sense.AT_LEAST, 1.0, -0.5), (Sense.AT_LEAST, 3.0, 0.0), (Sense.AT_MOST, 3.0, 0.5)],
)
def test_a_bound_is_missed_by_what_is_beyond_it(sense, value, error):
    assert Asked("F", 2.0, 0.1, sense).error(value, 1) == error
    assert math.isnan(Asked("F", 2.0, 0.1, sense).error(math.nan, 1))
