"""Sweeps of the study: no point lost with a worker that dies, one table that is gone on with, failures as rows."""

import csv
import json
import os
import re
import signal
from itertools import pairwise
from pathlib import Path

import pytest

from bipot.errors import NotConverged
from studies import sweep, sweep_point
from studies.options import coefficients
from studies.sweep_point import Outcome, Status
from tests.commands import DEADLINE, children_of, running, until

PAGE = Path(__file__).parents[1] / "docs" / "howto" / "sweep_study.md"

TINY = ["--elements", "1", "--increments", "4", "--reduction", "0.1", "--form", "newton"]

SMALL = [*TINY, "--elements", "1", "2", "--mu", "0:0.2:2", "--at", "0.06", "0.1"]


def rows_of(folder):
    with (folder / "sweep.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_coefficients_are_numbers_or_ranges():
    assert coefficients("0.3") == [0.3]
    assert coefficients("inf") == [float("inf")]
    found = coefficients("0:0.6:13")
    assert found[3] == 0.15
    assert [round(b - a, 12) for a, b in pairwise(found)] == [0.05] * 12


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--mu", "0:1"], "0:1: must be a number, or FROM:TO:NUMBER"),
        (["--mu", "1:0:3"], "1:0:3: must go from one finite number up to a larger one"),
        (["--mu", "0:inf:3"], "0:inf:3: must go from one"),
        (["--mu", "0:1:1"], "1: must be from 2 to"),
        (["--mu", "0", "--jobs", "0"], "0: must be from 1"),
        (["--mu", "0", "--nothing"], "unrecognized arguments: --nothing"),
    ],
)
def test_an_argument_that_is_none_is_refused(arguments, words, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        sweep.main([*arguments, "--out", str(tmp_path)])
    assert stop.value.code == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--at", "0.11"], "--at = 0.11: must be in (0, 0.1], where the march ends"),
        (["--at", "0.001"], "--at (0.001,): as fractions of the path: landing = 0.01: must be in (0.4"),
        (["--beside"], "--beside = 'given': must be left out of a sweep"),
        (["--fclib"], "--fclib = 'given': must be left out of a sweep"),
        (["--kn", "1"], "--kn has no effect"),
        (["--executor", "ray:x"], "--executor = 'ray:x': must be dask:ADDRESS"),
        (["--executor", "dask:"], "--executor = 'dask:': must be dask:ADDRESS"),
        (["--executor", "dask:x", "--jobs", "2"], "--jobs = 2: must be left out with --executor"),
        (["--hardening", "perfect:-1"], "sigma_y = -1.0"),
    ],
)
def test_a_sweep_that_is_none_is_refused_before_anything_is_computed(arguments, words, tmp_path, capsys):
    assert sweep.main([*TINY, "--mu", "0.1", "--out", str(tmp_path), *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """The folder of a sweep of two coefficients and two meshes."""
    out = tmp_path_factory.mktemp("sweep")
    assert sweep.main([*SMALL, "--out", str(out)]) == 0
    return out


def test_the_table_tells_what_a_march_of_ones_own_finds(complete):
    rows = rows_of(complete)
    assert [(row["mu"], row["elements"]) for row in rows] == [("0.0", "1"), ("0.0", "2"), ("0.2", "1"), ("0.2", "2")]
    for row in rows:
        (point,) = (p for p in points_of(complete) if p.key == (float(row["mu"]), int(row["elements"])))
        own = sweep_point.solve(point)
        assert (float(row["force_6_N"]), float(row["force_10_N"])) == own.forces
        assert 0 < own.forces[0] < own.forces[1]
        assert (row["status"], int(row["passes"]), int(row["increments"])) == ("solved", own.passes, own.increments)
        assert 0 < float(row["certificate"]) <= 1
        assert row["measure"] == own.measure
    # Frictionless is homogeneous: every mesh has the force of the closed form, sigma_Y A / (1 - reduction).
    exact = 300 * 3.141592653589793 * 25 / 0.9
    assert float(rows[0]["force_10_N"]) == pytest.approx(exact, rel=2e-3)


def points_of(folder):
    return sweep.points(*sweep.parser().parse_known_args([*SMALL, "--out", str(folder)]))


def test_its_parameters_and_a_picture_lie_beside_it(complete):
    stored = json.loads((complete / "sweep.parameters.json").read_text())
    assert stored["form"] == "newton"
    assert stored["at"] == [0.06, 0.1]
    assert not stored.keys() & {"mu", "elements"}
    assert (complete / "sweep.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_finished_points_are_kept_and_lost_ones_computed_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sweep, "solve", lambda point: told(point, Status.STOPPED if point.key[0] else None))
    asked = [*TINY, "--mu", "0", "0.1", "0.2", "--out", str(tmp_path)]
    assert sweep.main(asked) == 1
    assert [row["status"] for row in rows_of(tmp_path)] == ["lost", "stopped", "stopped"]
    assert "lost: mu = 0, 1 elements a side: ValueError: a mistake" in capsys.readouterr().out
    assert sweep.main(asked) == 2
    again = []
    monkeypatch.setattr(sweep, "solve", lambda point: again.append(point.key) or told(point, Status.SOLVED))
    assert sweep.main([*asked, "--resume"]) == 1
    assert again == [(0.0, 1)]
    assert [row["status"] for row in rows_of(tmp_path)] == ["solved", "stopped", "stopped"]
    assert sweep.main([*asked, "--resume", "--form", "tangent"]) == 2
    assert "holds results with form" in capsys.readouterr().err
    assert sweep.main([*asked, "--overwrite"]) == 0


def test_a_sweep_is_not_gone_on_with_where_the_curves_file_has_changed(tmp_path, monkeypatch, capsys):
    """Its name is the same: one table would hold points of two materials."""
    monkeypatch.setattr(sweep, "solve", lambda point: told(point, Status.SOLVED))
    curve, out = tmp_path / "curve.csv", tmp_path / "out"
    asked = [*TINY, "--hardening", f"csv:{curve}", "--out", str(out)]
    curve.write_text("0,300\n0.5,500\n")
    assert sweep.main([*asked, "--mu", "0"]) == 0
    assert sweep.main([*asked, "--mu", "0", "0.1", "--resume"]) == 0
    before = rows_of(out)
    curve.write_text("0,100\n0.5,100\n")
    assert sweep.main([*asked, "--mu", "0", "0.1", "0.2", "--resume"]) == 2
    assert "holds results with curve = " in (said := capsys.readouterr().err)
    assert "(300.0, 500.0)" in said
    assert "(100.0, 100.0)" in said
    assert rows_of(out) == before


def told(point, status):
    if status is None:
        raise ValueError("a mistake")
    return Outcome.none(point, status, "refused")


def test_a_march_that_stops_is_told_with_its_reason_and_what_it_reached(monkeypatch):
    (point,) = sweep.points(*sweep.parser().parse_known_args([*TINY, "--mu", "0.3", "--at", "0.06", "0.1"]))
    steps = sweep_point.march

    def stopping(*given):
        march = steps(*given)
        while True:
            yield (accepted := next(march))
            if accepted.state.tau > 0.59:
                raise NotConverged("no\nfurther")

    monkeypatch.setattr(sweep_point, "march", stopping)
    found = sweep_point.solve(point)
    assert (found.status, found.reason) == (Status.STOPPED, "no further")
    assert found.reduction == pytest.approx(0.06)
    assert found.forces[0] > 0
    assert found.forces[1] != found.forces[1]


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks the system who is alive")
def test_a_sweep_whose_worker_is_killed_has_all_its_points(tmp_path):
    command = ["studies.sweep", *TINY, "--mu", "0:0.3:7", "--jobs", "2", "--out", tmp_path]
    table = tmp_path / "sweep.csv"
    with running(*command) as process:
        until(lambda: table.exists() and table.read_text().count("\n") > 1)
        # The tracker of shared memory is a child, too, and no worker: it is the oldest.
        os.kill(max(children_of(process.pid)), signal.SIGKILL)
        told, said = process.communicate(timeout=DEADLINE)
        assert (process.returncode, said) == (0, "")
    assert "7 solved" in told
    assert {row["status"] for row in rows_of(tmp_path)} == {"solved"}


def dask_cluster():
    """Two workers on this machine, each a process, and nothing that listens elsewhere."""
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None, silence_logs=50
    )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_dask_computes_a_sweep_and_replaces_a_worker_that_is_killed(tmp_path):
    pytest.importorskip("distributed")
    with dask_cluster() as cluster:
        first = [*TINY, "--mu", "0:0.3:7", "--out", str(tmp_path)]
        workers = [worker.pid for worker in cluster.workers.values()]
        with running("studies.sweep", *first, "--executor", f"dask:{cluster.scheduler_address}") as process:
            until(lambda: (tmp_path / "sweep.csv").exists())
            os.kill(workers[0], signal.SIGKILL)
            told, said = process.communicate(timeout=DEADLINE)
        assert process.returncode == 0, said
    assert "7 solved" in told
    here = tmp_path / "here"
    assert sweep.main([*first[:-1], str(here)]) == 0
    apart = {"seconds"}
    for one, other in zip(rows_of(tmp_path), rows_of(here), strict=True):
        assert {k: v for k, v in one.items() if k not in apart} == {k: v for k, v in other.items() if k not in apart}


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_one_sentence(tmp_path, capsys):
    pytest.importorskip("distributed")
    assert sweep.main([*TINY, "--mu", "0.1", "--executor", "dask:tcp://127.0.0.1:9", "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_the_page_names_every_column(complete):
    (table,) = re.findall(r"(?:^\|.*\n)+", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    named = {name for line in table.splitlines()[2:] for name in re.findall(r"`(\w+)`", line.split("|")[1])}
    own = {re.sub(r"force_\d+_N", "force", name) for name in rows_of(complete)[0]}
    assert {re.sub(r"force_\d+_N", "force", name) for name in named} == own
