"""Contact forces at which an increment starts, and what the start saves where the motion is smooth."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Control, Newton, Schedule, march, upsetting
from bipot.forms import FormName
from bipot.forms.memory import Pace, Paced
from bipot.iterate import Increment
from bipot.marching import system_of
from bipot.tools.tool import Sampling
from studies.block import cases, parser
from studies.penalty_cases import Case, Plan, solve
from tests.scenes import scene, tool


def _extrapolated(scene, r, before, length=0.3):
    """Forces predicted after an increment of length 0.2 in which they changed from ``before`` to ``r``."""
    system = system_of(scene)
    rest = system.rest()
    start = replace(rest, tau=0.4, forces=r, du=np.full_like(rest.du, 1e-3), length=0.2)
    earlier = Paced(0.2, 0.1, np.zeros_like(rest.rates), before)
    return Pace((earlier,)).forces(Increment(system, start, 0.4 + length))


def _forces(scene, normal):
    """Forces (c, d) of this ``normal`` component, some of it along the first tangent."""
    shape = system_of(scene).rest().forces.shape
    r = np.zeros(shape)
    r[:, 0], r[:, 1] = normal, 0.05 * normal
    return r


def test_forces_of_contacts_that_carry_go_on_along_a_line():
    r, before = _forces(scene(), 110.0), _forces(scene(), 100.0)
    np.testing.assert_allclose(_extrapolated(scene(), r, before), _forces(scene(), 125.0), rtol=1e-12)


@pytest.mark.parametrize(("now", "then"), [(110.0, 0.0), (0.0, 100.0), (110.0, 60.0)], ids=["new", "left", "leap"])
def test_forces_of_others_stay(now, then):
    r = _forces(scene(), now)
    np.testing.assert_array_equal(_extrapolated(scene(), r, _forces(scene(), then)), r)


def test_so_do_those_of_contacts_that_share_a_node_or_means():
    """A part of them may be undetermined."""
    nodal = replace(scene(), tools=(tool(), tool(candidates=("right",))))
    r, before = _forces(nodal, 110.0), _forces(nodal, 100.0)
    alone = system_of(nodal).candidates.alone
    assert 0 < np.count_nonzero(alone) < len(alone)
    np.testing.assert_array_equal((_extrapolated(nodal, r, before) != r).any(axis=1), alone)
    means = replace(scene(), tools=(tool(candidates=("top",), sampling=Sampling.WEIGHTED), tool(candidates=("right",))))
    r, before = _forces(means, 110.0), _forces(means, 100.0)
    np.testing.assert_array_equal(_extrapolated(means, r, before), r)


def test_so_do_all_where_the_path_turns():
    moving = scene(tools=(tool(path=((0.0, 0.0), (0.4, 0.4), (1.0, 0.2))),))
    r, before = _forces(moving, 110.0), _forces(moving, 100.0)
    np.testing.assert_array_equal(_extrapolated(moving, r, before), r)


def _cube():
    """An eighth of a cube between platens."""
    return cases(parser().parse_args(["--mu", "0.1", "--elements", "3"]))[0].scene()


@pytest.mark.parametrize("made", [lambda: upsetting(mu=0.1, reduction=0.3, elements=4), _cube])
def test_one_pass_suffices_where_the_motion_is_smooth(made):
    """In space slip turns meanwhile, which needs the forces, too."""
    steps = list(march(made(), Schedule(30, first=1e-3, settling=5, growth=2), Control(Newton(), ())))
    smooth = [step.passes for step in steps if step.state.tau > 0.3]
    assert len(smooth) > 15
    assert max(smooth) == 1


@pytest.mark.slow
def test_penalised_contact_starts_on_a_line_and_is_not_cut():
    """From predicted starts its fixed point cycled in two increments under a stiff punch of mu = 0.6."""
    run = solve(Case(0.6, FormName.PENALTY, 1e8), Plan()).run
    last = len(run.snapshots) - 1
    assert run.snapshots[last].tau == 1
    assert run.total("cuts", last) == 0
