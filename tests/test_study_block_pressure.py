"""Pressure on the upset cube: a fast run beside the study's own history, and what is kept of a whole one."""

import csv
from pathlib import Path

import pytest

from studies import block
from studies.accuracy import block_pressure
from studies.accuracy.block_pressure import FAST, Plan, Row, key
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"


@pytest.mark.slow
def test_the_fast_study_says_what_the_history_of_the_block_says(tmp_path):
    assert block_pressure.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_rows(tmp_path / "block_pressure.csv", Row)
    assert [key(row) for row in rows] == FAST.keys()
    fanned = rows[-1]
    asked = [
        "--mu",
        "0.3",
        "--elements",
        "3",
        "--layout",
        "fanned",
        "--reduction",
        "0.3",
        "--out",
        str(tmp_path / "run"),
    ]
    assert block.main(asked) == 0
    with (tmp_path / "run" / "mu0.3" / "history.csv").open(encoding="utf-8") as file:
        history = list(csv.DictReader(file))
    assert float(history[-1]["edge"]) == pytest.approx(fanned.edge, rel=1e-6)
    late = [float(one["edge"]) for one in history if float(one["reduction"]) >= 0.02]
    assert max(late) == pytest.approx(fanned.largest_edge, rel=1e-6)
    assert float(history[-1]["min_jacobian"]) == pytest.approx(fanned.min_jacobian, rel=2e-3)


def test_the_kept_table_has_every_run_of_the_plan():
    """In the fanned layout all come to the end; in the other 12 a side fold at mu = 0.3."""
    rows = {key(row): row for row in read_rows(KEPT / "block_pressure.csv", Row)}
    assert list(rows) == Plan().keys()
    ended = {at: row.reached == pytest.approx(0.3) for at, row in rows.items()}
    assert [at for at, ends in ended.items() if not ends] == [(0.3, "tensor", 12)]
    assert max(row.largest_written for row in rows.values()) < 0.05
    assert max(row.largest_inner for row in rows.values() if row.layout == "fanned" and row.elements > 4) < 0.03
