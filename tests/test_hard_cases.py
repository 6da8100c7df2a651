"""Hard cases in their fast mode, and random small scenes that may only end certified or by a BipotError."""

from __future__ import annotations

import csv
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks import memory, page, speed
from benchmarks.rows import Row
from benchmarks.targets import LIMITS, verdicts
from bipot.certificate import Bounds
from bipot.errors import BipotError, SceneError
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, FormName, Newton, Tangent
from bipot.laws.hardening import Linear, Perfect
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.tools.tool import FlatTool
from studies import hard_cases
from studies.hard_scenes import Outcome, Settings, cases
from tests.scenes import rows_between

SMALL = Settings(2, 3)
PROMISED = ("newton", "dissipation")


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    "only",
    [
        "1 mu 10",
        "6 unload",
        "9 corner",
        "9 redundant",
        "12 mu",
        "13 softening",
    ],
)
def test_hard_cases_end_as_they_must(only: str, tmp_path: Path) -> None:
    arguments = ["--fast", "--elements", "2", "--increments", "3", "--only", only, "--out", str(tmp_path)]
    assert hard_cases.main([*arguments, "--forms", *PROMISED]) == 0
    rows = read(tmp_path / "hard_cases.csv")
    assert list(rows[0]) == [f.name for f in fields(hard_cases.Row)]
    assert {row["form"] for row in rows} == set(PROMISED)


@pytest.mark.slow
def test_contacts_listed_twice_cost_no_cut(tmp_path: Path) -> None:
    """Their forces are shared in many ways; the polish takes the nearest, where a singular matrix gave up."""
    arguments = ["--elements", "4", "--increments", "6", "--only", "9 redundant", "--out", str(tmp_path)]
    assert hard_cases.main([*arguments, "--forms", "tangent", "dissipation"]) == 0
    for row in read(tmp_path / "hard_cases.csv"):
        assert (row["cuts"], row["fallbacks"]) == ("0", "0")
        assert int(row["passes"]) <= 6 * int(row["increments"])


def test_a_failing_form_is_recorded_not_raised(tmp_path: Path) -> None:
    """The penalised forms do not weld: the row says stopped, the exit code stays with what is promised."""
    code = hard_cases.main(
        ["--elements", "2", "--increments", "2", "--only", "1 welded", "--forms", "uzawa", "--out", str(tmp_path)]
    )
    (row,) = read(tmp_path / "hard_cases.csv")
    assert (code, row["outcome"], row["as_expected"]) == (0, "stopped", "False")


@pytest.mark.parametrize("name", ["10 mm MPa", "10 m Pa", "10 nm MPa"])
def test_units_do_not_matter(name: str) -> None:
    case = next(case for case in cases() if case.name == name)
    base = next(case for case in cases() if case.name == "10 mm MPa")
    done, reference = (hard_cases.run(c, FormName.NEWTON, SMALL) for c in (case, base))
    assert done.outcome is Outcome.CERTIFIED
    assert done.force / case.unit == pytest.approx(reference.force, rel=1e-8)
    assert [a.passes for a in done.steps] == [a.passes for a in reference.steps]


def test_unloading_separates_and_leaves_stress() -> None:
    """At mu = 0 the body is homogeneous: lifting the punch leaves no stress, and the recoil is elastic."""
    path = ((0.0, 0.0), (0.5, 1.0), (1.0, 0.9))
    scene = upsetting(mu=0.0, reduction=0.1, elements=2)
    scene = replace(scene, tools=(replace(scene.tools[0], path=path),))
    steps = list(march(scene, Schedule(4, landings=(0.5,)), Control(Newton())))
    pressed = next(a for a in steps if a.state.tau == 0.5)
    free = steps[-1]
    force = pressed.solved.r[:, 0].sum()
    assert force == pytest.approx(26164.983, rel=2e-3)
    assert np.abs(free.state.forces).max() <= 1e-9 * force
    assert np.abs(free.state.stress).max() <= 1e-6 * 300.0
    height = free.state.nodes[:, 1].max()
    assert height == pytest.approx(4.5 * np.exp(300.0 / 210_000.0), rel=1e-5)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"path": ((0.0, 0.0), (0.5, 1.0))}, "tool.path"),
        ({"path": ((0.0, 0.0), (1.0, np.nan))}, "tool.path"),
        ({"path": ((0.0, 0.0), (0.5, 1.0), (0.5, 0.0), (1.0, 1.0))}, "tool.path"),
        ({"mu_at": {3: -0.1}}, "mu_at"),
        ({"mu_at": {3: np.inf}}, "mu_at"),
    ],
)
def test_bad_tools_are_refused(changes: dict, field: str) -> None:
    tool = upsetting(mu=0.1, elements=1).tools[0]
    with pytest.raises(SceneError, match=field):
        replace(tool, **changes)


def test_tool_moves_along_its_path() -> None:
    tool = FlatTool((0, 1), (0, -1), (0, -2), ("top",), 0.1, ((0, 0), (0.5, 1), (1, 0.5)))
    np.testing.assert_allclose(tool.moved(0.25, 0.75), [0, -0.5])
    assert tool.face.offset(tool.moved(0.0, 1.0)) == pytest.approx(0.0)


def test_mu_of_a_node_holds_there_only() -> None:
    scene = upsetting(mu=0.2, elements=2)
    node = int(scene.mesh.boundary_nodes("top")[-1])
    scene = replace(scene, tools=(replace(scene.tools[0], mu_at={node: 0.0}),))
    points = system_of(scene).candidates
    rows = rows_between(points, points.distance(scene.mesh.nodes, points.scene.travel(0.0, 0.0)), 0.0, 0.1)
    assert set(rows.mu[points.node == node]) == {0.0}
    assert set(rows.mu[points.node != node]) == {0.2}
    assert node not in points.node[rows.frictional]


@settings(deadline=None, derandomize=True, max_examples=12)
@given(
    mu=st.sampled_from([0.0, 0.05, 0.3, 1.0, np.inf]),
    reduction=st.floats(0.01, 0.3),
    slenderness=st.floats(0.3, 2.0),
    poisson=st.floats(0.0, 0.49),
    modulus=st.floats(0.0, 2000.0),
    ratio=st.floats(100, 10_000),
    increments=st.integers(1, 6),
    lift=st.floats(-0.01, 0.05),
    configuration=st.sampled_from(Configuration),
    seed=st.integers(0, 1000),
)
def test_random_scenes_end_certified_or_by_a_bipot_error(
    mu: float,
    reduction: float,
    slenderness: float,
    poisson: float,
    modulus: float,
    ratio: float,
    increments: int,
    lift: float,
    configuration: Configuration,
    seed: int,
) -> None:
    sigma_y = 210_000 / ratio
    scene = upsetting(
        mu=mu,
        reduction=reduction,
        height=10 * slenderness,
        poisson=poisson,
        hardening=Linear(sigma_y, modulus) if seed % 2 else Perfect(sigma_y),
        elements=2,
        configuration=configuration,
    )
    scene = replace(scene, tools=(replace(scene.tools[0], point=(0.0, 5 * slenderness + lift)),))
    control = Control(Newton(), (Tangent(), Dissipation()), cuts=2)
    try:
        steps = list(march(scene, Schedule(increments), control))
    except BipotError:
        return
    bounds = Bounds()
    assert all(value <= 1 for a in steps for value in a.solved.certificate.ratios(bounds).values())
    assert steps[-1].state.tau == 1.0


@pytest.mark.slow
def test_benchmark_prints_ratios_and_writes_its_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert speed.main(["--fast", "--forms", "newton", "--out", str(tmp_path)]) == 0
    rows = read(tmp_path / "bench.csv")
    assert list(rows[0]) == ["name", "form", "mu", "elements", "kappa_s", "seconds", "ratio"]
    assert {"history", "pass", "increment", "split assembly"} <= {row["name"] for row in rows}
    timed = [row for row in rows if float(row["seconds"]) > 0]
    assert len(timed) > 8
    for row in timed:
        assert float(row["ratio"]) == pytest.approx(float(row["seconds"]) / float(row["kappa_s"]), rel=1e-4)
    (grown,) = (row for row in rows if row["name"] == "growth over factorisation")
    assert float(grown["ratio"]) == 1.0
    (error,) = read(tmp_path / "bench_errors.csv")
    assert float(error["worst"]) < 1e-2
    assert "kappa" in capsys.readouterr().out


def test_a_missed_target_is_named_and_a_met_one_is_not_missed() -> None:
    limit = LIMITS[0]
    for ratio, met in ((limit.most, True), (1.01 * limit.most, False)):
        row = Row(limit.name, limit.form, limit.mu, limit.elements, 1.0, ratio, ratio)
        found = verdicts([row])
        assert found[0] == (limit, ratio)
        assert {ratio for _, ratio in found[1:]} == {None}
        assert speed.report([row], whole=False) == int(not met)
        assert speed.report([row], whole=True) == 1


@pytest.mark.slow
def test_memory_of_a_run_does_not_grow_with_its_increments() -> None:
    whole, grown = memory.measured(10, 8)
    assert 0.01 < whole < 1.0
    assert grown < 0.01


def test_the_table_of_limits_on_the_page_is_that_of_the_results() -> None:
    docs = Path(__file__).parents[1] / "docs"
    text = (docs / "robustness.md").read_text(encoding="utf-8")
    assert page.written(text, page.read(docs / "results" / "bench.csv")) == text
    assert "not measured" not in text
