"""The study of the block: files, forms that agree, closed forms, refusals, what its columns mean."""

import numpy as np
import pytest

from bipot import coulomb, march
from bipot.errors import SceneError
from bipot.results import open as open_results
from studies import block
from studies.upsetting_columns import history_columns

SMALL = ["--elements", "2", "--increments", "3", "--reduction", "0.1"]
ROUTED = ("tangent", "dissipation")


def study(out, *more):
    return block.main([*SMALL, "--out", str(out), *more])


@pytest.fixture(scope="module")
def rubbed(tmp_path_factory):
    """The runs of two coefficients by newton."""
    out = tmp_path_factory.mktemp("block")
    assert study(out, "--mu", "0.1", "0.3", "--fclib") == 0
    return out


def test_a_run_has_the_cylinder_s_files_and_columns_and_the_alternation(rubbed):
    names = [column.name for column in history_columns(0.1)]
    for name in ("mu0.1", "mu0.3"):
        history = open_results(rubbed / name)
        assert list(history.columns) == [*names, "line", "corner", "inner", "edge", "written"]
        assert history.complete
        assert history["reduction"][-1] == 0.1
        assert set(history["form"]) == {"newton"}
        assert not history["cuts"].any()
        assert (history["overlap"] < 1e-8).all()
        assert (rubbed / name / "tools.vtkhdf").exists()
        assert len(list((rubbed / name / "fclib").iterdir())) == len(history)
    for short in ("line", "corner", "inner", "written"):
        assert np.isnan(history[short]).all()
    assert (history["edge"] > 1).all()


def test_the_platen_is_a_square_that_goes_down_with_it(rubbed):
    history = open_results(rubbed / "mu0.3")
    (start,), (end,) = (history.at(tau, by="tau").tools for tau in (0.0, 1.0))
    np.testing.assert_array_equal(start.points[0], start.points[-1])
    np.testing.assert_allclose(start.points[:, 2], 5.0)
    np.testing.assert_allclose(end.points[:, 2], 4.5)
    sides = np.linalg.norm(np.diff(start.points, axis=0), axis=1)
    np.testing.assert_allclose(sides, 2 * 1.25 * history.mesh.size)


def compared(out, reference, mus, *more):
    for form in ROUTED:
        assert block.main([*more, "--mu", *mus, "--form", form, "--solver", "clarabel", "--out", str(out / form)]) == 0
        for mu in mus:
            own, other = (open_results(folder / f"mu{mu}") for folder in (reference, out / form))
            assert set(other["form"]) == {form}
            np.testing.assert_array_equal(other["reduction"], own["reduction"])
            np.testing.assert_allclose(other["force_N"], own["force_N"], rtol=1e-5)


def test_every_exact_form_finds_the_same_forces_on_the_same_increments(rubbed, tmp_path):
    compared(tmp_path, rubbed, ["0.3"], *SMALL)


@pytest.mark.slow
def test_every_exact_form_finds_the_same_forces_to_thirty_per_cent(tmp_path):
    asked, mus = ["--elements", "4", "--increments", "10"], ["0.1", "0.3"]
    assert block.main([*asked, "--mu", *mus, "--out", str(tmp_path / "newton")]) == 0
    compared(tmp_path, tmp_path / "newton", mus, *asked)


@pytest.mark.parametrize("sizes", [(10.0, 10.0, 10.0), (12.0, 8.0, 6.0)])
def test_without_friction_the_force_is_the_yield_stress_times_the_current_area(sizes, tmp_path):
    """Of the full block; its volume is less by the elastic strain of the uniaxial stress -sigma_Y alone."""
    names = ("--width", "--depth", "--height")
    asked = [word for name, size in zip(names, sizes, strict=True) for word in (name, str(size))]
    assert study(tmp_path, "--mu", "0", *asked) == 0
    history = open_results(tmp_path / "mu0")
    assert len(history) == 3
    width, depth = (2 * history.state().nodes[:, d].max() for d in (0, 1))
    assert history["force_N"][-1] == pytest.approx(300 * width * depth, rel=1e-8)
    volume = np.exp(-300 * (1 - 2 * 0.3) / 210e3)
    exact = 300 * sizes[0] * sizes[1] * volume / (1 - history["reduction"])
    np.testing.assert_allclose(history["force_N"], exact, rtol=2e-5)
    np.testing.assert_allclose(history["volume_ratio"], volume, rtol=2e-5)
    radius = np.hypot(width, depth) / 2
    for name in ("contact_radius_mm", "top_corner_radius_mm", "max_radius_mm"):
        assert history[name][-1] == pytest.approx(radius)


def test_work_is_that_of_both_platens_on_the_full_block(rubbed):
    history = open_results(rubbed / "mu0.1")
    spent = np.diff(history["work_J"])
    force = (history["force_N"][1:] + history["force_N"][:-1]) / 2
    # The first increments hold the corner of first yield, which the trapezoidal rule cannot see.
    np.testing.assert_allclose(spent[2:], (force * np.diff(history["reduction"]) * 10.0 * 1e-3)[2:], rtol=1e-3)


def test_weighted_contact_of_quadratic_bricks_is_on_the_upper_face_and_its_force_near_the_limit(tmp_path):
    asked = ["--elements", "2", "--increments", "3", "--mu", "0.1", "--sampling", "weighted", "--reduction", "0.1"]
    assert block.main([*asked, "--element-type", "h20", "--out", str(tmp_path)]) == 0
    run = open_results(tmp_path / "mu0.1")
    assert [tool["sampling"] for tool in run.scene["tools"]] == ["weighted", "nodes"]
    # docs/results/block_limits.csv
    assert run["force_N"][-1] == pytest.approx(34469.8, rel=2e-3)
    assert (run["overlap"] < 1e-3).all()
    work, height = run["work_J"], 10.0 * (1 - run["reduction"])
    spent = -np.diff(height) * (run["force_N"][1:] + run["force_N"][:-1]) / 2
    np.testing.assert_allclose(np.diff(work)[3:], spent[3:] * 1e-3, rtol=1e-2)
    with pytest.raises(SceneError, match="--sampling weighted has no effect on --element-type h8p0: it is linear"):
        block.cases(block.parser().parse_args([*asked, "--element-type", "h8p0"]))


def test_the_coulomb_problems_of_increments_are_solved_to_1e_8_and_have_their_forces(rubbed):
    paths = sorted((rubbed / "mu0.3" / "fclib").iterdir())
    assert len(paths) > 10
    for path in paths:
        problem = coulomb.reduced(coulomb.read_fclib(path))
        assert problem.dim == 3
        answer = coulomb.solve(problem, coulomb.Limits(tol=1e-8))
        assert answer.converged
        assert answer.residual() <= 1e-8
        # The residual is relative to the load: a stiff W gives forces fewer digits.
        assert answer.r[::3].sum() == pytest.approx(coulomb.read_solution(path)["r"][::3].sum(), rel=1e-4)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--mu", "-0.1"], "mu = -0.1: must be >= 0"),
        (["--reduction", "1.2"], "reduction = 1.2: must be in"),
        (["--reduction", "0.004"], "reduction = 0.004: must be > 0.005"),
        (["--elements", "0"], "elements = 0: must be >= 1"),
        (["--elements", "100000"], "elements = 100000: must be"),
        (["--increments", "0"], "increments = 0: must be >= 1"),
        (["--width", "0"], "width = 0.0: must be"),
        (["--depth", "nan"], "depth = nan: must be"),
        (["--nu", "0.5"], "poisson = 0.5: must be"),
        (["--kn", "1e5"], "--kn has no effect on --form newton"),
        (["--solver", "clarabel"], "--solver has no effect on --form newton"),
        (["--fast"], "--fast has no effect on --form newton as asked"),
        (["--mu", "0.3", "0.30"], "--mu = [0.3, 0.3]: must be different"),
    ],
)
def test_bad_input_is_refused_at_once_naming_field_value_and_range(arguments, words, tmp_path, capsys):
    assert study(tmp_path, *arguments) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [["--element-type", "q4p0"], ["--quadrature", "radon7"], ["--form", "magic"]])
def test_unknown_names_are_refused_with_the_known_ones(arguments, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        study(tmp_path, *arguments)
    assert stop.value.code == 2
    assert "choose from" in capsys.readouterr().err


@pytest.mark.slow
def test_results_are_left_alone_unless_resumed_or_overwritten(tmp_path, capsys):
    short = ["--mu", "0", "--elements", "1"]
    assert study(tmp_path, *short) == 0
    before = (tmp_path / "mu0" / "history.csv").read_bytes()
    assert study(tmp_path, *short) == 2
    assert "--resume" in capsys.readouterr().err
    assert study(tmp_path, *short, "--resume") == 0
    assert (tmp_path / "mu0" / "history.csv").read_bytes() == before
    assert study(tmp_path, *short, "--width", "9", "--resume") == 2
    assert "width = 10.0, not 9.0" in capsys.readouterr().err
    assert study(tmp_path, *short, "--width", "9", "--overwrite") == 0


def test_fast_mode_is_of_the_issue_s_cube(tmp_path):
    assert block.main(["--fast", "--mu", "0.3", "--out", str(tmp_path)]) == 0
    history = open_results(tmp_path / "mu0.3")
    assert history["reduction"][-1] == 0.3
    assert (history.scene["element"], history.scene["volume"]) == ("h8", "p0")
    np.testing.assert_array_equal(history.mesh.nodes.max(axis=0), [5.0, 5.0, 5.0])


@pytest.mark.slow
def test_a_block_whose_corners_roll_onto_the_platen_goes_on_and_is_gone_on_with(tmp_path):
    """Three faces of the corner's element are on the platen then, and det J is zero there alone."""
    asked = ["--mu", "0.3", "--elements", "6", "--increments", "8", "--reduction", "0.33", "--out", str(tmp_path)]
    assert block.main(asked) == 0
    history = open_results(tmp_path / "mu0.3")
    assert not history["cuts"].any()
    assert set(history["form"]) == {"newton"}
    landed = int(np.flatnonzero(np.abs(history["min_jacobian"]) < 1e-9)[0])
    assert landed < len(history) - 1
    (case,) = block.cases(block.parser().parse_args(asked))
    again = next(march(case.scene(), case.schedule(), case.control(), history.course(landed)))
    np.testing.assert_allclose(again.state.nodes, history.state(landed + 1).nodes, rtol=1e-9, atol=1e-9)
