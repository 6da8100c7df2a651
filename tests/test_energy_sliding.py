"""Energies where sliding begins, turns or reverses within an increment: friction is the limit times the slip."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bipot.energy import Energies, Passage, Rule, start_limit
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton, Penalty
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic, Material
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.schedule import Schedule
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool
from studies.fuzz.judge import Ran
from studies.fuzz.record import setting_of, step_of
from studies.fuzz.solid import measured
from studies.independent.increment import measure
from tests.scenes import last, scene, tool
from tests.sheared import CONSTANT, OROWAN, SHORT, slab

MU = 0.2
TRAVEL, DEPTH = 0.1, 0.002
CORK = Elastic(Elasticity(1e3, 0.0))
"""It does not grow wider as it is pressed, so that no friction is built up before the tool goes along it."""

HELD = (Support("base", 0), Support("base", 1))
SLIDE = ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
LIFTED = ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, -4.0)))
LANDED = ((0.0, 0.0), (0.5, (0.0, -2.0)), (1.0, (1.0, 1.0)))
AROUND = ((0.0, 0.0), (0.25, (0.0, 1.0)), (0.5, (1.0, -4.0)), (0.75, (2.0, -4.0)), (1.0, (3.0, 1.5)))
AROUND_3D = tuple((tau, (by[0], 0.3 * by[0], by[1]) if isinstance(by, tuple) else by) for tau, by in AROUND)
THERE_AND_BACK_3D = ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (0.75, (1.0, 1.0, 1.0)), (1.0, (0.0, 1.0, 1.0)))
THERE_AND_BACK = ((0.0, 0.0), (0.5, (0.0, 1.0)), (0.75, (1.0, 1.0)), (1.0, (0.0, 1.0)))


def rubbed(path=SLIDE, material: Material = CORK, **changes):
    """A flat block, pressed by a fiftieth and then slid along."""
    own = {"travel": (TRAVEL, -DEPTH), "mu": MU, "path": path} | changes
    mesh = block(1.0, 0.1, 6, 2, element=Element.Q4)
    return scene(mesh=mesh, material=material, supports=HELD, tools=(tool(point=(0.0, 0.1), **own),))


def marched(asked, parts, path=SLIDE, form=None):
    """The increments of what is pressed in one and slid along in ``parts`` for each leg of the ``path``."""
    legs = [tau for tau, _ in path[1:]]
    within = [a + (b - a) * k / parts for a, b in pairwise(legs) for k in range(1, parts)]
    schedule = Schedule(1, landings=tuple(sorted({*legs[:-1], *within})))
    return list(march(asked, schedule, Control(form or Newton(), fallbacks=())))


def spent(accepted):
    """Friction of the increments by the limit of their normal forces, mean of start and end, along their slips."""
    total = 0.0
    for a in accepted:
        pressed = (a.start.forces[:, 0] + a.state.forces[:, 0]) / 2
        total += float(np.vdot(MU * pressed, np.linalg.norm(a.solved.iterate.motion[:, 1:], axis=1)))
    return total


@pytest.mark.parametrize("parts", [1, 2, 10])
def test_a_tool_that_begins_to_slide_dissipates_the_friction_along_all_of_its_slip(parts):
    accepted = marched(rubbed(), parts)
    assert len(accepted) == 1 + parts
    energies, end = accepted[-1].energies, accepted[-1].state
    normal = -accepted[-1].tool_force(0)[1]
    top = accepted[-1].start.nodes[:, 1] > 0.05
    moved = end.nodes[top, 0] - rubbed().mesh.nodes[top, 0]
    exact = MU * normal * (TRAVEL - moved.mean())
    assert energies.friction == pytest.approx(exact, rel=0.01)
    assert energies.friction == pytest.approx(spent(accepted), rel=1e-6)
    assert energies.work == pytest.approx(energies.elastic + energies.friction, rel=1e-3)
    assert energies.plastic == 0


@pytest.mark.parametrize("parts", [1, 4])
def test_a_tool_that_reverses_dissipates_on_both_ways(parts):
    accepted = marched(rubbed(THERE_AND_BACK), parts, THERE_AND_BACK)
    there, back = (accepted[k].energies.friction for k in (parts, 2 * parts))
    assert back - there == pytest.approx(there, rel=0.03)
    assert back == pytest.approx(spent(accepted), rel=1e-6)
    assert abs(accepted[-1].energies.energy_error) < 5e-3


def columns(path):
    """Friction under a tool that goes along ``path``, of a block that does not grow wider, integrated by small steps.

    It is a spring along the normal and one along the tangent, G/h.
    """
    young, height, fine = 1e3, 0.1, 5000
    times = np.linspace(0.0, 1.0, fine + 1)
    x, depth = (np.interp(times, [t for t, _ in path], [np.broadcast_to(p, 2)[d] for t, p in path]) for d in (0, 1))
    x, depth = x * TRAVEL, depth * DEPTH
    # In strains that count the height as it is.
    pressed = young * np.log(height / (height - np.maximum(depth, 0.0)))
    stiff, pulled, spent = young / (2 * height), 0.0, 0.0
    for limit, by in zip(MU * pressed[1:], np.diff(x), strict=True):
        tried = pulled + stiff * by
        now = np.clip(tried, -limit, limit)
        spent += abs(now) * abs(tried - now) / stiff
        pulled = now
    return spent


@pytest.mark.parametrize("parts", [1, 2, 5])
@pytest.mark.parametrize("path", [LIFTED, LANDED, AROUND], ids=["lifted", "landed", "around"])
def test_slip_in_the_air_is_no_friction(path, parts):
    """Of a tool that is drawn up and along in one increment, or comes down so."""
    accepted = marched(rubbed(path), parts, path)
    assert accepted[-1].energies.friction == pytest.approx(columns(path), rel=0.06)
    assert abs(accepted[-1].energies.imbalance) < 5e-3 * accepted[-1].energies.work


def test_slip_in_the_air_is_that_against_what_carries_the_body():
    """A body that is drawn off its tool, or onto it, instead of the tool off the body; the whole goes up besides."""
    up = 0.01
    for path in (LIFTED, LANDED):
        taus = [tau for tau, _ in path]
        along, down = (np.array([np.broadcast_to(by, 2)[d] for _, by in path]) for d in (0, 1))
        support = (
            Prescribed("base", 0, -TRAVEL, Amplitude(tuple(zip(taus, along.tolist(), strict=True)))),
            Prescribed(
                "base", 1, up, Amplitude(tuple((tau, tau + DEPTH * d / up) for tau, d in zip(taus, down, strict=True)))
            ),
        )
        goes = tuple((tau, (0.0, -up * tau / DEPTH)) for tau in taus[1:])
        carried = replace(rubbed(((0.0, 0.0), *goes)), supports=support)
        one, other = (marched(asked, 1, path)[-1].energies for asked in (rubbed(path), carried))
        assert other.friction == pytest.approx(one.friction, rel=1e-7)
        # What equilibrium is off by does work on the way of the whole.
        assert other.work == pytest.approx(one.work, rel=1e-6)


@pytest.mark.parametrize("rule", Rule)
def test_the_balance_is_what_it_is_by_the_forces_of_start_and_end_alone(rule):
    """To work and friction the same is added, of which the mean of both forces knows nothing."""
    theta, asked = rule.value, rubbed()
    press, slide = marched(asked, 1)
    energies = Energies().after(slide.start, slide.state, slide.solved, rule)
    r = (1 - theta) * slide.start.forces + theta * slide.state.forces
    motion = slide.solved.iterate.motion
    plain = -float(np.vdot(r[:, 1], motion[:, 1]))
    added = (1 - theta) * float(np.vdot(start_limit(slide.start, slide.solved.iterate.increment), np.abs(motion[:, 1])))
    assert (added > 0.4 * energies.friction) == (rule is Rule.TRAPEZOIDAL)
    assert energies.friction == pytest.approx(plain + added, rel=1e-9)
    work = float(np.vdot(r[:, 1], -TRAVEL * np.ones(len(r)))) + added
    assert energies.work == pytest.approx(work, rel=1e-9)
    assert press.energies.friction == 0


def test_friction_whose_direction_turns_has_order_two():
    """A plate goes along an arc on a cork: of the exact work mu N times the arc a part falls off as increments do."""
    cork = replace(CORK, elasticity=Elasticity(1e5, 0.0))
    missing = []
    for parts in (6, 12, 24):
        turns = np.linspace(0.0, np.pi / 2, parts + 1)[1:]
        around = [(0.5 + 0.5 * k / parts, (np.sin(a), 1 - np.cos(a), 1.0)) for k, a in enumerate(turns, 1)]
        path = ((0.0, 0.0), (0.25, (0.0, 0.0, 1.0)), (0.5, (0.0, 0.0, 1.0)), *around)
        plate = FlatTool((0.0, 0.0, 0.1), (0.0, 0.0, -1.0), (1.0, 1.0, -1e-4), ("top",), MU, path)
        held = tuple(Support("base", d) for d in range(3))
        asked = Scene(brick(1.0, 1.0, 0.1, 1, 1, 1), Geometry.SOLID, cork, held, (plate,))
        accepted = list(march(asked, Schedule(1, landings=tuple(tau for tau, _ in path[1:-1]))))
        exact = MU * -accepted[-1].tool_force(0)[2] * np.pi / 2
        missing.append(1 - accepted[-1].energies.friction / exact)
    orders = np.log2(np.abs(np.divide(missing[:-1], missing[1:])))
    np.testing.assert_allclose(orders, 2.0, atol=0.2)


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_the_limit_of_a_start_is_that_of_the_end_before(law):
    """Also of caps, which grow with area and hardening from one increment to the next."""
    accepted = list(march(slab(*law, hardening=Linear(300.0, 2000.0), elements=(4, 2)), SHORT))
    for before, after in pairwise(accepted):
        was = before.solved.rows.limit(before.solved.r)
        np.testing.assert_allclose(start_limit(after.start, after.solved.iterate.increment), was, rtol=1e-12)
    assert np.isfinite(accepted[-1].solved.rows.cap).all()


def test_in_the_configuration_of_the_paper_too():
    asked = replace(slab(*OROWAN, hardening=Linear(300.0, 2000.0), elements=(4, 2)), configuration=Configuration.PAPER)
    for before, after in pairwise(march(asked, SHORT)):
        was = before.solved.rows.limit(before.solved.r)
        np.testing.assert_allclose(start_limit(after.start, after.solved.iterate.increment), was, rtol=1e-9)


@pytest.mark.parametrize("parts", [1, 4])
def test_constant_shear_dissipates_its_cap_along_all_of_the_slip(parts):
    steel = VonMises(Elasticity(210e3, 0.0), Linear(300.0, 100.0))
    asked = rubbed(material=steel, mu=np.inf, shear=0.1)
    accepted = marched(asked, parts)
    cap = accepted[-1].tool_force(0)[0]
    assert cap == pytest.approx(0.1 * 300 / np.sqrt(3), rel=0.03)
    assert accepted[-1].energies.friction == pytest.approx(cap * TRAVEL, rel=2e-2)


@pytest.mark.parametrize("parts", [1, 4])
@pytest.mark.parametrize("law", [{"mu": MU}, {"mu": np.inf, "shear": 0.1}], ids=["coulomb", "constant shear"])
@pytest.mark.parametrize("whose", ["tool", "support"])
def test_friction_between_tool_and_support_counts_once(parts, law, whose):
    """Nodes that a support holds, or drives along a tool at rest."""
    path = SLIDE if whose == "tool" else ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (0.0, 1.0)))
    along = Amplitude(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))
    held = [Support(at, 0) if whose == "tool" else Prescribed(at, 0, TRAVEL, along) for at in ("base", "top")]
    steel = VonMises(Elasticity(1e5, 0.0), Linear(3000.0, 0.0))
    asked = replace(rubbed(path, steel, **law), supports=(Support("base", 1), *held))
    accepted = marched(asked, parts)
    pressed, slid = accepted[0].energies, accepted[-1].energies
    limit = MU * -accepted[-1].tool_force(0)[1] if "shear" not in law else 0.1 * 3000 / np.sqrt(3)
    assert slid.friction - pressed.friction == pytest.approx(limit * TRAVEL, rel=0.02)
    assert pressed.friction == 0
    assert abs(slid.imbalance) < 2e-3 * slid.work


def test_what_a_penalty_creeps_while_it_sticks_is_no_slip():
    """It is stored in the springs of the penalty, r_t^2 / (2 K_t) each."""
    K = 1e3
    *_, last = marched(rubbed(travel=(2e-4, -DEPTH)), 1, form=Penalty(1e5, K))
    r = last.solved.r
    assert (np.abs(r[:, 1]) < 0.5 * MU * r[:, 0]).all()
    stored = float((r[:, 1] ** 2).sum() / (2 * K))
    assert last.energies.friction == pytest.approx(stored, rel=1e-6)


def test_a_weld_dissipates_nothing():
    *_, last = marched(rubbed(mu=np.inf, travel=(0.01, -DEPTH)), 1)
    assert abs(last.energies.friction) < 1e-12 * last.energies.work


def test_a_curved_tool_that_begins_to_slide_does_so_too():
    """A tool that is flat, by the ways of one that is curved."""
    flat = rubbed()
    by_surface = ShapedTool(Plane((0.0, 0.1), (0.0, -1.0)), (TRAVEL, -DEPTH), ("top",), MU, SLIDE)
    one, other = (marched(asked, 1)[-1].energies for asked in (flat, replace(flat, tools=(by_surface,))))
    np.testing.assert_allclose(list(vars(one).values()), list(vars(other).values()), rtol=1e-9)


def test_the_fuzz_study_s_own_sums_see_what_begins_to_slide():
    """Coulomb's law and caps, in the plane and in space, on increments that lie across the beginning of sliding."""
    steel = VonMises(Elasticity(1e3, 0.0), Linear(300.0, 100.0))
    orowan = {"mu": 0.4, "shear": 0.02}
    plain, capped = rubbed(material=steel), rubbed(material=steel, **orowan)
    for asked in (plain, capped, rubbed(THERE_AND_BACK, steel), rubbed(AROUND, steel)):
        setting, before = setting_of(asked), np.zeros(4)
        for a in marched(asked, 1, asked.tools[0].path):
            own = measure(setting, step_of(asked, setting, a, float(np.abs(a.state.forces).max()))).energies
            now = np.array(list(vars(a.energies).values()))
            np.testing.assert_allclose(own, now - before, atol=1e-9 * np.abs(now).max())
            before = now
    held = tuple(Support("base", d) for d in range(3))
    plate = FlatTool((0.0, 0.0, 0.1), (0.0, 0.0, -1.0), (0.1, 0.04, -2e-3), ("top",), MU, THERE_AND_BACK_3D)
    for tool_above in (plate, replace(plate, mu=0.4, shear=0.02), replace(plate, path=AROUND_3D)):
        asked = Scene(brick(1.0, 1.0, 0.1, 2, 2, 1), Geometry.SOLID, steel, held, (tool_above,))
        steps = marched(asked, 1, tool_above.path)
        assert max(m.energies for m in measured(Ran(asked, steps, ""))) < 1e-9
        assert steps[-1].energies.friction > 1.5 * steps[1].energies.friction


def test_what_a_penalty_lets_a_point_sink_into_its_tool_belongs_to_the_way_in_touch():
    """A platen that goes a quarter of its way through the air is in touch for three, soft as its penalty may be."""
    platen = tool(point=(0.0, 1.0005), travel=(0.001, -0.002))
    landed = last(scene(tools=(platen,)), Schedule(1), Penalty(3e5, 3e5))
    depth = -landed.solved.iterate.motion[:, 0]
    assert landed.start.tau == 0
    assert (depth > 1e-5).all()
    np.testing.assert_allclose(Passage(landed.start, landed.solved.iterate, landed.solved.r, 0.5).touching, 0.75)
