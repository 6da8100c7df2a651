"""The domed punch beside CalculiX: its deck, a fast run, and what is kept of a whole one."""

from pathlib import Path

import numpy as np
import pytest

from studies.accuracy import domed
from studies.accuracy.calculix import ABSENT, executable
from studies.accuracy.deck import NODES
from studies.accuracy.domed import MARKS, RADIUS, SIZE, STUDY, DomedDeck
from studies.accuracy.foreign import MOST, Row, key
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"
INSTALLED = pytest.mark.skipif(executable() is None, reason=ABSENT)
DECK = DomedDeck(0.3, "CAX8R", NODES, 2, 0.02, 10.0, 0.1)


def test_the_deck_has_the_scene_and_a_sphere_that_touches_its_top():
    """A chord that leaves its sphere by a thousandth of the least travel; the material hardens by 300 MPa."""
    lines = DECK.text(MARKS).splitlines()
    first = lines.index("*NODE, NSET=PUNCH") + 1
    face = np.array([line.split(",")[1:3] for line in lines[first : first + DECK.facets + 1]], dtype=float)
    np.testing.assert_allclose(np.hypot(face[:, 0], face[:, 1] - SIZE - RADIUS), RADIUS)
    assert 0 < face[0, 0] < 0.01 < 1.5 * SIZE < face[-1, 0]
    sagitta = RADIUS - np.hypot(*(face[:2].mean(axis=0) - [0.0, SIZE + RADIUS]))
    assert 0 < sagitta < 1e-3 * MARKS[0] * SIZE
    assert lines[lines.index("*PLASTIC") + 1 :][:2] == ["300, 0", "3300, 10"]
    assert sum(line.endswith(", S1") for line in lines[lines.index("*SURFACE, NAME=MASTER") :]) == DECK.facets


@INSTALLED
@pytest.mark.slow
def test_the_fast_study_has_the_foreign_force(tmp_path):
    assert domed.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_rows(tmp_path / "domed.csv", Row)
    assert [key(row) for row in rows] == STUDY.fast.keys
    for row in rows:
        assert row.difference == row.own_force_N / row.foreign_force_N - 1
        assert abs(row.difference) < MOST


def test_without_calculix_nothing_is_compared_and_that_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    assert domed.main(["--fast", "--out", str(tmp_path)]) == 0
    assert ABSENT in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_kept_forces_are_as_the_page_says():
    """Both programs to the end on every mesh; friction makes more than twenty times the difference of programs."""
    rows, plan = read_rows(KEPT / "domed.csv", Row), STUDY.whole
    assert [key(row) for row in rows] == plan.keys
    assert max(abs(row.difference) for row in rows) <= MOST
    last = {row.mu: row.own_force_N for row in rows if (row.elements, row.travel) == (plan.sides[-1], MARKS[-1])}
    assert last[0.3] / last[0.0] - 1 > 20 * MOST
