"""What every marched case of the verification suite is asked: forms that agree, and a check of it that can fail."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    Dissipation,
    Newton,
    Penalty,
    Schedule,
    Tangent,
    upsetting,
)
from bipot.errors import NotConverged
from studies.tables import read_rows
from studies.verification import __main__ as suite
from studies.verification import forms
from studies.verification.case import NO, YES, Asked, Case, Row, Subject, Watch
from studies.verification.cases import all_cases
from studies.verification.forms import CERTIFICATE, CONIC, OTHERS, Found, Other, difference, measured
from studies.verification.page import NAME

CASES = {case.name: case for case in all_cases()}


def upset(mesh, watch):
    """The force of an upsetting by a hundredth."""
    scene = upsetting(mu=0.1, elements=mesh, reduction=0.01)
    return [float(-watch.end(scene, Schedule(2)).tool_force(0)[1])]


SMALL = Case(
    name="small",
    subject=Subject.UPSETTING,
    source="source",
    purpose="Purpose.",
    setup="Set-up.",
    asked=(Asked("force", 1.0, np.inf),),
    counted="elements",
    meshes=(2, 3),
    run=upset,
)


def found(case, mesh, **given):
    return {row.quantity: row for row in measured(case, mesh, **given)}


@pytest.mark.slow
def test_other_forms_find_the_forces_of_a_capstan_where_the_law_determines_them():
    rows = found(CASES["capstan"], 8, others=True)
    assert {other.asked.quantity for other in OTHERS} <= rows.keys()
    assert all(row.ok == YES for row in rows.values())


def test_other_forms_are_asked_on_the_coarsest_mesh_alone():
    alone = {"force", CONIC.quantity, CERTIFICATE.quantity}
    assert found(SMALL, 3, others=True).keys() == found(SMALL, 2, others=False).keys() == alone


@pytest.mark.parametrize(("form", "ok"), [(Tangent(), YES), (Penalty(1e6, 1e6), NO)])
def test_a_form_with_other_forces_misses(form, ok, monkeypatch, tmp_path):
    other = Other(Asked("force, other", 0.0, 1e-5), form)
    monkeypatch.setattr(forms, "OTHERS", (other,))
    monkeypatch.setattr(suite, "all_cases", lambda: (SMALL,))
    assert suite.main(["--out", str(tmp_path), "--page", str(tmp_path / "page.md")]) == int(ok == NO)
    judged = [row for row in read_rows(tmp_path / f"{NAME}.csv", Row) if row.quantity == other.asked.quantity]
    assert [(row.mesh, row.ok) for row in judged] == [(2, ok)]
    missed = f"**Missed:** {other.asked.quantity}." in (tmp_path / "page.md").read_text()
    assert missed == (ok == NO)


def test_a_form_that_fails_misses_and_is_told(monkeypatch, capsys):
    def failing(*given):
        raise NotConverged("not today")

    monkeypatch.setattr(forms, "again", failing)
    rows = found(SMALL, 2, others=True)
    assert {rows[other.asked.quantity].ok for other in OTHERS} == {NO}
    assert rows["force"].ok == YES
    assert "not today" in capsys.readouterr().err


def test_a_case_that_says_it_marches_and_does_not_misses():
    rows = found(replace(SMALL, run=lambda mesh, watch: [1.0]), 3, others=True)
    assert (rows[CONIC.quantity].ok, rows[CERTIFICATE.quantity].ok) == (NO, NO)


def test_increments_that_end_in_a_conic_form_are_counted():
    watch = Watch()
    scene = upsetting(mu=0.0, elements=1, reduction=0.02)
    watch.end(scene, Schedule(3), Control(Dissipation()))
    watch.end(scene, Schedule(1), Control(Newton()))
    assert watch.conic_share == 3 / 4
    assert 0 < watch.worst <= 1


def test_differences_are_those_of_the_same_increments_whose_forces_are_determined():
    one, off = Found(0.5, np.array([1.0, -4.0]), True), Found(0.5, np.array([1.0, -4.0 * (1 + 2e-5)]), True)
    assert difference([off], [one]) == pytest.approx(2e-5)
    last = Found(1.0, np.array([2.0, 0.0]), True)
    gone = last._replace(forces=np.array([0.0, 1e-9]))
    assert difference([one, gone], [one, gone._replace(forces=np.array([0.0, 2e-9]))]) < 1e-8
    assert difference([off._replace(determined=False), last], [one, last]) == 0
    assert np.isnan(difference([off._replace(determined=False)], [one]))
    assert np.isnan(difference([off], [one, last]))
