"""How far Newton goes along a step: each rule of the line search by itself, on trials given by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.forms.search import FOLDED, Aim, Point, Search
from bipot.programs.frames import SOFTENED

BODY, TOOL = np.array([1.0, 0.0]), np.array([1.0, -2.0])
"""Steps of one unknown of the body and one of a driven tool, which goes in the second alone."""


def trial(work, merit=1.0, contacts=1, landing=0.0):
    """A point by the work of unbalanced forces along the step, merit, number of contacts, and work of landings."""
    space = SimpleNamespace(free=np.array([0]))
    increment = SimpleNamespace(system=SimpleNamespace(body=SimpleNamespace(space=space)))
    return SimpleNamespace(
        work=lambda along, r: work,
        merit=merit,
        miss=np.zeros((contacts, 2)),
        landing=lambda pieces, driven: landing * driven.sum(),
        pieces=None,
        iterate=SimpleNamespace(increment=increment),
    )


def aim(work=-2.0, along=BODY):
    """What is sought along a step from a point of merit one at which g(0) is ``work``."""
    return Aim(Search(), trial(work), along, np.zeros((1, 2)))


def met(sought, t, point):
    return sought.meets(t, point, sought.rest(point))


@pytest.mark.parametrize("work", [0.0, 1.0])
def test_where_g_means_nothing_the_step_is_halved_until_the_merit_falls(work):
    sought = aim(work)
    assert not met(sought, 1.0, trial(0.0, merit=1.01))
    assert sought.shorter(1.0, 0.0) == 0.5
    assert sought.shorter(0.5, 0.0) == 0.25
    assert met(sought, 0.5, trial(5.0, merit=1.0))


def test_a_step_ends_where_g_has_fallen_to_its_part():
    assert aim().rest(trial(-0.5)) == 0.25
    assert met(aim(), 0.4, trial(-0.58))
    assert not met(aim(), 0.4, trial(-0.62))
    assert met(aim(), 0.4, trial(0.58))
    assert not met(aim(), 1.0, trial(0.62))


def test_a_whole_step_that_is_too_short_or_lessens_the_merit_is_taken():
    assert met(aim(), 1.0, trial(-1.8))
    assert not met(aim(), 0.5, trial(-1.8))
    assert met(aim(), 1.0, trial(1.0, merit=0.1))
    assert not met(aim(), 1.0, trial(1.0, merit=0.11))
    assert not met(aim(), 0.5, trial(1.0, merit=0.1))


def test_a_step_to_a_larger_merit_is_halved_unless_there_are_no_contacts():
    assert aim().rest(trial(-0.5, merit=1.01)) == -1.0
    assert aim().rest(trial(-0.5, merit=1.01, contacts=0)) == 0.25
    assert aim().shorter(1.0, -1.0) == 0.5


def test_next_to_a_step_that_was_halved_one_along_which_g_has_hardly_fallen_is_taken():
    sought = aim()
    assert not met(sought, 0.5, trial(-1.7))
    sought.shorter(1.0, -1.0)
    assert met(sought, 0.5, trial(-1.7))
    assert not met(sought, 0.5, trial(-1.5))
    sought.shorter(0.5, -0.9)
    assert not met(sought, 0.25, trial(-1.7))


def test_false_position_goes_neither_too_near_nor_too_far():
    """Where the line through both ends of the bracket is zero, within 0.15 and 0.75 of it."""
    assert aim().shorter(1.0, -1.5) == pytest.approx(0.4)
    assert aim().shorter(1.0, -0.25) == pytest.approx(0.75)
    assert aim().shorter(1.0, -19.0) == pytest.approx(0.15)
    assert aim().shorter(1.0, FOLDED) == pytest.approx(0.2)
    sought = aim()
    sought.shorter(1.0, -1.0)
    assert sought.shorter(0.5, 0.5) == pytest.approx(0.5 + 0.5 / 3)
    assert sought.shorter(0.7, -0.5) == pytest.approx(0.6)


def test_a_driven_tool_that_comes_upon_open_contacts_works_against_a_part_of_their_stiffness():
    """The tool goes by -2; where the body goes alone nothing lands."""
    landed = trial(-1.0, merit=0.01, landing=-4.0)
    assert aim().rest(landed) == 0.5
    assert aim(along=TOOL).rest(landed) == pytest.approx((-1.0 + 0.1 * 8.0) / -2.0)
    too_far = trial(-0.2, merit=0.01, landing=-10.0)
    assert not met(aim(along=TOOL), 1.0, too_far), "the merit's fall does not decide where something lands"
    assert met(aim(), 1.0, trial(0.8, merit=0.01))


def test_the_work_of_landings_is_that_of_contacts_that_were_open():
    """Four contacts: shut before, open and still apart, and two that the tool goes into; elastic stiffness by depth."""
    G_n = sp.csr_matrix(np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 0.5]]))
    before = SimpleNamespace(
        closed=np.array([True, False, False, False]), scale=SOFTENED * np.array([7.0, 5.0, 3.0, 2.0])
    )
    motion = np.array([[-0.1, 0.0], [0.2, 0.0], [-0.1, 0.0], [-0.4, 0.0]])
    iterate = SimpleNamespace(rows=SimpleNamespace(G_n=G_n))
    point = Point(iterate, np.zeros((4, 2)), motion, None, np.zeros((4, 2)), 0.0)
    driven = np.array([0.0, -2.0])
    assert point.landing(before, driven) == pytest.approx(3.0 * 0.1 * 2.0 + 2.0 * 0.4 * 1.0)
