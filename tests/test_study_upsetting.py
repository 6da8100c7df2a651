"""The main study from the command line: files, header, refusals, interruption."""

import csv

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.forms import FormName
from bipot.results import open as open_results
from studies import convergence, upsetting

HEADER = [
    "increment",
    "reduction",
    "force_N",
    "contact_radius_mm",
    "top_corner_radius_mm",
    "max_radius_mm",
    "max_peeq",
    "volume_ratio",
    "work_J",
    "elastic_J",
    "plastic_J",
    "friction_J",
    "energy_error",
    "passes",
    "cuts",
    "form",
    "reason",
    "route",
    "contraction",
    "coupling_steps",
    "undetermined",
    "below_resolution",
    "equilibrium",
    "tool_equilibrium",
    "yield_violation",
    "penetration",
    "cone_violation",
    "law",
    "bipotential_gap_J",
    "relative_gap",
    "overlap",
    "min_jacobian",
    "flow_gap",
    "error_estimate",
    "seconds",
]
SMALL = ["--elements", "2", "--increments", "2", "--reduction", "0.05"]


def study(out, *more):
    return upsetting.main([*SMALL, "--out", str(out), *more])


def test_a_run_leaves_a_folder_a_coefficient_and_prints_one_table(tmp_path, capsys):
    assert study(tmp_path, "--mu", "0", "0.3", "inf") == 0
    printed = capsys.readouterr().out
    assert printed.count("relative bipotential gap") == 1
    assert str(tmp_path) in printed
    for name in ("mu0", "mu0.3", "muinf"):
        history = open_results(tmp_path / name)
        assert list(history.columns) == HEADER
        assert history.complete
        assert history["reduction"][-1] == 0.05
        assert (history["force_N"] > 0).all()
    assert len(open_results(tmp_path / "mu0")) == 2


@pytest.mark.slow
def test_the_table_warns_of_an_energy_error_above_one_per_cent_and_names_run_and_value(tmp_path, capsys):
    """The ``paper`` configuration in few increments misses 3 % of the work, the default one 0.3 %."""
    assert upsetting.main(["--fast", "--mu", "0.3", "--form", "newton", "--out", str(tmp_path / "a")]) == 0
    assert "warning" not in capsys.readouterr().out
    rough = ["--fast", "--mu", "0.1", "0.3", "--form", "newton", "--configuration", "paper"]
    assert upsetting.main([*rough, "--out", str(tmp_path / "b")]) == 0
    warnings = [line for line in capsys.readouterr().out.splitlines() if line.startswith("warning")]
    assert len(warnings) == 2
    for line, mu in zip(warnings, ("0.1", "0.3"), strict=True):
        missed = open_results(tmp_path / "b" / f"mu{mu}")["energy_error"]
        assert np.abs(missed).max() > 0.01
        assert f"mu = {mu}: energy_error = {100 * missed[np.abs(missed).argmax()]:.2f} %" in line


@pytest.mark.slow
def test_the_table_shows_the_worst_overlap(tmp_path, capsys):
    assert study(tmp_path, "--mu", "0.3", "--elements", "3", "--reduction", "0.2") == 0
    header, row, *_ = capsys.readouterr().out.splitlines()
    worst = open_results(tmp_path / "mu0.3")["overlap"].max()
    assert worst > 1e-8
    assert row.split()[header.split().index("overlap")] == f"{worst:.1e}"


def test_full_cylinder_quantities(tmp_path):
    """Force of the whole punch, work of both punches: F within the exact one's 1 %, work = force times stroke."""
    study(tmp_path, "--mu", "0", "--increments", "10")
    history = open_results(tmp_path / "mu0")
    radius, force = history["max_radius_mm"][-1], history["force_N"][-1]
    assert force == pytest.approx(300 * np.pi * radius**2, rel=1e-6)
    assert history["work_J"][-1] == pytest.approx(force * 0.5e-3, rel=0.1)
    spent = history["elastic_J"] + history["plastic_J"] + history["friction_J"]
    # The first increment holds the corner of first yield, which the trapezoidal rule cannot see.
    np.testing.assert_allclose(np.diff(history["work_J"])[1:], np.diff(spent)[1:], rtol=1e-3)
    assert history["contact_radius_mm"][-1] == pytest.approx(radius)
    assert history["top_corner_radius_mm"][-1] == pytest.approx(radius)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--mu", "-0.1"], "mu = -0.1: must be >= 0"),
        (["--mu", "nan"], "mu = nan"),
        (["--reduction", "1.2"], "reduction = 1.2: must be in"),
        (["--reduction", "0.004"], "reduction = 0.004: must be > 0.005"),
        (["--elements", "0"], "elements = 0: must be >= 1"),
        (["--increments", "0"], "increments = 0: must be >= 1"),
        (["--hardening", "glassy:300"], "hardening"),
        (["--hardening", "linear:300,-5"], "modulus = -5.0"),
    ],
)
def test_bad_input_is_refused_at_once_naming_field_value_and_range(arguments, words, tmp_path, capsys):
    assert study(tmp_path, *arguments) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments",
    [
        ["--form", "magic"],
        ["--quadrature", "simpson"],
        ["--quadrature", "tetrahedron1"],
        ["--configuration", "end"],
        ["--layout", "fan"],
    ],
)
def test_unknown_names_are_refused_with_the_known_ones(arguments, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        study(tmp_path, *arguments)
    assert stop.value.code == 2
    assert "choose from" in capsys.readouterr().err


@pytest.mark.slow
def test_results_are_left_alone_unless_resumed_or_overwritten(tmp_path, capsys):
    assert study(tmp_path, "--mu", "0") == 0
    before = (tmp_path / "mu0" / "history.csv").read_bytes()
    assert study(tmp_path, "--mu", "0") == 2
    said = capsys.readouterr().err
    assert str(tmp_path / "mu0") in said
    assert "--resume" in said
    assert "--overwrite" in said
    assert study(tmp_path, "--mu", "0", "--resume") == 0
    assert (tmp_path / "mu0" / "history.csv").read_bytes() == before
    assert study(tmp_path, "--mu", "0", "--elements", "3", "--resume") == 2
    assert "elements = 2, not 3" in capsys.readouterr().err
    assert study(tmp_path, "--mu", "0", "--elements", "3", "--overwrite") == 0
    assert open_results(tmp_path / "mu0").parameters["elements"] == 3


@pytest.mark.slow
def test_the_layout_is_of_the_mesh_and_of_the_stored_run(tmp_path, capsys):
    assert study(tmp_path, "--mu", "0.1", "--element-type", "q8p1", "--layout", "fanned") == 0
    run = open_results(tmp_path / "mu0.1")
    assert run.parameters["layout"] == "fanned"
    assert len(run.mesh.elements) == 8
    assert study(tmp_path, "--mu", "0.1", "--element-type", "q8p1", "--layout", "fanned", "--resume") == 0
    assert study(tmp_path, "--mu", "0.1", "--element-type", "q8p1", "--resume") == 2
    assert "layout = fanned, not tensor" in capsys.readouterr().err


@pytest.mark.slow
def test_the_sampling_is_of_the_tool_and_of_the_stored_run_which_resumes(tmp_path, monkeypatch, capsys):
    line = ["--mu", "0.3", "--sampling", "weighted"]
    assert study(tmp_path / "whole", *line) == 0
    with monkeypatch.context() as patched:
        patched.setattr(upsetting, "march", broken(KeyboardInterrupt()))
        assert study(tmp_path / "parts", *line) == 130
    assert study(tmp_path / "parts", *line, "--resume") == 0
    resumed, whole = (open_results(tmp_path / name / "mu0.3") for name in ("parts", "whole"))
    assert resumed.parameters["sampling"] == "weighted"
    np.testing.assert_array_equal(resumed["force_N"], whole["force_N"])
    assert study(tmp_path / "parts", "--mu", "0.3", "--resume") == 2
    assert "sampling = weighted, not nodes" in capsys.readouterr().err


def test_an_interrupted_study_resumes_to_the_history_of_a_whole_one(tmp_path, monkeypatch):
    line = ["--mu", "0.3", "--form", "newton"]
    assert study(tmp_path / "whole", *line) == 0
    with monkeypatch.context() as patched:
        patched.setattr(upsetting, "march", broken(KeyboardInterrupt()))
        assert study(tmp_path / "parts", *line) == 130
    assert study(tmp_path / "parts", *line, "--resume") == 0
    resumed, whole = (open_results(tmp_path / name / "mu0.3") for name in ("parts", "whole"))
    assert len(resumed) == len(whole) > 3
    for name in set(whole.columns) - {"seconds"}:
        np.testing.assert_array_equal(resumed[name], whole[name])


@pytest.mark.slow
def test_no_two_coefficients_share_a_folder(tmp_path):
    assert study(tmp_path, "--mu", "0.1", "0.10000001") == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mu0.1", "mu0.10000001"]
    for name in ("0.1", "0.10000001"):
        assert open_results(tmp_path / f"mu{name}").parameters["mu"] == float(name)


def test_an_output_folder_that_cannot_be_written_is_refused(tmp_path, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert study(blocked / "out", "--mu", "0") == 2
    assert "cannot be written" in capsys.readouterr().err


def broken(raised):
    """A march that ends so after its third increment."""
    real = upsetting.march

    def marching(*arguments):
        for accepted in real(*arguments):
            yield accepted
            if accepted.number == 3:
                raise raised

    return marching


@pytest.mark.parametrize(
    ("raised", "code"), [(KeyboardInterrupt(), 130), (IncrementFailed("no more; use more increments."), 2)]
)
def test_interruption_or_failure_leaves_what_was_computed(raised, code, tmp_path, monkeypatch):
    monkeypatch.setattr(upsetting, "march", broken(raised))
    assert study(tmp_path, "--mu", "0.3") == code
    with (tmp_path / "mu0.3" / "history.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["increment"] for row in rows] == ["1", "2", "3"]
    history = open_results(tmp_path / "mu0.3")
    assert not history.complete
    assert history.state().tau * 0.05 == pytest.approx(0.003)


@pytest.mark.slow
def test_fast_mode_and_hardening(tmp_path):
    code = upsetting.main(["--fast", "--mu", "0.1", "--hardening", "voce:300,100,8", "--out", str(tmp_path)])
    assert code == 0
    assert open_results(tmp_path / "mu0.1")["reduction"][-1] == 0.45


def test_convergence_study_prints_orders_and_writes_every_row(tmp_path, capsys):
    assert convergence.main(["--fast", "--mu", "0", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    order = next(line for line in printed.splitlines() if line.split()[:1] == ["order"]).split()
    # Without friction the midpoint rule is of second order in the increment, in force, work and radius.
    for value in (order[1], order[2], order[4]):
        assert float(value) == pytest.approx(2.0, abs=0.3)
    with (tmp_path / convergence.FILE).open() as file:
        assert len(list(csv.DictReader(file))) == 5


@pytest.mark.parametrize(("values", "order"), [([1.16, 1.04, 1.01], 2.0), ([3.0, 2.0, 1.5], 1.0)])
def test_observed_order(values, order):
    assert convergence.observed_order(values) == pytest.approx(order)


@pytest.mark.parametrize("values", [[1.0, 2.0], [1.0, 2.0, 1.0], [1.0, 2.0, 3.5], [1.0, 1.0, 1.0]])
def test_no_order_is_claimed_where_there_is_none(values):
    assert convergence.observed_order(values) is None


@pytest.mark.parametrize("form", [f.value for f in FormName])
def test_every_form_runs_from_the_command_line(form, tmp_path):
    """Exact forms end at one force; the penalised one near it."""
    assert study(tmp_path, "--mu", "0.1", "--form", form) == 0
    history = open_results(tmp_path / "mu0.1")
    # A fallback for single increments is allowed, and named in the history.
    assert np.mean(history["form"] == form) > 0.8
    assert history["force_N"][-1] == pytest.approx(25509.55, rel=1e-6 if form != "penalty" else 2e-2)


def test_penalties_are_part_of_the_run_and_bad_ones_are_refused(tmp_path, capsys):
    assert study(tmp_path, "--mu", "0.1", "--form", "penalty", "--kn", "1e5", "--kt", "1e5") == 0
    assert open_results(tmp_path / "mu0.1").parameters["kn"] == 1e5
    assert study(tmp_path / "other", "--mu", "0.1", "--form", "penalty", "--kn", "-1") == 2
    assert "K_n = -1.0: must be finite and > 0" in capsys.readouterr().err


@pytest.mark.slow
def test_fclib_files_are_written_on_request(tmp_path):
    assert study(tmp_path, "--mu", "0.3", "--fclib") == 0
    files = sorted((tmp_path / "mu0.3" / "fclib").iterdir())
    assert len(files) == len(open_results(tmp_path / "mu0.3"))
