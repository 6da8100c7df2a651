"""What an answer leaves open, contact by contact, on rows and motions given by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.checks.determinacy import Active, loose_motions, may_leave, shared_forces
from bipot.checks.settling import settled
from bipot.programs.data import ContactRows

MU = 0.3


def rows(G_n, G_t, gap=None, slip=None, mu=MU, tied=False):
    """Rows of contacts (c,), all of them with tangents G_t (c, d - 1, n)."""
    normal, tangents = np.atleast_2d(G_n).astype(float), np.asarray(G_t, float)
    count, width, size = tangents.shape
    return ContactRows(
        sp.csr_matrix(normal),
        np.zeros(count) if gap is None else np.array(gap, float),
        without_zeros(tangents.reshape(-1, size)),
        np.zeros((count, width)) if slip is None else np.array(slip, float),
        np.arange(count),
        np.full(count, float(mu)),
        np.full(count, np.inf),
        np.full(count, tied),
    )


def without_zeros(matrix):
    out = sp.csr_matrix(matrix)
    out.eliminate_zeros()
    return out


def answer(given, x, rigid=None, node=None, position=None, weighted=False, driven=0):
    """An iterate at x (n,) with these rows, in a body of size one whose ``rigid`` motions (n, m) supports allow."""
    system = SimpleNamespace(
        body=SimpleNamespace(
            scene=SimpleNamespace(
                size=1.0,
                origin=lambda nodes: nodes,
                mesh=SimpleNamespace(nodes=np.zeros((2, given.tangents + 1))),
            ),
            space=SimpleNamespace(position=np.array(position)),
        ),
        strainless_at=lambda nodes: np.array(rigid, float),
        candidates=SimpleNamespace(node=np.array(node), weighted=weighted, deformable=False),
        shares=True,
    )
    increment = SimpleNamespace(system=system, start=SimpleNamespace(nodes=None))
    x = np.array(x, float)
    return SimpleNamespace(rows=given, x=x, motion=given.motion(x), increment=increment, translated=np.zeros(driven))


ONE = rows([1.0, 0.0], [[[0.0, 1.0]]])
"""A contact of a node in a plane: its gap and its slip are the unknowns."""


@pytest.mark.parametrize(("inside", "sticks"), [(1e-7, True), (1e-9, False)])
def test_a_contact_sticks_if_it_is_within_its_cone_by_more_than_round_off(inside, sticks):
    active = Active.of(answer(ONE, [0.0, 0.0]), np.array([[1.0, MU - inside]]))
    assert active.sticking.tolist() == [sticks]
    assert active.closed.all()


def test_a_sliding_contact_in_space_stops_what_turns_its_slip():
    """It moves on along its slip; across it friction would turn."""
    given = rows([1.0, 0.0, 0.0], [[[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]])
    r = np.array([[1.0, -MU, 0.0]])
    stopped = Active.of(answer(given, [0.0, 0.1, 0.0]), r).stopped(given, np.eye(3))
    np.testing.assert_array_equal(stopped, [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    ways = loose_motions(answer(given, [0.0, 0.1, 0.0], rigid=np.eye(3)), r, 0.0)
    np.testing.assert_allclose(np.abs(ways.ravel()), [0.0, 1.0, 0.0], atol=1e-15)


ALONG = np.array([[0.0], [1.0]])


@pytest.mark.parametrize(
    ("slip", "r", "settles"),
    [
        (-0.1, (1.0, -MU), 0.1),  # slips by 0.3 of 0.4: it may go back as far as it slips
        (-0.1, (0.0, 0.0), 0.0),  # costs nothing
        (-0.4, (1.0, -MU), 0.4),  # has not slipped, and would slip with its friction
        (-0.4, (1.0, MU), 0.0),  # or against it
    ],
)
def test_the_least_motion_keeps_slips_that_cost_friction_in_their_direction(slip, r, settles):
    found = answer(rows([1.0, 0.0], [[[0.0, 1.0]]], slip=[[slip]]), [0.0, 0.4])
    assert settled(found, np.array([r]), ALONG, 1e-9) == pytest.approx([0.0, settles], abs=1e-9)


def test_the_least_motion_keeps_gaps_open():
    found = answer(rows([1.0, 0.0], [[[0.0, 1.0]]], gap=[-0.1]), [0.4, 0.0])
    assert settled(found, np.zeros((1, 2)), np.array([[1.0], [0.0]]), 1e-9) == pytest.approx([0.1, 0.0], abs=1e-9)


def test_a_body_may_leave_contacts_that_carry_nothing():
    idle, pressed, upwards = np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.array([[1.0], [0.0]])
    assert may_leave(answer(ONE, [0.0, 0.0], rigid=upwards), idle, 1e-9)
    assert not may_leave(answer(ONE, [0.0, 0.0], rigid=upwards), pressed, 1e-9)
    assert not may_leave(answer(ONE, [0.0, 0.0], rigid=ALONG), idle, 1e-9)
    assert not may_leave(answer(ONE, [0.0, 0.0], rigid=np.zeros((2, 0))), idle, 1e-9)


def shared(given, node, position, r, x=(0.0, 0.0), **options):
    return shared_forces(answer(given, x, node=node, position=position, **options), np.array(r, float))


def test_a_node_that_sticks_where_it_moves_along_one_line_shares_two_forces():
    """Normal and friction both push it along that; where it slides there is one unknown."""
    line = rows([0.6], [[[0.8]]])
    assert shared(line, [1], [-1, -1, 0, -1], [[1.0, 0.0]], x=(0.0,)) == (1,)
    assert shared(line, [1], [-1, -1, 0, -1], [[1.0, -MU]], x=(0.1,)) == ()


@pytest.mark.parametrize(("options", "nodes"), [({}, ()), ({"weighted": True}, (0, 1)), ({"driven": 1}, (0, 1))])
def test_means_and_driven_tools_share_forces_of_different_nodes(options, nodes):
    """Two contacts without friction that push the same unknown."""
    both = rows([[1.0, 0.0], [1.0, 0.0]], np.zeros((2, 1, 2)), mu=0.0)
    assert shared(both, [0, 1], [0, 1, -1, -1], [[1.0, 0.0]] * 2, **options) == nodes


@pytest.mark.parametrize(("slope", "nodes"), [(MU, (0,)), (0.5, ())])
def test_what_slides_pushes_along_the_edge_of_its_cone(slope, nodes):
    """A second tool, without friction, whose normal is along that edge pushes the same way."""
    two = rows([[1.0, 0.0], [1.0, -slope]], [[[0.0, 1.0]], [[0.0, 0.0]]])
    assert shared(two, [0, 0], [0, 1, -1, -1], [[1.0, -MU], [1.0, 0.0]], x=(0.0, 0.1)) == nodes
