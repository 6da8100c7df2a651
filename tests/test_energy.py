"""Energy: a closed form, order two of the trapezoidal rule, and the identity of the end-of-step rule."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.energy import Energies, Rule
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, Newton, Tangent
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.sections import block
from bipot.paper import upsetting
from bipot.paths import Amplitude
from bipot.scene.loads import Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.circle import Circle
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool, ShapedTool
from studies import energy as study
from studies.tables import read_csv
from tests.scenes import last, tool
from tests.scenes import scene as under_punch
from tests.test_landing import GAP, TRAVEL
from tests.test_landing import scene as block_under_a_gap

BEGIN, END = 0.05, 0.20
FORMS = {"form": Newton(), "fallbacks": (Tangent(), Dissipation())}


def summed(scene, accepted, rule):
    """Energies of a march by one rule."""
    total = Energies()
    for a in accepted:
        total = total.after(a.start, a.state, a.solved, rule)
    return total


@cache
def begun(mu, integration, hardening):
    """The state at 5 % that all refinements share, and the scene to 20 %."""
    scene = upsetting(mu=mu, reduction=END, elements=3, hardening=hardening)
    schedule = Schedule(8, first=0.001 / END, landings=(BEGIN / END,), settling=1, growth=4.0)
    steps = march(scene, schedule, Control(**FORMS, integration=integration))
    return scene, next(a.state for a in steps if a.state.tau == BEGIN / END)


@pytest.mark.parametrize(
    ("mu", "integration", "hardening"),
    [
        (0.0, Integration.BDF2, None),
        (0.1, Integration.BDF2, None),
        (0.1, Integration.BACKWARD_EULER, None),
        (0.3, Integration.BDF2, Linear(300.0, 500.0)),
    ],
)
def test_the_trapezoidal_balance_closes_with_order_two(mu, integration, hardening):
    scene, start = begun(mu, integration, hardening)
    defects, taken = [], []
    for parts in (8, 16, 32):
        accepted = list(march(scene, Schedule(parts), Control(**FORMS, integration=integration), start))
        energies = accepted[-1].energies
        assert energies == summed(scene, accepted, Rule.TRAPEZOIDAL)
        defects.append(energies.imbalance / energies.work)
        taken.append(len(accepted))
    assert taken == [6, 12, 24]
    orders = np.log2(np.abs(defects[:-1]) / np.abs(defects[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.05)
    assert abs(defects[-1]) < 5e-5


@pytest.mark.parametrize(
    ("energies", "error"),
    [
        (Energies(), 0.0),
        (Energies(work=0.0, elastic=1.0, plastic=-1.0), 0.0),
        (Energies(work=8.0, elastic=1.0, plastic=4.0, friction=2.5), 0.0625),
        (Energies(work=8.0, elastic=1.0, plastic=4.0, friction=3.5), -0.0625),
    ],
)
def test_energy_error_is_what_is_missing_of_the_work(energies, error):
    assert energies.energy_error == error


def test_the_study_writes_both_closures(tmp_path):
    assert study.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_csv(tmp_path / "energy.csv", "")
    assert len(rows) == 8
    paper = [row for row in rows if row["configuration"] == Configuration.PAPER.value]
    assert max(abs(row["end"]) for row in paper) < 1e-8
    orders = [row["order"] for row in rows if np.isfinite(row["order"])]
    np.testing.assert_allclose(orders, [2, 2], atol=0.05)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("integration", list(Integration))
def test_end_of_step_energies_close_in_small_strain(mu, integration):
    """Equilibrium at the end tested with dU: an identity in ``paper``, whatever yields and slips."""
    scene = upsetting(mu=mu, reduction=0.01, elements=3, configuration=Configuration.PAPER)
    limits = Limits(Bounds(equilibrium=1e-8))
    steps = list(
        march(
            scene,
            Schedule(8, first=0.05, settling=1, growth=4.0),
            Control(**FORMS, limits=limits, integration=integration),
        )
    )
    total = summed(scene, steps, Rule.END)
    assert abs(total.imbalance) <= 1e-8 * total.work
    assert total.plastic > 0.5 * total.work
    assert (total.friction > 1e-3 * total.work) == (mu > 0)
    # The trapezoidal rule mixes two configurations here, and is off by far more.
    assert abs(steps[-1].energies.imbalance) > 1e-5 * total.work


def test_a_force_does_no_work_across_the_gap_that_it_closes():
    """A tool lands inside an increment: the identity holds through it, and without the gap's term it would not."""
    asked = replace(block_under_a_gap(GAP), configuration=Configuration.PAPER)
    steps = list(march(asked, Schedule(5), Control(**FORMS)))
    (landing,) = [a for a in steps if a.state.forces.any() and not a.start.forces.any()]
    alone = summed(asked, [landing], Rule.END)
    assert abs(alone.imbalance) <= 1e-8 * alone.work
    force, travel = landing.state.forces[:, 0].sum(), landing.state.tau - landing.start.tau
    assert alone.work == pytest.approx(force * TRAVEL * (travel - (GAP / TRAVEL - landing.start.tau)), rel=1e-8)


def test_frictionless_energies_are_the_closed_forms():
    """Uniform upsetting by 45 %: plastic sigma_Y eps_p V, elastic sigma_Y^2/(2 E) V, with V/V0 = 0.9994287."""
    scene = upsetting(mu=0.0, elements=1)
    # An increment ends at first yield, where the force has its kink.
    first_yield = -np.expm1(-300 / 210_000) / 0.45
    *_, last = march(scene, Schedule(90, landings=(first_yield,)), Control(**FORMS))
    volume = 0.9994287 * np.pi * 25 * 10
    energies = last.energies
    assert energies.plastic == pytest.approx(300 * 0.5964084 * volume, rel=1e-5)
    assert energies.elastic == pytest.approx(300**2 / (2 * 210_000) * volume, rel=2e-3)
    assert energies.friction == 0
    assert energies.work == pytest.approx(energies.plastic + energies.elastic, rel=1e-4)


def test_the_elastic_part_is_the_energy_of_the_stress_and_the_plastic_one_that_of_hardening():
    scene, start = begun(0.3, Integration.BDF2, Linear(300.0, 500.0))
    material = scene.material
    accepted = list(march(scene, Schedule(64), Control(**FORMS), start))
    stress, weight = accepted[-1].state.stress, accepted[-1].solved.response.kinematics.volume
    stored = np.sum(weight * np.sum(stress * (stress @ material.elasticity.compliance(4)), axis=-1)) / 2
    assert scene.images == 2
    steps = list(march(scene, Schedule(8, first=0.005, settling=1, growth=4.0), Control(**FORMS)))
    assert summed(scene, steps, Rule.TRAPEZOIDAL).elastic == pytest.approx(2 * stored, rel=5e-3)
    spent = sum(
        float(np.sum(a.solved.response.kinematics.volume * material.hardening.yield_stress(a.start.peeq + dp / 2) * dp))
        for a in accepted
        for dp in (a.state.peeq - a.start.peeq,)
    )
    assert accepted[-1].energies.plastic == pytest.approx(2 * spent, rel=1e-3)


@pytest.mark.parametrize("increments", [1, 4])
def test_a_curved_tool_that_touches_nothing_takes_no_work_away(increments):
    """Of nodes that supports hold along a platen which lands on them: friction is between tool and support."""
    platen = FlatTool((0.0, 1.02), (0.0, -1.0), (0.1, -0.1), ("top",), 1.0)
    far = ShapedTool(Circle((50.0, 0.5), 0.5), (0.0, 0.0), ("right",), 0.0)
    held = (Support("base", 0), Support("base", 1), Support("top", 0))
    material = VonMises(Elasticity(1000.0, 0.3), Linear(3.0, 30.0))
    found = []
    for tools in ((platen,), (platen, far)):
        scene = Scene(block(2.0, 1.0, 6, 3), Geometry.PLANE_STRAIN, material, held, tools)
        found.append(list(march(scene, Schedule(increments)))[-1].energies)
    np.testing.assert_allclose(list(vars(found[1]).values()), list(vars(found[0]).values()), rtol=1e-9)
    assert found[0].friction > 0.4 * found[0].work


def test_the_work_of_a_curved_tool_is_that_of_the_mean_of_its_forces_at_start_and_end():
    """Along its way, while what touches it keeps touching: forces turn from one normal to the next as nodes slip."""
    roll = ShapedTool(
        Circle((1.0, 1.5), 0.5), (0.2, -0.1), ("top",), 0.1, ((0.0, (0.0, 0.0)), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    )
    held = (Support("base", 0), Support("base", 1))
    scene = Scene(
        block(2.0, 1.0, 8, 4), Geometry.PLANE_STRAIN, VonMises(Elasticity(1e3, 0.3), Linear(3.0, 30.0)), held, (roll,)
    )
    compared = 0
    for before, after in pairwise(march(scene, Schedule(20))):
        closed = [accepted.solved.r[:, 0] > 0 for accepted in (before, after)]
        if np.array_equal(*closed) and after.tool_forces[0, 0] != 0:
            way = after.poses[0, :2] - before.poses[0, :2]
            mean = (before.tool_forces[0] + after.tool_forces[0]) / 2
            done = after.energies.work - before.energies.work
            assert done == pytest.approx(float(mean @ way), rel=1e-6)
            compared += 1
    assert compared > 3


PRESSED = {
    "pressure": lambda on: under_punch(tools=(tool(travel=(0.0, 0.0)),), loads=(Pressure("right", 1.0, on),)),
    "traction": lambda on: under_punch(tools=(), loads=(Traction("top", (0.1, 1.0), on),)),
    "driven": lambda on: under_punch(tools=(tool(driven_by=Force((0.0, -1.0), on), travel=(0.0, 0.0)),)),
}


@pytest.mark.parametrize("pressed", PRESSED.values(), ids=PRESSED)
def test_what_is_on_from_the_first_moment_does_the_work_of_what_rises_in_the_first_increment(pressed):
    rising = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)))
    on, rises = (last(pressed(by), Schedule(2), Newton()) for by in (Amplitude(((0.0, 1.0), (1.0, 1.0))), rising))
    assert on.energies.work == pytest.approx(rises.energies.work, rel=1e-9)
    assert abs(on.energies.energy_error) < 1e-3
