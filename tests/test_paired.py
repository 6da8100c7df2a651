"""The comparison of two trees: its statistics, the order of its pairs, what it measures, and one run against itself."""

import csv
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import paired, paired_tasks
from benchmarks.paired import MEASURES, Measure, Taken, compared, interval, main, started
from bipot.marching import system_of


def test_the_interval_of_twenty_is_the_sixth_from_either_end():
    """P(fewer than 6 of 20 below the median) = 0.0207, P(fewer than 7) = 0.0577: two sides in 95 %."""
    assert interval(list(range(20, 0, -1))) == (6, 15)
    assert interval(range(6)) == (0, 5)


def test_so_few_that_nothing_is_known_of_the_median():
    """Even least and largest of five hold it with 1 - 2/32 only."""
    assert interval(range(1, 6)) == (0.0, float("inf"))
    assert interval(range(1, 6), level=0.9) == (1, 5)


def test_the_interval_holds_the_true_median_as_often_as_it_says_of_a_skew_law():
    rng = np.random.default_rng(0)
    found = np.array([interval(rng.lognormal(0.0, 1.0, 20).tolist()) for _ in range(4000)])
    held = np.mean((found[:, 0] <= 1) & (found[:, 1] >= 1))
    assert held == pytest.approx(0.9586, abs=0.012)


def tree_of(tmp_path, text):
    """A tree whose library is ``text``."""
    (tmp_path / "bipot").mkdir(parents=True)
    (tmp_path / "bipot" / "__init__.py").write_text(text)
    return tmp_path


def test_a_tree_is_measured_by_its_own_library_in_processor_seconds(tmp_path):
    """One that sleeps costs nothing, one that works does."""
    work = "import time\nend = time.process_time() + 0.3\nwhile time.process_time() < end:\n    pass\n"
    with started(tree_of(tmp_path / "works", work), "importing", 0) as take:
        assert 0.3 <= take().seconds < 0.5
    with started(tree_of(tmp_path / "sleeps", "import time\ntime.sleep(0.3)\n"), "importing", 0) as take:
        assert take().seconds < 0.2


@pytest.mark.slow
def test_a_tree_without_the_library_is_not_taken_for_one(tmp_path):
    with started(tmp_path, "importing", 0) as take, pytest.raises(RuntimeError, match="not in"):
        take()


def test_a_task_that_fails_is_said_to(tmp_path, capfd):
    tree = tree_of(tmp_path, "raise ImportError('planted')")
    with started(tree, "importing", 0) as take, pytest.raises(RuntimeError, match="importing failed on"):
        take()
    assert "planted" in capfd.readouterr().err


@pytest.fixture
def called(monkeypatch):
    """What is run, with made-up times: 3 s on this tree, 2 s on the other, 1 s of the task it is held against."""
    calls = list[str]()

    @contextmanager
    def made_up(tree, task, size):
        side = "B" if tree != paired.ROOT or task == "against" else "A"
        calls.append("(")
        yield lambda: calls.append(side) or Taken({"A": 3.0, "B": 2.0 if task == "task" else 1.0}[side], 7)
        calls.append(")")

    monkeypatch.setattr(paired, "started", made_up)
    return calls


@pytest.mark.parametrize(
    ("turns", "order"),
    [(1, "((BA))" + "((AB))((BA))" * 10), (3, "((BA))" + "((ABBAAB))((BAABBA))" * 10)],
)
def test_sides_take_turns_after_a_pair_that_is_not_counted(turns, order, called, tmp_path):
    row = compared(Measure("m", "task", 1, 1, turns, 1.4), tmp_path, "abc", 20)
    assert "".join(called) == order
    assert (row.ratio, row.low, row.high, row.pairs, row.against) == (1.5, 1.5, 1.5, 20, "abc")
    assert not row.met
    assert replace(row, most=1.5).met


def test_a_form_is_held_against_another_on_this_tree(called, tmp_path):
    row = compared(Measure("m", "task", 1, 1, 1, 3.0, against="against"), tmp_path, "abc", 1)
    assert (row.ratio, row.against, row.met) == (3.0, "against", True)


def test_the_limits_are_those_asked_for():
    limits = {measure.task: (measure.size, measure.most) for measure in MEASURES}
    assert limits["newton"] == limits["newton_march"] == (10, 1.05)
    assert limits["importing"][1] == 0.5
    assert limits["tangent_wide"] == (100, 3.0)


@pytest.mark.parametrize(
    ("task", "size", "contacts", "rows"), [("newton_wide", 100, 201, 401), ("delassus", 7, 15, 28)]
)
def test_the_scenes_have_the_rows_they_are_said_to_have(task, size, contacts, rows, monkeypatch):
    scenes = []
    monkeypatch.setattr(paired_tasks, "_passes", lambda scene, *asked, **more: scenes.append(scene))
    paired_tasks.TASKS[task](size)
    touching = system_of(scenes[0]).candidates
    assert len(touching.node) == contacts
    assert contacts + np.sum(touching.tangent_free & (touching.mu > 0)) == rows


@pytest.mark.parametrize("measure", [m for m in MEASURES if m.task != "importing"], ids=lambda m: m.task)
def test_every_task_marches_to_its_end(measure):
    seconds, passes = paired_tasks.TASKS[measure.task](measure.small)
    assert seconds > 0
    assert passes > 5


def test_no_commit_is_said_to_be_none(capsys):
    with pytest.raises(SystemExit):
        main(["no-such-commit"])
    assert "no-such-commit: no commit of this repository" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.serial
def test_this_tree_against_itself(tmp_path, capsys):
    code = main(["HEAD", "--pairs", "2", "--fast", "--only", "newton", "--out", str(tmp_path)])
    with (tmp_path / "paired.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["name"], row["size"], row["pairs"]) == ("newton pass", "3", "2")
    assert 0.1 < float(row["ratio"]) < 10
    assert code == int(float(row["ratio"]) > 1.05)
    assert ("MISS" if code else "met") in capsys.readouterr().out
    assert "bipot-paired-" not in paired.git("worktree", "list")
