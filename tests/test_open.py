"""A run opened: a frame of its columns, steps by value, fields by name at nodes and points; tools as moving lines."""

import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest

import bipot
from bipot import (
    block,
)
from bipot.errors import ResultsError, SceneError
from bipot.fem.elements import RULES, tabulated
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from bipot.results import Existing
from bipot.results.fields import Averaging
from tests.recording import SCENE, recorder


@pytest.fixture(scope="module")
def run(recorded):
    return bipot.results.open(recorded)


@pytest.mark.slow
def test_columns_are_a_frame_of_pandas(run):
    frame = run.frame()
    assert list(frame.columns) == list(run.columns)
    assert len(frame) == len(run)
    np.testing.assert_array_equal(frame["work_J"].to_numpy(), run["work_J"])


def test_importing_and_opening_needs_no_pandas_and_a_frame_says_so(recorded, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setattr("bipot.results.history.find_spec", lambda name: None)
    opened = bipot.results.open(recorded)
    with pytest.raises(ResultsError, match=r"frame\(\) needs pandas: pip install bipot\[frames\]"):
        opened.frame()


def test_a_run_and_its_steps_are_told_in_a_line_and_compared_by_what_they_are(recorded, run):
    assert repr(run) == f"History('{recorded / 'run.vtkhdf'}': complete, {len(run)} increments to tau = 1)"
    again = bipot.results.open(recorded)
    assert run == run
    assert run != again
    assert len({run, again}) == 2
    assert len(repr(run.at())) < 500
    assert run.at() == again.at()


def test_a_step_is_the_recorded_one_nearest_to_a_value(run, marched):
    reductions = run["reduction"]
    for row, reduction in enumerate(reductions):
        snapshot = run.at(float(reduction))
        assert snapshot.step == row + 1
        assert snapshot.tau == marched[row].state.tau
        np.testing.assert_array_equal(snapshot.nodes, marched[row].state.nodes)
    between = 0.4 * reductions[1] + 0.6 * reductions[2]
    assert run.at(between).step == 3
    assert run.at((reductions[1] + reductions[2]) / 2 - 1e-9).step == 2
    assert run.at().step == len(run)
    assert run.at(2, by="increment").step == 2
    assert run.at(0.0, by="tau").step == 0
    np.testing.assert_array_equal(run.at(0.0, by="tau").nodes, SCENE.mesh.nodes)


@pytest.mark.parametrize(
    ("value", "by", "words"),
    [
        (0.3, None, r"reduction = 0\.3: must be in \[0\.001, 0\.2\], what is recorded"),
        (0.0, None, r"reduction = 0\.0: must be in \[0\.001"),
        (-0.1, "tau", r"tau = -0\.1: must be in \[0, 1\]"),
        (1, "passes", r"by = 'passes': must be tau, or a column of numbers that increase"),
        (1, "form", r"by = 'form': must be tau"),
        (0, "cuts", r"by = 'cuts': must be tau, or a column of numbers that increase"),
        (1, "temperature", r"by = 'temperature': must be one of \['tau', 'increment'"),
        (np.nan, "tau", "tau = nan"),
        ("end", None, "reduction = 'end'"),
    ],
)
def test_values_that_are_not_recorded_are_refused(run, value, by, words):
    with pytest.raises(SceneError, match=words):
        run.at(value, by)


def test_a_range_is_told_in_all_digits_where_few_would_hold_the_value_that_is_refused(run):
    ends = 0.2 * (1 - 1e-15)
    stroke = {**run.columns, "stroke": run["reduction"] * (1 - 1e-15)}
    with pytest.raises(SceneError, match=rf"stroke = 0\.2: must be in \[.*, {ends!r}\], what is recorded"):
        replace(run, columns=stroke).at(0.2, by="stroke")


def test_fields_of_integration_points_are_those_of_the_state(run, marched):
    last, state = run.at(), marched[-1].state
    for name in ("mises", "pressure", "peeq"):
        np.testing.assert_array_equal(last.points(name), getattr(state, name))
    for name in ("stress", "plastic_strain"):
        tensors = last.points(name)
        assert tensors.names == ("rr", "zz", "tt", "rz")
        for part in tensors.names:
            np.testing.assert_array_equal(last.points(f"{name}_{part}"), getattr(marched[-1], name)[part])
    np.testing.assert_array_equal(run.points("mises", 0), marched[0].mises)


def test_components_of_nodes_and_elements_have_the_names_of_the_geometry(run):
    last = run.at()
    for k, part in enumerate(("rr", "zz", "tt", "rz")):
        np.testing.assert_array_equal(last.nodal(f"stress_{part}"), last.nodal("stress")[:, k])
        np.testing.assert_array_equal(last.cell(f"stress_{part}"), last.cell("stress")[:, k])
    np.testing.assert_array_equal(last.nodal("displacement_r"), last.nodes[:, 0] - run.mesh.nodes[:, 0])
    assert (last.nodal("stress_zz") < 0).all()


@pytest.mark.parametrize("place", ["nodal", "cell", "points"])
@pytest.mark.parametrize("name", ["temperature", "stress_xx", "stress_", "mises_zz", ""])
def test_unknown_fields_are_refused_with_the_known_ones(run, place, name):
    with pytest.raises(SceneError, match=rf"field = '{name}': must be one of .*'stress'.*'stress_zz'"):
        getattr(run.at(), place)(name)


def test_fields_have_a_meaning_and_the_runs_units(run):
    nodes = run.fields["nodes"]
    assert nodes["displacement"]["unit"] == "mm"
    assert nodes["velocity"]["unit"] == "mm per unit of pseudo-time"
    assert nodes["mises"]["unit"] == nodes["contact_pressure"]["unit"] == "N/mm^2"
    assert nodes["stress"]["components"] == ["rr", "zz", "tt", "rz"]
    assert run.fields["integration points"]["peeq"]["unit"] == "1"
    assert all(field["meaning"] for fields in run.fields.values() for field in fields.values())


def test_averages_at_nodes_are_near_the_points_around(run):
    """Perfect plasticity: the stress at every node of the yielding body is the yield stress, as at all points."""
    last = run.at()
    assert (last.points("peeq") > 0).all()
    np.testing.assert_allclose(last.nodal("mises"), 300.0, rtol=1e-6)
    np.testing.assert_allclose(last.nodal("plastic_strain")[:, :3].sum(axis=1), 0, atol=1e-6)


@pytest.mark.parametrize("element", Element)
def test_linear_functions_come_back_at_the_nodes(element):
    """And constants alone by a rule of one point; in elements of one shape, whose volumes tell nothing."""
    flat = element.dimension == 2
    mesh = block(3.0, 2.0, 3, 2, element=element) if flat else brick(3.0, 2.0, 1.0, 3, 2, 1, element=element)
    slopes = np.array([2.0, -3.0, 5.0])[: element.dimension]
    for rule in RULES[element]:
        reference = tabulated(element, rule)
        at_points = np.einsum("qk,ekd->eqd", reference.values, mesh.nodes[mesh.elements])
        values = np.concatenate([np.ones_like(at_points[..., :1]), at_points @ slopes[:, None]], axis=-1)
        volume = np.ones(values.shape[:2]) / len(reference.weights)
        found = Averaging.of(mesh, rule)(volume, values)
        np.testing.assert_allclose(found[:, 0], 1.0, rtol=1e-13)
        if len(reference.weights) > 1:
            np.testing.assert_allclose(found[:, 1], mesh.nodes @ slopes, atol=1e-12)


@pytest.mark.parametrize("element", Element)
def test_places_of_nodes_are_where_their_shape_functions_are_one(element):
    from bipot.fem.elements import tabulated_at

    found = tabulated_at(element, element.every_place).values
    np.testing.assert_allclose(found, np.eye(element.nodes), atol=1e-14)


def test_a_file_of_another_version_is_neither_read_nor_gone_on_with(recorded, tmp_path):
    path = tmp_path / "run.vtkhdf"
    path.write_bytes((recorded / "run.vtkhdf").read_bytes())
    with h5py.File(path, "r+") as file:
        file["bipot"].attrs["format"] = 1
    for ask in (
        lambda: bipot.results.open(path),
        lambda: recorder(tmp_path, Existing.RESUME),
        lambda: recorder(tmp_path, Existing.REFUSE),
    ):
        with pytest.raises(ResultsError, match=r"run\.vtkhdf: /bipot: format = 1: must be 2: another version wrote it"):
            ask()
