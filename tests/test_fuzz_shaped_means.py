"""The fuzz study's shaped tools in weighted means: errors planted in what nodes of a mean do are found."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.contact.candidates import Candidates
from bipot.errors import SceneError
from bipot.forms import Tangent
from bipot.marching import Control, Schedule, march, system_of
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.meeting import Faces
from bipot.tools.parts import Parts
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.tool import Sampling, ShapedTool
from studies.fuzz import judge as fuzz_judge
from studies.fuzz import points as fuzz_points
from studies.fuzz import whole as fuzz_whole
from studies.fuzz.points import posed
from studies.fuzz.record import setting_of, step_of
from studies.fuzz.row import Outcome
from studies.fuzz.shaped import draw_shaped
from studies.fuzz.turned import turned
from studies.fuzz.unfolded import about
from studies.fuzz.variants import in_units, mirrored, renumbered
from studies.independent.increment import measure
from tests.curved import pressed
from tests.scenes import with_course

PLANTED = 1e-4
WEIGHTED = Sampling.WEIGHTED
CLAMPED = Support("base", 1), Support("base", 0)
RUNS = ["capped", "rolled", "landing"]
CERTIFIED = (3300019, 3300080, 3300116, 3300125)
"""Seeds that take little time: blocks under a ball, under a profile that a moment turns, and by a penalty; a ring."""


def ran(scene, increments=4, control=None):
    return fuzz_judge.Ran(scene, list(march(scene, Schedule(increments), control or Control())), "")


@pytest.fixture(scope="module")
def capped():
    """A ball at the constant shear of 0.4, pressed into half a block of hardening steel."""
    return ran(pressed(mu=np.inf, shear=0.4, sampling=WEIGHTED))


@pytest.fixture(scope="module")
def rolled():
    """A block under a roll that turns and goes on sideways, Orowan's friction at its nodes."""
    turn = Turn(0.1, (0.4, 3.0))
    scene = pressed(surface=Circle((0.4, 3.0), 2.0), travel=(0.02, -0.05), shear=0.5, turn=turn, sampling=WEIGHTED)
    return ran(replace(scene, supports=CLAMPED))


LANDING = replace(
    pressed(surface=Circle((0.3, 2.08), 1.0), travel=(0.1, -0.11), mu=0.3, sampling=WEIGHTED), supports=CLAMPED
)
"""A ball that comes down askew from afar."""


@pytest.fixture(scope="module")
def landing():
    """A ball that comes down askew from afar in one increment."""
    return ran(LANDING, 1)


def last_step(run):
    accepted, setting = run.steps[-1], setting_of(run.scene)
    return setting, step_of(run.scene, setting, accepted, float(np.abs(accepted.state.forces).max()))


def found(run, **contacts):
    """What is said of the last increment with changes to what is known of contact."""
    setting, step = last_step(run)
    changed = replace(step, contacts=replace(step.contacts, **contacts))
    return " ".join(fuzz_judge.broken(measure(setting, changed), exact=True))


def misstated(run, scene=None, accepted=None):
    steps = [*run.steps[:-1], accepted or run.steps[-1]]
    return " ".join(fuzz_whole.misstated(scene or run.scene, steps, fuzz_judge.measured(run)))


def said_of(run):
    return " ".join(what for m in fuzz_judge.measured(run) for what in fuzz_judge.broken(m, exact=True))


@pytest.mark.slow
@pytest.mark.parametrize("run", RUNS)
def test_what_is_right_passes_and_its_means_forces_and_energies_are_the_library_s(run, request):
    right = request.getfixturevalue(run)
    assert said_of(right) == misstated(right) == ""
    _, step = last_step(right)
    iterate, contacts = right.steps[-1].solved.iterate, step.contacts
    # Means of nodes that are off the tool beside others that it pushes in between them.
    assert len(contacts.normal) > len(contacts.node)
    np.testing.assert_allclose(contacts.cap, iterate.rows.cap, rtol=1e-12)
    np.testing.assert_allclose(contacts.gap(step.end.nodes), iterate.motion[:, 0], atol=1e-14)
    np.testing.assert_allclose(contacts.slip(step.displacement), iterate.motion[:, 1], atol=1e-12)
    assert (np.abs(step.end.forces[:, 1]) > 0.999 * contacts.most(step.end.forces))[step.end.forces[:, 0] > 0].any()
    assert contacts.curved is not None
    assert contacts.curved.apart.all() == (run == "landing")


@pytest.mark.slow
@pytest.mark.parametrize("run", RUNS)
def test_gaps_that_are_off_at_one_node_are_found(run, request):
    right = request.getfixturevalue(run)
    contacts = last_step(right)[1].contacts
    one = np.flatnonzero(contacts.parts.owner == np.argmax(right.steps[-1].state.forces[:, 0]))[-1]
    off = np.where(np.arange(len(contacts.normal)) == one, PLANTED, 0.0)
    assert "penetration" in found(right, offset_end=contacts.offset_end + off)
    assert "law" in found(right, offset_end=contacts.offset_end - off)


@pytest.mark.slow
@pytest.mark.parametrize("run", RUNS)
def test_forces_in_one_frame_for_all_nodes_of_a_mean_are_found(run, request):
    right = request.getfixturevalue(run)
    contacts = last_step(right)[1].contacts
    one = np.searchsorted(contacts.parts.owner, contacts.parts.owner)
    assert "equilibrium" in found(right, normal=contacts.normal[one])


@pytest.mark.parametrize("run", ["rolled", "capped"])
def test_caps_of_areas_of_nodes_are_found(run, request):
    """Those of hats are three times those of the ends' own shape functions on straight edges."""
    right = request.getfixturevalue(run)
    contacts = last_step(right)[1].contacts
    assert "law" in found(right, cap=contacts.cap / 3)
    assert "law" in found(right, cap=contacts.cap * (1 - 1e-2))


def test_a_library_that_meets_the_mean_place_is_found(monkeypatch):
    """One gap, slip and frame a candidate, where its mean of places is."""
    monkeypatch.setattr(Candidates, "parts", property(lambda self: Parts.whole(self.means.count)))
    said = said_of(ran(pressed(sampling=WEIGHTED), 2, Control(Tangent())))
    for word in ("equilibrium", "law"):
        assert word in said, word


def test_a_library_in_which_one_node_slips_for_its_mean_is_found(monkeypatch):
    whole = Parts.motion
    monkeypatch.setattr(Parts, "motion", lambda self, of: np.column_stack([whole(self, of)[:, 0], of[self.first, 1]]))
    run = ran(pressed(mu=0.3, sampling=WEIGHTED), 2)
    assert "law" in said_of(run) + misstated(run)


@pytest.mark.parametrize("share", [0.0, 0.99])
def test_a_library_that_lets_candidates_land_too_early_is_found(monkeypatch, share):
    """As if all of the way, or a hundredth of what is in the air, were a slip."""
    whole = Faces.in_air
    monkeypatch.setattr(Faces, "in_air", lambda self, apart, *way: share * whole(self, apart, *way))
    assert "energies off" in misstated(ran(LANDING, 1))


def test_a_library_in_which_nodes_land_one_by_one_is_found(monkeypatch):
    def alone(self, apart, x, *way):
        parts = Parts.whole(len(x))
        return whole(replace(self, parts=parts), apart[self.parts.owner], x, *way)

    whole = Faces.in_air
    monkeypatch.setattr(Faces, "in_air", alone)
    assert "energies off" in misstated(ran(LANDING, 1))


@pytest.mark.slow
def test_work_of_tools_and_moments_that_are_off_are_found(rolled, landing):
    for run in (rolled, landing):
        last = run.steps[-1]
        energies = replace(last.energies, work=last.energies.work * (1 + 1e-6))
        assert "energies off" in misstated(run, accepted=with_course(last, energies=energies))
    other = replace(rolled.scene.tools[0], turn=Turn(0.1, (0.4, 3.0 + 1e-6)))
    assert "moment of tool 0" in misstated(rolled, replace(rolled.scene, tools=(other,)))


@pytest.mark.slow
def test_what_drives_a_roll_is_the_sum_over_nodes_and_it_may_be_turned_in_the_plane():
    turn = Turn(0.0, (0.4, 3.0), driven_by=Moment(2.0))
    pressing = {"travel": (0.0, 0.0), "driven_by": Force((0.0, -40.0)), "turn": turn, "sampling": WEIGHTED}
    scene = pressed(elements=2, surface=Circle((0.4, 3.0), 2.0), mu=0.3, **pressing)
    run = ran(replace(scene, supports=(Support("base", 1), Support("right", (0.6, 0.8)))))
    assert said_of(run) == misstated(run) == ""
    for other in (Turn(0.0, (0.4, 3.0), driven_by=Moment(2.0 * (1 + PLANTED))), replace(turn, centre=(0.4001, 3.0))):
        tool = replace(run.scene.tools[0], turn=other)
        assert "driven" in said_of(replace(run, scene=replace(run.scene, tools=(tool,))))
    seen = turned(run.scene, 0.7)
    force, move, count = fuzz_judge.disagreement(run, fuzz_judge.read(seen, ran(seen.scene)), seen, 0.0)
    assert count == len(run.steps)
    assert max(force, move) < fuzz_judge.DISAGREEMENT


@pytest.mark.slow
def test_variants_in_weighted_means_have_the_same_forces_on_nodes(rolled):
    order = np.random.default_rng(1).permutation(len(rolled.scene.mesh.nodes))
    elements = np.arange(len(rolled.scene.mesh.elements))
    seen = (in_units(rolled.scene, 1e3, 1e-3), mirrored(rolled.scene, 0), renumbered(rolled.scene, order, elements))
    for variant in seen:
        force, move, count = fuzz_judge.disagreement(rolled, ran(variant.scene), variant, 0.0)
        assert count == 4
        assert max(force, move) < fuzz_judge.DISAGREEMENT


def test_means_in_a_plane_of_symmetry_are_those_of_the_unfolded_body():
    half = ran(pressed(elements=2, mu=0.2, shear=0.6, sampling=WEIGHTED), 2)
    plane = half.scene.supports[1]
    assert isinstance(plane, Symmetry)
    other = about(half.scene, plane)
    whole = ran(other.scene, 2)
    assert said_of(whole) == misstated(half) == ""
    force, move, count = fuzz_judge.disagreement(half, whole, other, 0.0)
    assert count == 2
    assert max(force, move) < fuzz_judge.DISAGREEMENT


def drawn(seeds):
    """Those scenes of seeds that the library takes."""
    out = {}
    for seed in seeds:
        try:
            out[seed] = draw_shaped(seed).scene
        except SceneError:
            continue
    return out


def in_means(scene):
    return [t for t in scene.tools if isinstance(t, ShapedTool) and t.sampling is WEIGHTED]


@pytest.mark.slow
def test_shaped_tools_in_means_are_drawn_with_the_library_s_candidates():
    found = [scene for scene in drawn(range(3300000, 3300060)).values() if in_means(scene)]
    tools = [tool for scene in found for tool in in_means(scene)]
    assert any(tool.capped for tool in tools)
    assert any(tool.turn is not None for tool in tools)
    assert all(scene.mesh.element.quadratic for scene in found)
    for scene in found:
        points, known = posed(scene, setting_of(scene)), system_of(scene).candidates
        np.testing.assert_array_equal(
            np.column_stack([points.node, points.tool]), np.column_stack([known.node, known.tool])
        )
        np.testing.assert_allclose(points.weights, known.means.weights.toarray(), rtol=0, atol=1e-13)
        np.testing.assert_array_equal((points.weights != 0), known.means.weights.toarray() != 0)
        np.testing.assert_array_equal(points.rubs, known.tangent_free)
        np.testing.assert_array_equal(points.fixed, known.tangent_held)
        for k, number in enumerate(known.number):
            np.testing.assert_array_equal(points.number[points.tool == k], np.flatnonzero(number >= 0))


@pytest.mark.slow
def test_means_at_shaped_tools_are_drawn_by_a_stream_of_their_own(monkeypatch):
    seeds = range(3300000, 3300060)
    known = drawn(seeds)
    quadratic = [scene for scene in known.values() if scene.mesh.element.quadratic]
    assert 0.25 < sum(bool(in_means(scene)) for scene in quadratic) / len(quadratic) < 0.55
    sampled = fuzz_points.sampled
    monkeypatch.setattr("studies.fuzz.shaped.sampled", lambda rng, mesh, tools: tools)
    assert sampled is fuzz_points.sampled
    for seed, scene in drawn(seeds).items():
        assert not in_means(scene)
        other = known[seed]
        assert (other.supports, other.loads) == (scene.supports, scene.loads)
        for tool, one in zip(scene.tools, other.tools, strict=True):
            assert set(one.mu_at) <= set(tool.mu_at)
            assert set(one.shear_at) <= set(tool.shear_at)
            assert replace(tool, sampling=one.sampling, mu_at=one.mu_at, shear_at=one.shear_at) == one


@pytest.mark.parametrize("seed", CERTIFIED)
def test_drawn_scenes_in_means_and_their_variants_pass_the_recomputation(seed):
    scene = draw_shaped(seed).scene
    assert in_means(scene)
    assert fuzz_judge.judge_shaped(seed).outcome is Outcome.CERTIFIED
