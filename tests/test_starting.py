"""A start state that no march of the scene leaves is refused by name; every one that a march leaves is taken."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.control.course import Course
from bipot.errors import SceneError
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, Newton, Penalty
from bipot.laws.hardening import Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.sections import block
from bipot.paper import as_written, upsetting
from bipot.paths import Amplitude
from bipot.scene.loads import BodyForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Symmetry
from bipot.tensors import equivalent_stress
from bipot.tools.poses import Force
from tests.scenes import bar, refused, scene, tool

NAN = float("nan")


def started(**options):
    """A state half-way through a small upsetting."""
    path = march(
        upsetting(**({"mu": 0.1, "elements": 2, "reduction": 0.02} | options)),
        Schedule(2, first=0.05, settling=1, growth=4.0),
    )
    return next(path).state


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"elements": 3}, r"start.nodes = 'of shape \(21, 2\)': must be of shape \(40, 2\), as in the scene"),
        ({"quadrature": Quadrature.GAUSS2}, r"start.stress = 'of shape \(4, 7, 4\)': must be of shape \(4, 4, 4\)"),
    ],
)
def test_a_start_state_of_another_scene_is_refused(options, words):
    state = started()
    refused(lambda: march(upsetting(mu=0.1, **({"elements": 2} | options)), Schedule(2), start=state), words)


def test_a_start_state_of_the_same_mesh_under_another_path_is_refused():
    other = upsetting(mu=0.1, elements=2, reduction=0.3)
    refused(lambda: march(other, Schedule(2), start=started()), "start.gap = 'distances'.* taken over by handed_on")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (lambda s: {"stress": s.stress * NAN}, "start.stress = 'NaN or infinite'"),
        (lambda s: {"forces": s.forces[:-1]}, "start.forces = 'of shape .* taken over by handed_on"),
        (lambda s: {"nodes": s.nodes + 1.0}, "start.nodes = 'held ones': must be where the supports hold them"),
        (lambda s: {"gap": s.gap + 0.1}, "start.gap = 'distances': must be those of start.nodes to the scene's tools"),
        (lambda s: {"flow": replace(s.flow, strain=s.flow.strain[:1])}, "start.flow.strain = 'of shape"),
        (lambda s: {"peeq": s.peeq - 1.0}, "start.peeq = .*: must be >= 0"),
        (lambda _: {"tau": NAN}, "start.tau = nan"),
        (lambda _: {"tau": 1.5}, "start.tau = 1.5: must be in"),
    ],
)
def test_a_start_state_with_impossible_values_is_refused(changes, words):
    state = started()
    own = upsetting(mu=0.1, elements=2, reduction=0.02)
    assert next(march(own, Schedule(2, first=0.05, settling=1, growth=4.0), start=state)).number == 1
    refused(lambda: march(own, Schedule(2), start=replace(state, **changes(state))), words)


@pytest.fixture(scope="module")
def pressed_once():
    pressed = upsetting(mu=0.3, elements=2, reduction=0.02)
    return pressed, next(march(pressed, Schedule(2, first=0.2, settling=1))).state


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda state: {"stress": 10 * state.stress}, "start.stress"),
        (lambda state: {"stress": 1e200 * state.stress}, "start.stress"),
        (lambda state: {"length": float("nan")}, "start.length"),
        (lambda state: {"length": "1"}, "state.length"),
        (lambda state: {"length": -1.0}, "start.length"),
        (lambda state: {"length": 1e-300}, "start.length"),
        (lambda state: {"flow": "none"}, "state.flow"),
    ],
)
def test_a_start_that_no_march_leaves_is_refused(pressed_once, change, field):
    pressed, state = pressed_once
    with pytest.raises(SceneError, match=field):
        march(pressed, Schedule(2), start=replace(state, **change(state)))


def test_a_start_of_a_stronger_material_is_refused(pressed_once):
    _, state = pressed_once
    with pytest.raises(SceneError, match=r"start.stress.*another material"):
        march(upsetting(mu=0.3, elements=2, reduction=0.02, hardening=Perfect(100.0)), Schedule(2), start=state)


@pytest.mark.parametrize("factor", [0.0, 0.99, 1.01, 1e8])
@pytest.mark.parametrize("row", [0, 1])
@pytest.mark.parametrize("configuration", Configuration)
def test_a_start_whose_forces_its_stress_does_not_carry_is_refused(configuration, row, factor):
    """They are the scale of the cone measure: with forces of 1e12 any other is within their round-off of the cone."""
    pressed = upsetting(mu=0.3, elements=2, reduction=0.02, configuration=configuration)
    state = next(march(pressed, Schedule(2, first=0.2, settling=1))).state
    forces = state.forces.copy()
    forces[:, row] *= factor
    with pytest.raises(SceneError, match=r"start.forces.*in balance with start.stress"):
        march(pressed, Schedule(2), start=replace(state, forces=forces))


ON = Amplitude(((0.0, 1.0), (1.0, 1.0)))


@pytest.mark.parametrize(
    "pressing",
    [
        {"loads": (Pressure("right", 1.0, ON),)},
        {"loads": (BodyForce((0.0, 1.0), ON),)},
        {"tools": (tool(driven_by=Force((0.0, -10.0), ON), travel=(0.0, 0.0)),)},
    ],
    ids=["pressure", "body", "driven"],
)
def test_a_body_at_rest_is_a_start_whatever_is_on_from_the_first_moment(pressing):
    """It is the first increment's: ``march(scene, schedule, start=recorder.start)`` is a march from rest."""
    pressed = scene(**({"tools": (tool(travel=(0.0, 0.0)),)} | pressing))
    own = next(march(pressed, Schedule(2)))
    again = next(march(pressed, Schedule(2), start=Course.of(system_of(pressed).rest())))
    assert np.array_equal(own.state.nodes, again.state.nodes)
    later = replace(own.state, forces=2 * own.state.forces)
    refused(lambda: march(pressed, Schedule(2), start=later), "start.forces = 'contact forces'")
    # A body that carries them already may be at the beginning, too.
    assert next(march(pressed, Schedule(2), start=replace(own.state, tau=0.0, length=0.0))).number == 1


def test_a_start_with_forces_along_what_is_held_is_refused():
    """No unknown feels them; on the axis, and so of no equilibrium."""
    pressed = upsetting(mu=0.3, elements=2, reduction=0.02)
    state = next(march(pressed, Schedule(2, first=0.2, settling=1))).state
    forces = state.forces.copy()
    forces[~system_of(pressed).candidates.tangent_free, 1] = 1e12
    with pytest.raises(SceneError, match=r"start.forces = 'tangential ones'"):
        march(pressed, Schedule(2), start=replace(state, forces=forces))


@pytest.mark.parametrize(("off", "within"), [(0.9, True), (1.1, False)])
def test_round_off_of_a_start_ends_at_its_bound(pressed_once, off, within):
    """Places and gaps by 1e-9 of the body's size, stresses by 1e-8 of the yield stress."""
    pressed, state = pressed_once
    by = off * 1e-9 * pressed.mesh.size
    nodes, gap = state.nodes.copy(), state.gap + by
    base = pressed.mesh.boundary_nodes("base")
    nodes[base, 1] -= by
    ratio = (pressed.material.yield_stress(state.peeq) / equivalent_stress(state.stress)).min()
    for changes, field in (
        ({"nodes": nodes}, "start.nodes = 'held ones'"),
        ({"gap": gap}, "start.gap = 'distances'"),
        (
            {"stress": ratio * (1 + off * 1e-8) * state.stress, "forces": ratio * state.forces},
            " of the yield stress': must be",
        ),
    ):
        start = replace(state, **changes)
        if within:
            march(pressed, Schedule(2), start=start)
        else:
            refused(lambda start=start: march(pressed, Schedule(2), start=start), field)


def unloaded():
    """A bar of Q8/P1 that a load stretches by less than it yields at, and that it leaves."""
    there_and_back = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)))
    return bar((Traction("right", (10.0, 0.0), there_and_back),), (Symmetry("left", 0), Symmetry("base", 1)))


AS_WRITTEN = as_written(upsetting(mu=0.3), 1e5, 1e5)[1]


def away(pressed):
    """The tool comes, presses and leaves again."""
    punch = replace(pressed.tools[0], point=(0.0, 5.02), path=((0.0, 0.0), (0.8, 1.0), (1.0, -1.0)))
    return replace(pressed, tools=(punch,))


@pytest.mark.parametrize(
    ("marched", "control"),
    [
        (upsetting(mu=0.3, elements=2, reduction=0.05), Control()),
        (upsetting(mu=0.3, elements=2, reduction=0.05, configuration=Configuration.PAPER), Control()),
        (upsetting(mu=0.3, elements=2, reduction=0.05), Control(Penalty(1e5, 1e5), ())),
        (upsetting(mu=0.3, elements=2, reduction=0.05, configuration=Configuration.PAPER), AS_WRITTEN),
        (upsetting(mu=0.3, elements=2, reduction=1e-12), Control(Newton())),
        (away(upsetting(mu=0.2, elements=2, reduction=0.01, hardening=Perfect(1e4))), Control(Newton())),
        (scene(tools=(tool(), tool())), Control()),
        (unloaded(), Control(Newton())),
    ],
    ids=["midpoint", "paper", "penalty", "paper as written", "tiny travel", "lifted off", "two tools", "unloaded"],
)
def test_every_state_of_a_march_is_a_start(marched, control):
    for accepted in march(marched, Schedule(20), control):
        march(marched, Schedule(20), control, accepted.state)


@pytest.mark.parametrize("configuration", list(Configuration))
def test_a_march_of_any_strain_goes_on_from_its_course(configuration):
    """By small strains the pressure of a block that is pulled to nine times its height is not that of its volume."""
    sides = (Symmetry("left", 0), Symmetry("base", 1), Prescribed("top", 1, 8.0))
    material = Elastic(Elasticity(1e3, 0.0))
    scene = Scene(block(1.0, 1.0, 1, 1), Geometry.PLANE_STRAIN, material, sides, (), configuration=configuration)
    whole = list(march(scene, Schedule(5), Control(Newton())))
    (rest,) = march(scene, Schedule(5), Control(Newton()), start=whole[-2].course)
    np.testing.assert_array_equal(rest.state.nodes, whole[-1].state.nodes)


def test_a_state_in_which_a_tool_is_still_in_the_air_is_taken_with_what_is_left_of_balance():
    """A body that rests has no travel by which the round-off of its answer could be known."""
    given = upsetting(mu=0.3, elements=2, reduction=0.04)
    (punch,) = given.tools
    above = replace(given, tools=(replace(punch, point=(0.0, punch.point[1] + 0.08)),))
    path, conic = Schedule(4), Control(Dissipation(), ())
    for step in march(above, path, conic):
        assert (step.state.length == 0) == (step.number == 1)
        next(march(above, path, conic, start=step.course), None)
