"""Supports between the axes: a scene turned as a whole keeps its forces, energies and files."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import results
from bipot.errors import ResultsError, SceneError
from bipot.forms import Newton
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.limit_analysis import limit_load
from bipot.marching import Control, Schedule, march
from bipot.results import Existing, Recorder
from bipot.results.columns import INCREMENT
from bipot.results.columns import energies as columns_of_energy
from bipot.results.description import describe
from bipot.scene.loads import Traction
from bipot.scene.supports import Support
from bipot.system import system_of
from tests.golden import FORMS, TIGHT, Case
from tests.inclined import BASE, SCENES, along, body, places, rotation, turned

SCHEDULE = Schedule(3, first=0.05, settling=1, growth=3)
BOTH = list(SCENES)[:2]


@cache
def marched(name, form="newton", turns=False):
    """Every increment of a scene, or of the scene turned, by one form alone.

    Of order one, where an increment says nothing of the way on which a form found it.
    """
    case = Case(turned(SCENES[name]) if turns else SCENES[name], SCHEDULE, Integration.BACKWARD_EULER)
    scene, control = FORMS[form](case)
    return tuple(march(scene, SCHEDULE, control))


def apart(found, expected):
    """The largest difference over the largest number expected."""
    return np.abs(np.asarray(found) - expected).max() / np.abs(expected).max()


def forces(accepted):
    """Tool by tool on the modelled part and on the whole body, and node by node of the supports."""
    whole = [accepted.tool_force(k) for k in range(len(accepted.tool_forces))]
    return np.vstack([accepted.tool_forces, *whole, accepted.solved.iterate.reactions(accepted.solved.r)])


def energies(accepted):
    return [getattr(accepted.energies, name) for name in ("work", "elastic", "plastic", "friction")]


@pytest.mark.parametrize("form", ["newton", "tangent", "dissipation"])
@pytest.mark.parametrize("name", BOTH)
def test_a_pressed_block_turned_by_thirty_degrees_keeps_its_forces(name, form):
    straight, slanted = marched(name, form), marched(name, form, True)
    assert len(straight) == len(slanted) > 3
    assert straight[-1].energies.friction > 0.003 * straight[-1].energies.work
    assert straight[-1].energies.plastic > 0.5 * straight[-1].energies.work
    for before, after in zip(straight, slanted, strict=True):
        assert apart(forces(after) @ rotation().T, forces(before)) < 1e-8
        assert apart(energies(after), energies(before)) < 1e-8


@pytest.mark.parametrize("name", [name for name in SCENES if name not in BOTH])
def test_so_does_every_other_scene_by_newton(name):
    before, after = marched(name)[-1], marched(name, turns=True)[-1]
    assert apart(forces(after) @ rotation().T, forces(before)) < 1e-8
    assert apart(energies(after), energies(before)) < 1e-8
    assert apart(after.state.nodes, places(before.state.nodes)) < 1e-10
    assert apart(after.mises, before.mises) < 1e-8
    assert turned(SCENES[name]).images == SCENES[name].images


def test_with_flow_carried_on_too_where_no_node_lands():
    scene, control = SCENES[BOTH[0]], Control(Newton(), (), Limits(TIGHT))
    *_, before = march(scene, SCHEDULE, control)
    *_, after = march(turned(scene), SCHEDULE, control)
    assert apart(forces(after) @ rotation().T, forces(before)) < 1e-8


def beside_walls():
    """A circle over a wall that holds what it slides along, and a tool that a force drives onto a node that is held."""
    circle, push = SCENES["a circle cut by a plane of symmetry"], SCENES["a tool that a force drives"]
    walled = replace(circle, supports=(Support("left", 0), Support("base", 1)))
    return {"walled": walled, "stopped": replace(push, supports=(*push.supports, Support("right", 1)))}


@pytest.mark.parametrize("name", [*SCENES, *beside_walls()])
def test_what_may_touch_slide_and_push_is_the_same(name):
    scene = (SCENES | beside_walls())[name]
    systems = [system_of(scene), system_of(turned(scene))]
    before, after = (system.candidates for system in systems)
    for field in ("node", "tool", "tangent_free", "tangent_held"):
        np.testing.assert_array_equal(getattr(after, field), getattr(before, field))
    assert [own.tolist() for own in after.held] == [own.tolist() for own in before.held]
    # Where all nodes of a mean are held, turned normals have no more components than straight ones.
    held = np.diff(before.means.weights[:, ~scene.holding.held.any(axis=1)].tocsr().indptr) == 0
    entries = [np.diff(Increment(system, system.rest(), 0.5).rows.G_n.indptr)[held].tolist() for system in systems]
    assert entries[1] == entries[0]


def test_limit_loads_are_those_of_the_scene_that_is_turned():
    perfect = VonMises(Elasticity(2e5, 0.3), Perfect(300.0))
    free = replace(body(BASE, loads=(Traction("top", (10.0, -100.0)),)), material=perfect)
    slanted = replace(free, supports=(*BASE, Support("right", along(25.0))))
    multiples = [limit_load(scene).multiple for scene in (free, slanted)]
    np.testing.assert_allclose([limit_load(turned(scene)).multiple for scene in (free, slanted)], multiples, rtol=1e-8)
    assert multiples[1] > 1.1 * multiples[0]


def test_a_run_is_written_and_goes_on_from_its_file_to_the_last_bit(tmp_path):
    scene, columns = turned(SCENES["between slants"]), (INCREMENT, *columns_of_energy("J", 1e-3))
    control, whole = Control(Newton()), []
    with Recorder(tmp_path, scene, columns, {}, {}) as recorder:
        for accepted in march(scene, SCHEDULE, control):
            whole.append(accepted)
            if accepted.number <= 2:
                recorder.record(accepted)
    with Recorder(tmp_path, scene, columns, {}, {}, existing=Existing.RESUME) as recorder:
        for accepted in march(scene, SCHEDULE, control, start=recorder.start):
            recorder.record(accepted)
    run = results.open(tmp_path)
    assert run["increment"].tolist() == [accepted.number for accepted in whole]
    for k, accepted in enumerate(whole):
        np.testing.assert_array_equal(run.state(k).nodes, accepted.state.nodes)
        np.testing.assert_array_equal(run.state(k).forces, accepted.state.forces)
    said = json.loads(json.dumps(describe(scene)))["supports"][0]
    assert said == {"boundary": "base", "direction": list(scene.supports[0].direction), "symmetry": False}
    other = replace(scene, supports=(Support("base", along(131.0)), scene.supports[1]))
    with pytest.raises(ResultsError, match="scene"):
        Recorder(tmp_path, other, columns, {}, {}, existing=Existing.RESUME)
    with pytest.raises(SceneError, match=r"start\.nodes held ones|start\.nodes = .*where the supports hold them"):
        next(iter(march(other, SCHEDULE, control, start=whole[-2].state)))
