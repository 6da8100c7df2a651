"""The study of faults in its short form: nothing is lost, unreadable, raw or crashed."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.skipif(sys.platform == "win32", reason="processes are forked and stopped by signals")
@pytest.mark.slow
def test_whatever_happens_to_a_study_what_it_reported_is_there_and_it_goes_on(tmp_path):
    command = [sys.executable, "-m", "studies.faults", "--fast", "--out", str(tmp_path)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    with (tmp_path / "faults.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["fault", "tried", "lost", "unreadable", "raw", "crashed"]
    assert {row["fault"] for row in rows} == {
        "killed writing",
        "killed anywhere",
        "disk full",
        "two writers",
        "folder removed",
    }
    for row in rows:
        assert int(row["tried"]) >= 1
        assert [row[name] for name in ("lost", "unreadable", "raw", "crashed")] == ["0"] * 4
