"""The fuzz study's curved, turning and capped tools: errors planted in accepted increments are found, none else is."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.marching import Schedule, march
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.tool import FlatTool
from studies.fuzz import judge as fuzz_judge
from studies.fuzz import whole as fuzz_whole
from studies.fuzz.record import setting_of, step_of
from studies.fuzz.row import Outcome
from studies.fuzz.shaped import draw_shaped
from studies.fuzz.turned import turned
from studies.fuzz.unfolded import about
from studies.fuzz.variants import in_units, mirrored, renumbered
from studies.independent.increment import measure
from tests.curved import PUNCH, pressed
from tests.scenes import with_course

PLANTED = 1e-4

CERTIFIED = (730009, 730013, 730011, 20000050)
"""Seeds of scenes that take little time: a block under a ball, a cylinder under one whose friction is capped, a block
between slants under a profile that a force presses and a moment turns, and a ring under one whose line goes down beyond
the axis, through the ring's mirror image."""


def ran(scene, increments=4):
    return fuzz_judge.Ran(scene, list(march(scene, Schedule(increments))), "")


@pytest.fixture(scope="module")
def capped():
    """A ball at the constant shear of 0.4, pressed into a block of hardening steel."""
    return ran(pressed(mu=np.inf, shear=0.4, elements=2))


@pytest.fixture(scope="module")
def rolled():
    """A block under a roll that turns and goes on sideways, Orowan's friction at its nodes."""
    scene = pressed(elements=2, surface=Circle((0.4, 3.0), 2.0), travel=(0.02, -0.05), mu=0.3, shear=0.5)
    both = (*scene.supports[:1], replace(scene.supports[0], direction=0))
    turning = replace(scene.tools[0], turn=Turn(0.1, (0.4, 3.0)))
    return ran(replace(scene, supports=both, tools=(turning,)))


def last_step(run, accepted=None):
    accepted = accepted or run.steps[-1]
    setting = setting_of(run.scene)
    return setting, step_of(run.scene, setting, accepted, float(np.abs(accepted.state.forces).max()))


def found(run, accepted=None, **contacts):
    """What is said of the last increment, of ``accepted`` in its place, or with changes to what is known of contact."""
    setting, step = last_step(run, accepted)
    changed = replace(step, contacts=replace(step.contacts, **contacts))
    return " ".join(fuzz_judge.broken(measure(setting, changed), exact=True))


def misstated(run, scene=None, accepted=None):
    steps = [*run.steps[:-1], accepted or run.steps[-1]]
    return " ".join(fuzz_whole.misstated(scene or run.scene, steps, fuzz_judge.measured(run)))


RUNS = ["capped", "rolled"]


@pytest.mark.parametrize("run", RUNS)
def test_what_is_right_passes_and_its_energies_forces_and_moments_are_the_library_s(run, request):
    right = request.getfixturevalue(run)
    assert [fuzz_judge.broken(m, exact=True) for m in fuzz_judge.measured(right)] == [[]] * len(right.steps)
    assert misstated(right) == ""
    _, step = last_step(right)
    iterate, contacts = right.steps[-1].solved.iterate, step.contacts
    assert np.isfinite(contacts.cap).all()
    np.testing.assert_allclose(contacts.cap, iterate.rows.cap, rtol=1e-12)
    np.testing.assert_allclose(contacts.slip(step.displacement), iterate.motion[:, 1], atol=1e-14)
    sliding = np.abs(step.end.forces[:, 1]) > 0.999 * contacts.most(step.end.forces)
    assert (sliding & (step.end.forces[:, 0] > 0)).any()


@pytest.mark.parametrize("run", RUNS)
def test_a_cap_that_is_off_is_found(run, request):
    right = request.getfixturevalue(run)
    contacts = last_step(right)[1].contacts
    assert "law" in found(right, cap=contacts.cap * (1 - 1e-2))
    assert "law" in found(right, cap=np.inf)


@pytest.mark.parametrize("run", RUNS)
def test_a_tool_that_is_elsewhere_is_found(run, request):
    right = request.getfixturevalue(run)
    contacts = last_step(right)[1].contacts
    assert "penetration" in found(right, offset_end=contacts.offset_end + PLANTED)
    larger = replace(right.scene.tools[0], surface=Circle(PUNCH.centre, PUNCH.radius * (1 + PLANTED)))
    other = replace(right, scene=replace(right.scene, tools=(larger,)))
    assert "penetration" in found(other)


@pytest.mark.slow
def test_a_slip_against_a_tool_that_does_not_turn_as_stated_is_found(rolled):
    """Without its turn nodes would slip the other way; with more of it, or around another point, by other lengths."""
    still = replace(rolled.scene, tools=(replace(rolled.scene.tools[0], turn=None),))
    assert "law" in found(replace(rolled, scene=still))
    for turn in (Turn(0.1 * (1 + PLANTED), (0.4, 3.0)), Turn(0.1, (0.4, 3.0 + PLANTED))):
        other = replace(rolled.scene, tools=(replace(rolled.scene.tools[0], turn=turn),))
        assert "energies off" in misstated(replace(rolled, scene=other))


def test_a_normal_that_is_that_of_another_place_is_found(rolled):
    normal = last_step(rolled)[1].contacts.normal
    turned = normal + PLANTED * normal[:, ::-1] * (1.0, -1.0)
    assert "equilibrium" in found(rolled, normal=turned)


def test_a_moment_that_is_not_that_of_the_forces_is_found(rolled):
    other = replace(rolled.scene.tools[0], turn=Turn(0.1, (0.4, 3.0 + 1e-6)))
    assert "moment of tool 0" in misstated(rolled, replace(rolled.scene, tools=(other,)))


@pytest.mark.slow
def test_reactions_that_do_not_balance_tools_are_found(rolled, monkeypatch):
    kind = type(rolled.steps[-1].solved.iterate)
    whole = kind.reactions
    monkeypatch.setattr(kind, "reactions", lambda self, r: (1 + PLANTED) * whole(self, r))
    assert "forces do not balance" in misstated(rolled)
    monkeypatch.setattr(kind, "reactions", lambda self, r: np.roll(whole(self, r), 2))
    assert "moments do not balance" in misstated(rolled)


def test_forces_past_an_open_end_and_tools_between_nodes_are_found(rolled):
    setting, step = last_step(rolled)
    curved = step.contacts.curved
    assert curved is not None
    assert "past" in found(rolled, curved=replace(curved, past=np.ones(len(curved.past), dtype=bool)))
    (tool,) = step.tools
    deeper = replace(tool, ended=tool.ended - np.array([0.0, 0.3, 0.0]))
    said = fuzz_judge.broken(measure(setting, replace(step, tools=(deeper,))), exact=True)
    assert any("between" in what for what in said)


def test_energies_that_are_off_are_found(rolled):
    last = rolled.steps[-1]
    energies = replace(last.energies, friction=last.energies.friction * (1 + PLANTED))
    assert "energies off" in misstated(rolled, accepted=with_course(last, energies=energies))


@pytest.mark.slow
def test_variants_of_curved_turning_tools_have_the_same_forces(rolled):
    order = np.random.default_rng(1).permutation(len(rolled.scene.mesh.nodes))
    elements = np.arange(len(rolled.scene.mesh.elements))
    seen = (in_units(rolled.scene, 1e3, 1e-3), mirrored(rolled.scene, 0), renumbered(rolled.scene, order, elements))
    for variant in seen:
        force, move, count = fuzz_judge.disagreement(rolled, ran(variant.scene), variant, 0.0)
        assert count == 4
        assert max(force, move) < fuzz_judge.DISAGREEMENT


def test_a_ball_that_a_plane_cuts_is_whole_in_the_unfolded_body():
    scene = pressed(elements=2, mu=0.2, shear=0.6)
    plane = scene.supports[1]
    assert isinstance(plane, Symmetry)
    half, other = ran(scene, 2), about(scene, plane)
    assert len(other.scene.tools) == 1
    assert fuzz_judge.disagreement(half, ran(other.scene, 2), other, 0.0)[0] < fuzz_judge.DISAGREEMENT
    assert misstated(half) == ""


@pytest.mark.parametrize("seed", CERTIFIED)
def test_drawn_scenes_with_shaped_tools_pass_the_recomputation(seed):
    assert fuzz_judge.judge_shaped(seed, others=False).outcome is Outcome.CERTIFIED


@pytest.mark.parametrize("seed", [730052, 730093])
def test_energies_of_a_body_that_a_gap_of_round_off_moves_are_not_compared(seed):
    """It moves by its gap to a tool at rest, that no two variants have alike, or that to a sharp tip, at a node."""
    assert fuzz_judge.judge_shaped(seed).outcome is Outcome.CERTIFIED


@pytest.mark.slow
def test_friction_of_round_off_past_an_open_end_is_below_resolution_as_all_is_there():
    """Of a body that has left its tool, with 3e-10 of the yield stress."""
    assert fuzz_judge.judge_shaped(930007).outcome is Outcome.REFUSED


def test_a_weld_without_a_lever_beside_a_tool_that_a_moment_turns_is_diagnosed_in_numbers():
    """What is tied holds whatever is asked of its lever; 0 times inf is no moment, and a warning is an error here."""
    assert fuzz_judge.judge_shaped(910011).outcome is Outcome.REFUSED


@pytest.mark.slow
def test_shaped_tools_of_all_sorts_are_drawn():
    scenes = [drawn for seed in range(750000, 750050) if (drawn := taken(seed)) is not None]
    kinds = " ".join(drawn.kind for drawn in scenes)
    for word in ("circle", "profile", "union", "capped", "turning", "weighted", "block", "cylinder", "ring"):
        assert kinds.count(word) > 1, word
    for word in ("by force", "by moment", "aslant"):
        assert kinds.count(word) > 1, word
    tools = [tool for drawn in scenes for tool in drawn.scene.tools]
    assert any(isinstance(tool, FlatTool) for tool in tools)
    assert any(tool.capped and np.isinf(tool.mu) for tool in tools)
    assert any(tool.capped and np.isfinite(tool.mu) for tool in tools)
    assert any(tool.shear_at for tool in tools)
    assert any(tool.face.concave for tool in tools if isinstance(tool.face, Circle))


def taken(seed):
    """The scene of the seed, None where the library takes none of what is drawn."""
    try:
        return draw_shaped(seed)
    except SceneError:
        return None


@pytest.fixture(scope="module")
def driven():
    """A block under a roll that a force presses and a moment turns, held along slants."""
    scene = pressed(elements=2, surface=Circle((0.4, 3.0), 2.0), travel=(0.0, 0.0), mu=0.3)
    turn = Turn(0.0, (0.4, 3.0), driven_by=Moment(2.0))
    tool = replace(scene.tools[0], driven_by=Force((0.0, -40.0)), turn=turn)
    held = Support("base", 1), Support("right", (0.6, 0.8)), Prescribed("left", (0.8, -0.6), 1e-3)
    return ran(replace(scene, supports=held, tools=(tool,)))


@pytest.mark.slow
def test_what_drives_shaped_tools_and_holds_between_axes_is_right_and_planted_errors_are_found(driven):
    assert [fuzz_judge.broken(m, exact=True) for m in fuzz_judge.measured(driven)] == [[]] * len(driven.steps)
    assert misstated(driven) == ""
    tool, last = driven.scene.tools[0], driven.steps[-1]
    assert abs(last.tool_pose(0)[2]) > 1e-5
    for other in (
        replace(tool, driven_by=Force((0.0, -40.0 * (1 + PLANTED)))),
        replace(tool, turn=replace(tool.turn, driven_by=Moment(2.0 * (1 + PLANTED)))),
        replace(tool, turn=replace(tool.turn, centre=(0.4 + PLANTED, 3.0))),
    ):
        assert "driven" in found(replace(driven, scene=replace(driven.scene, tools=(other,))))
    state = replace(last.state, translated=last.state.translated * (1.0, 1 + PLANTED))
    assert "placed" in found(driven, with_course(last, state=state))
    slanted, drawn = driven.scene.supports[1:]
    for own in ((replace(slanted, direction=(0.8, 0.6)), drawn), (slanted, replace(drawn, displacement=2e-3))):
        other = replace(driven.scene, supports=(driven.scene.supports[0], *own))
        assert "placed" in found(replace(driven, scene=other))
    free = replace(driven.scene, supports=(driven.scene.supports[0], drawn))
    assert "equilibrium" in found(replace(driven, scene=free))


def test_a_scene_that_is_turned_is_judged_as_it_was_and_has_the_same_forces(driven):
    seen = turned(driven.scene, 0.7)
    other = fuzz_judge.read(seen, ran(seen.scene))
    assert [fuzz_judge.broken(m, exact=True) for m in fuzz_judge.measured(other)] == [[]] * len(other.steps)
    force, move, count = fuzz_judge.disagreement(driven, other, seen, 0.0)
    assert count == len(driven.steps)
    assert max(force, move) < fuzz_judge.DISAGREEMENT
    np.testing.assert_allclose(seen.back(other.steps[-1].tool_force(0)), driven.steps[-1].tool_force(0), rtol=1e-6)
