"""Both comparisons in fast mode: exact columns, errors that fall, figures from results only; and their own measures."""

import shutil
import time
from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import ResultsError
from bipot.forms import Dissipation, Newton, Penalty, Tangent
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.response import Body
from paper_figs import fig_penalty_vs_conic, fig_speed_vs_error
from studies import optimisers, outputs, penalty_round_off, penalty_vs_conic, speed_vs_error
from studies.runs import Run, curve_error, record, stick_creep, traction_errors
from studies.speed_jobs import FAST, jobs
from studies.tables import read_csv

ASKED = (
    "mu, reduction, form, K_over_E_h, force_N, force_error, normal_traction_error, tangential_traction_error, "
    "penetration_mm, stick_creep_mm, relative_gap, condition, passes, seconds, outcome"
)
TIMED = (
    "mu, method, knob, value, elements, quadrature, increments, force_error, curve_error, work_error, radius_error, "
    "traction_error, velocity_error, relative_gap, seconds, assembly_s, compile_s, solve_s"
)


@pytest.fixture(scope="module")
def seconds():
    """Processor seconds of each study in fast mode."""
    return {}


def ran(study, tmp_path_factory, seconds):
    """Results of a study in fast mode."""
    out, began = tmp_path_factory.mktemp(study.NAME), time.process_time()
    assert study.main(["--fast", "--out", str(out)]) == 0
    seconds[study.NAME] = time.process_time() - began
    return out


@pytest.fixture(scope="module")
def penalty(tmp_path_factory, seconds):
    return ran(penalty_vs_conic, tmp_path_factory, seconds)


@pytest.fixture(scope="module")
def speed(tmp_path_factory, seconds):
    return ran(speed_vs_error, tmp_path_factory, seconds)


@pytest.mark.serial
@pytest.mark.slow
def test_both_comparisons_take_less_than_a_minute(penalty, speed, seconds):
    assert len(seconds) == 2
    assert sum(seconds.values()) < 60


def test_penalty_vs_conic_writes_what_it_says(penalty):
    rows = read_csv(penalty / "penalty_vs_conic.csv", "")
    assert set(ASKED.split(", ")) <= set(rows[0])
    assert len(rows) == 2 * 4
    early = {(r["form"], r["K_over_E_h"]): r for r in rows if r["reduction"] == 0.2}
    assert early["uzawa", 100.0]["force_error"] < 1e-6
    assert early["penalty", 100.0]["force_error"] < 0.02 * early["penalty", 1.0]["force_error"]
    assert early["penalty", 100.0]["order"] == pytest.approx(1, abs=0.1)
    assert early["penalty", 100.0]["penetration_mm"] < 0.02 * early["penalty", 1.0]["penetration_mm"]
    assert early["penalty", 100.0]["condition"] > early["penalty", 1.0]["condition"]
    assert (penalty / "penalty_vs_conic.h5").is_file()


@pytest.mark.slow
def test_speed_vs_error_writes_what_it_says(speed):
    rows = read_csv(speed / "speed_vs_error.csv", "")
    assert set(TIMED.split(", ")) <= set(rows[0])
    assert len(rows) == len(list(jobs(FAST)))
    for row in rows:
        parts = sum(row[name] for name in ("assembly_s", "compile_s", "solve_s", "other_s"))
        assert parts == pytest.approx(row["seconds"])
    exact = [r for r in rows if r["method"] in ("newton", "tangent", "uzawa") and r["knob"] == "increments"]
    assert all(r["algebraic_error"] < 1e-6 < r["curve_error"] for r in exact)
    assert read_csv(speed / "fastest.csv", "")
    assert (speed / "extrapolation.csv").is_file()


def cut(speed, tmp_path, *lines):
    """The results of the study without some lines of its table; what is left of that."""
    shutil.copy(speed / "speed_vs_error.parameters.json", tmp_path)
    text = (speed / "speed_vs_error.csv").read_text().splitlines()
    left = [line for k, line in enumerate(text) if k not in lines]
    (tmp_path / "speed_vs_error.csv").write_text("\n".join(left) + "\n")
    return left


@pytest.mark.slow
def test_resumed_rows_are_kept_and_only_missing_ones_run(speed, tmp_path, monkeypatch):
    whole = (speed / "speed_vs_error.csv").read_text().splitlines()
    left = cut(speed, tmp_path, 3)
    made = []
    measured = speed_vs_error.measured
    monkeypatch.setattr(speed_vs_error, "measured", lambda job, plan: made.append(job) or measured(job, plan))
    assert speed_vs_error.main(["--fast", "--resume", "--out", str(tmp_path)]) == 0
    assert len(made) == 1
    again = (tmp_path / "speed_vs_error.csv").read_text().splitlines()
    assert [line for k, line in enumerate(again) if k != 3] == left
    # What is measured again has the same place and the same key, and its own seconds.
    assert again[3].split(",")[:7] == whole[3].split(",")[:7]


@pytest.mark.slow
def test_an_interrupted_resume_loses_no_row(speed, tmp_path, monkeypatch):
    left = cut(speed, tmp_path, 1, 4)
    calls = iter([None])
    writes = outputs.write_csv

    def write_once(path, rows):
        if next(calls, "over") == "over":
            raise KeyboardInterrupt
        writes(path, rows)

    monkeypatch.setattr(outputs, "write_csv", write_once)
    assert speed_vs_error.main(["--fast", "--resume", "--out", str(tmp_path)]) == 130
    again = (tmp_path / "speed_vs_error.csv").read_text().splitlines()
    assert len(again) == len(left) + 1
    assert set(left) < set(again)


@pytest.mark.slow
def test_a_penalty_table_is_gone_on_with_where_the_conic_run_has_to_be_made_again(penalty, tmp_path, monkeypatch):
    shutil.copytree(penalty, tmp_path, dirs_exist_ok=True)
    table = tmp_path / "penalty_vs_conic.csv"
    whole = table.read_text().splitlines()
    lost = next(k for k, line in enumerate(whole) if line.startswith("0.3,0.45,penalty,100"))
    table.write_text("\n".join(whole[:lost] + whole[lost + 1 :]) + "\n")
    made = []
    solve = penalty_vs_conic.solve
    monkeypatch.setattr(penalty_vs_conic, "solve", lambda case, plan: made.append(case.form.value) or solve(case, plan))
    assert penalty_vs_conic.main(["--fast", "--resume", "--out", str(tmp_path)]) == 0
    assert made == ["tangent", "penalty"]
    again = table.read_text().splitlines()
    assert [line for k, line in enumerate(again) if k != lost] == [line for k, line in enumerate(whole) if k != lost]
    seconds = whole[0].split(",").index("seconds")
    untimed = [[cell for k, cell in enumerate(line.split(",")) if k != seconds] for line in (again[lost], whole[lost])]
    assert untimed[0] == untimed[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("figure", "name"),
    [(fig_penalty_vs_conic, "penalty"), (fig_speed_vs_error, "speed")],
)
def test_figures_read_results_only(figure, name, request, tmp_path):
    results = request.getfixturevalue(name)
    figure.main(["--results", str(results), "--out", str(tmp_path / "figures")])
    assert len(list((tmp_path / "figures").glob("*.pdf"))) >= 1
    with pytest.raises(SystemExit, match="python -m studies"):
        figure.main(["--results", str(tmp_path / "nothing")])


@pytest.mark.slow
def test_optimisers_writes_a_row_each(tmp_path):
    assert optimisers.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_csv(tmp_path / "optimisers.csv", "")
    assert [row["optimiser"] for row in rows] == ["newton", "trust_region", "gradient_only", "cvxpy"]
    assert rows[0]["largest_difference"] == 0
    assert max(row["largest_difference"] for row in rows) < 1e-5


def test_optimisers_that_disagree_are_named():
    none = optimisers.Row("", 1, 0.0, 1.0, 1, 0.0, 0)
    agreed = [replace(none, optimiser=o.value) for o in optimisers.ALLOWED]
    assert optimisers.disagreements(agreed) == []
    planted = [replace(row, largest_difference=2e-6) for row in agreed]
    assert [line.split()[0] for line in optimisers.disagreements(planted)] == ["trust_region", "cvxpy"]
    assert len(optimisers.disagreements([])) == len(optimisers.ALLOWED)


def test_a_disagreement_fails_the_command(tmp_path, monkeypatch, capsys):
    wrong = optimisers.Row("cvxpy", 1, 1e-3, 1.0, 1, 0.0, 0)
    monkeypatch.setattr(optimisers, "compare", lambda elements, increments: None)
    monkeypatch.setattr(optimisers, "rows", lambda compared: [wrong])
    assert optimisers.main(["--fast", "--out", str(tmp_path)]) == 1
    assert "cvxpy differs from newton" in capsys.readouterr().err


@pytest.mark.slow
def test_the_force_does_not_follow_the_tolerance_where_round_off_is_far(tmp_path):
    assert penalty_round_off.main(["--fast", "--out", str(tmp_path)]) == 0
    tight, loose = read_csv(tmp_path / "penalty_round_off.csv", "")
    assert loose["tolerance"] == 1e4 * tight["tolerance"]
    assert abs(loose["difference"]) < 1e-8


def test_no_results_are_named_with_their_command(tmp_path):
    with pytest.raises(ResultsError, match="run: python -m studies x"):
        read_csv(tmp_path / "none.csv", "python -m studies x")


@pytest.fixture(scope="module")
def short():
    scene = upsetting(mu=0.6, reduction=0.1, elements=2)
    schedule = Schedule(2, 0.01, settling=1, growth=4.0)
    return scene, schedule, record(scene, schedule, Control(Tangent()), (1.0,))


def test_a_run_measured_by_itself_has_no_error(short):
    scene, schedule, run = short
    end = run.snapshots[-1]
    assert curve_error(run, run, len(run.snapshots) - 1) == 0
    assert traction_errors(system_of(scene), end, end) == (0, 0)
    assert stick_creep(run, run, schedule.times(), 1.0) < 1e-9
    assert np.isfinite(end.condition)
    assert end.condition > 1
    assert np.isnan(run.snapshots[0].condition)


def test_planted_errors_are_measured(short):
    """Forces and pressures 1 % too large: errors of 1 %; a slip of 1e-3 where it sticks: that creep."""
    scene, schedule, run = short
    wrong = Run(
        tuple(replace(s, force=1.01 * s.force, pressure=1.01 * s.pressure, slip=s.slip + 1e-3) for s in run.snapshots)
    )
    assert curve_error(wrong, run, len(run.snapshots) - 1) == pytest.approx(0.01)
    pressure, shear = traction_errors(system_of(scene), wrong.snapshots[-1], run.snapshots[-1])
    assert pressure == pytest.approx(0.01)
    assert shear == 0
    creep = stick_creep(wrong, run, schedule.times(), 1.0)
    assert creep == pytest.approx(1e-3 * round(creep / 1e-3))
    assert creep > 0


NAP = 2e-3


@pytest.mark.parametrize("form", [Newton(), Tangent(), Dissipation(), Penalty(1e7, 1e7)])
def test_a_second_is_counted_once(form, monkeypatch):
    """With the body's part slowed down on purpose: all of it is found as assembly, none of it elsewhere."""
    calls = []

    def slow(method):
        def call(*arguments):
            calls.append(method)
            time.sleep(NAP)
            return method(*arguments)

        return call

    for name in ("respond", "stiffness", "tangent", "plastic_model"):
        monkeypatch.setattr(Body, name, slow(getattr(Body, name)))
    scene = upsetting(mu=0.3, reduction=0.02, elements=1)
    run = list(march(scene, Schedule(1), Control(form, ())))
    timings = [accepted.solved.timing for accepted in run]
    # Newton takes the scale of its contacts from one tangent before the first pass.
    before = 1 if isinstance(form, Newton) else 0
    assembly = sum(t.assembly for t in timings)
    assert assembly >= NAP * (len(calls) - before)
    assert assembly + sum(t.build + t.solve for t in timings) <= sum(accepted.seconds for accepted in run)
