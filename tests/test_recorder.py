"""A recorder takes the next increment of its own run, once, in its own block and process; it refuses all else."""

import json
import os
from dataclasses import dataclass, replace

import numpy as np
import pytest

from bipot.errors import ResultsError, SceneError
from bipot.forms import Newton
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT, Column, certificate, energies
from bipot.results.lock import NAME
from tests.scenes import refused

SCENE = upsetting(mu=0.3, reduction=0.1, elements=2)
NEWTON = Control(Newton(), ())


@pytest.fixture(scope="module")
def accepted():
    return list(march(SCENE, Schedule(3), NEWTON))


def recorder(folder, existing=Existing.REFUSE, parameters=None, units=None):
    """That puts each increment on disk."""
    return Recorder(folder, SCENE, [INCREMENT], parameters or {}, units or {}, existing=existing, patience=0)


def numbers(folder):
    return open_results(folder)["increment"].tolist()


@pytest.mark.parametrize("changed", [{"mu": 0.1}, {"elements": 3}, {"height": 11.0}])
def test_an_increment_of_another_scene_is_refused(changed, tmp_path):
    asked = {"mu": 0.3, "reduction": 0.1, "elements": 2}
    other, same = (next(march(upsetting(**asked | made), Schedule(3), NEWTON)) for made in (changed, {}))
    with recorder(tmp_path) as out:
        with pytest.raises(ResultsError, match="increment 1 is of another scene"):
            out.record(other)
        out.record(same)
    assert numbers(tmp_path) == [1]


def test_an_increment_of_another_march_to_the_same_time_is_refused(accepted, tmp_path):
    state = accepted[1].start
    elsewhere = replace(accepted[1], start=replace(state, nodes=state.nodes * (1 + 1e-15)))
    with recorder(tmp_path) as out:
        out.record(accepted[0])
        with pytest.raises(ResultsError, match="does not go on from increment 1"):
            out.record(elsewhere)
        out.record(accepted[1])
    assert numbers(tmp_path) == [1, 2]


def test_what_is_recorded_though_its_copy_failed_is_not_recorded_again(accepted, tmp_path):
    copy = tmp_path / "history.csv"
    with recorder(tmp_path) as out:
        out.record(accepted[0])
        whole = copy.read_text()
        copy.unlink()
        copy.mkdir()
        with pytest.raises(ResultsError, match="increments up to 2 are recorded; make room and resume"):
            out.record(accepted[1])
        copy.rmdir()
        copy.write_text(whole)
        with pytest.raises(ResultsError, match="does not go on"):
            out.record(accepted[1])
        # The copy would have a gap.
        with pytest.raises(ResultsError, match="nothing more is written"):
            out.record(accepted[2])
    with recorder(tmp_path, Existing.RESUME) as out:
        out.record(accepted[2])
    assert numbers(tmp_path) == [1, 2, 3]
    assert copy.read_bytes().decode() == open_results(tmp_path).text


def test_what_was_recorded_when_the_interrupt_came_is_not_recorded_again(accepted, tmp_path, monkeypatch):
    with recorder(tmp_path) as out:
        monkeypatch.setattr(out, "_copy", interrupted)
        with pytest.raises(KeyboardInterrupt):
            out.record(accepted[0])
        with pytest.raises(ResultsError, match="does not go on"):
            out.record(accepted[0])
    assert numbers(tmp_path) == [1]


def interrupted(_):
    raise KeyboardInterrupt


def test_outside_its_block_a_recorder_refuses(accepted, tmp_path):
    out = recorder(tmp_path)
    for _ in range(2):
        with pytest.raises(ResultsError, match="is not open for writing"):
            out.record(accepted[0])
        with out:
            pass
    assert numbers(tmp_path) == []


@pytest.mark.parametrize("existing", Existing)
def test_entered_again_it_goes_on(existing, accepted, tmp_path):
    out = recorder(tmp_path, existing)
    for one in accepted:
        with out:
            out.record(one)
    assert numbers(tmp_path) == [1, 2, 3]


@pytest.mark.parametrize("given", [{"a": np.int64(3)}, {"a": {1, 2}}, {1: 2}, "text", {"a": {1: 2, "b": 3}}])
@pytest.mark.parametrize("name", ["parameters", "units"])
def test_what_is_no_json_is_refused_before_anything_is_written(name, given, tmp_path):
    with pytest.raises(SceneError, match=name):
        recorder(tmp_path / "run", **{name: given})
    assert list(tmp_path.iterdir()) == []


def test_parameters_compare_in_any_order(accepted, tmp_path):
    with recorder(tmp_path, parameters={"a": {"x": 1, "y": 2}}) as out:
        out.record(accepted[0])
    with recorder(tmp_path, Existing.RESUME, parameters={"a": {"y": 2, "x": 1}}) as out:
        assert out.start.number == 1


@dataclass(frozen=True)
class Sampled:
    """A curve of one's own that holds an array: flat."""

    values: np.ndarray

    def yield_stress(self, peeq):
        return self.values[0] + 0 * np.asarray(peeq, float)

    def slope(self, peeq):
        return 0 * np.asarray(peeq, float)


@pytest.mark.parametrize(("size", "change"), [(3, 1e-13), (2000, 1.0)], ids=["last digits", "long"])
def test_materials_that_differ_in_one_number_of_an_array_are_two(size, change, tmp_path):
    values = np.full(size, 300.0)
    changed = values.copy()
    changed[size // 2] += change
    one, other = (upsetting(mu=0.3, hardening=Sampled(given), elements=2) for given in (values, changed))
    with Recorder(tmp_path, one, [INCREMENT], {}, {}):
        pass
    with pytest.raises(ResultsError, match="scene: material"):
        Recorder(tmp_path, other, [INCREMENT], {}, {}, existing=Existing.RESUME)
    same = upsetting(mu=0.3, hardening=Sampled(values.copy()), elements=2)
    Recorder(tmp_path, same, [INCREMENT], {}, {}, existing=Existing.RESUME)


class Plain:
    """A curve of one's own without a repr."""

    def __init__(self, strength):
        self.strength = strength

    def yield_stress(self, peeq):
        return self.strength + 0 * np.asarray(peeq, float)

    def slope(self, peeq):
        return 0 * np.asarray(peeq, float)


def test_a_material_that_only_its_place_in_memory_tells_from_others_is_refused(tmp_path):
    """Another process could not resume the run, or would resume that of another curve at the same place."""
    scene = upsetting(mu=0.3, hardening=Plain(300.0), elements=2)
    with pytest.raises(SceneError, match=r"scene\.material = .*Plain object at 0x.*: must be .* dataclass"):
        Recorder(tmp_path, scene, [INCREMENT], {}, {})
    assert list(tmp_path.iterdir()) == []


def test_a_history_does_not_tell_states_of_the_run_that_replaced_its_own(accepted, tmp_path):
    with recorder(tmp_path) as out:
        out.record(accepted[0])
        early = open_results(tmp_path)
        out.record(accepted[1])
        assert early.state().tau == accepted[0].state.tau
    with Recorder(tmp_path, SCENE, [], {}, {}, existing=Existing.OVERWRITE) as out:
        out.record(accepted[0])
        for ask in (early.state, lambda: early.nodal("gap"), lambda: early.cell("mises"), lambda: early.mesh):
            with pytest.raises(ResultsError, match="holds another run than when it was opened"):
                ask()


@pytest.mark.parametrize("name", ["x" * 300, "a\0b"])
def test_a_name_that_no_system_takes_is_refused(name, tmp_path):
    with pytest.raises((ResultsError, SceneError), match=r"a.*b|File name too long"):
        recorder(tmp_path / name)
    with pytest.raises(ResultsError):
        open_results(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system makes no copies of processes")
def test_a_copy_of_the_process_does_not_give_up_its_lock(tmp_path):
    with recorder(tmp_path) as out:
        if (child := os.fork()) == 0:
            out.__exit__(None, None, None)
            os._exit(0)
        os.waitpid(child, 0)
        assert json.loads((tmp_path / NAME).read_text())["process"] == os.getpid()
        with pytest.raises(ResultsError, match="is writing a run there"), recorder(tmp_path, Existing.RESUME):
            pass


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"scene": None}, "scene = None: must be a Scene"),
        ({"columns": None}, "columns = None: must be a tuple of Column"),
        ({"columns": INCREMENT}, "columns = Column.*: must be a tuple of Column"),
        ({"columns": "increment"}, "columns = 'increment': must be a tuple of Column"),
        ({"columns": ("increment",)}, r"columns\[0\] = 'increment': must be a Column"),
    ],
)
def test_what_is_no_scene_or_column_is_refused(given, words, tmp_path):
    asked = {"scene": SCENE, "columns": (INCREMENT,)} | given
    refused(lambda: Recorder(tmp_path, parameters={}, units={}, **asked), words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"lenght": "mm"}, r"units = 'lenght': must be a quantity, one of \['length', 'force', 'stress', 'energy'\]"),
        ({"length": 1.0}, r"units\['length'\] = 1.0: must be a str"),
        ({"length": None}, r"units\['length'\] = None: must be a str"),
        (["length"], "units = .*: must be values by name"),
    ],
)
def test_units_are_of_quantities(given, words, tmp_path):
    asked = {"scene": SCENE, "columns": (INCREMENT,), "parameters": {}}
    refused(lambda: Recorder(tmp_path, units=given, **asked), words)
    assert not list(tmp_path.iterdir())


def test_what_is_no_column_is_not_made():
    refused(lambda: Column(None, "", lambda _, a: 1), "column.name = None: must be a str")  # type: ignore[arg-type]
    refused(lambda: Column("\ud800", "", lambda _, a: 1), "column.name = .*: must be a text that UTF-8 has")
    refused(lambda: Column("x", "", 1.0), "column 'x': value = 1.0: must be a function")  # type: ignore[arg-type]
    refused(lambda: energies(None), "unit = None: must be a str")  # type: ignore[arg-type]
    refused(lambda: certificate("J", "x"), "factor = 'x': must be a number")  # type: ignore[arg-type]
    refused(lambda: energies("J", 0.0), "factor = 0.0: must be finite and > 0")


@pytest.mark.parametrize("value", [np.zeros(2), np.array(1.0), None, True, np.True_, 1j, [1.0], b"x", "\ud800"])
def test_a_column_of_what_is_no_number_and_no_string_is_refused_and_nothing_is_written(value, accepted, tmp_path):
    given = iter((value, 1.0))
    columns = (INCREMENT, Column("own", "", lambda _, a: next(given)))
    with Recorder(tmp_path, SCENE, columns, {}, {}, patience=0) as out:
        refused(lambda: out.record(accepted[0]), "column 'own' = .*: must be a number or a string")
        refused(lambda: out.record(None), "accepted = None: must be an Accepted")  # type: ignore[arg-type]
        out.record(accepted[0])
    assert open_results(tmp_path)["own"].tolist() == [1.0]


@pytest.mark.parametrize("value", [2**63, -(10**30), 10**5000], ids=["64 bits", "a float", "digits"])
def test_a_whole_number_that_would_not_come_back_is_refused(value, accepted, tmp_path):
    with Recorder(tmp_path, SCENE, (Column("own", "", lambda _, a: value),), {}, {}) as out:
        refused(lambda: out.record(accepted[0]), "column 'own': bits of a whole number = [0-9]+: must be at most 63")


@pytest.mark.parametrize(
    "values",
    [
        ("1_0", "007", " 7"),
        ("1.50", "2.5"),
        ("+1", "1e5"),
        (1, 2, 3),
        (0, 0.5, -0.0),
        (1e30, 2, 1e300),
        (np.float32(0.1), np.int32(3), float("inf")),
    ],
)
def test_what_is_read_is_what_was_recorded(values, accepted, tmp_path):
    """Text that could be read as a number, but is not written so, is text."""
    given = iter(values)
    with Recorder(tmp_path, SCENE, (Column("own", "", lambda _, a: next(given)),), {}, {}) as out:
        for increment, _ in zip(accepted, values, strict=False):
            out.record(increment)
    found = open_results(tmp_path)["own"].tolist()
    assert found == list(values)[: len(found)]
    assert all(isinstance(one, str) == isinstance(value, str) for one, value in zip(found, values, strict=False))
