"""Orders of elimination: minimum degree, and nested dissection of large patterns."""

import numpy as np
import pytest

from bipot.forms import Newton
from bipot.marching import Control, Schedule, march, system_of
from bipot.programs import ordering
from bipot.programs.ordering import Pattern, dissection, minimum_degree
from bipot.scene import upsetting


def posed(elements):
    """A body's stiffness at rest and the places of its unknowns."""
    scene = upsetting(mu=0.3, elements=elements)
    system = system_of(scene)
    body, space = system.body, system.body.space
    K = space.matrix(body.tangent(body.respond(system.rest(), np.zeros(space.size)), body.scratch()))
    return K, np.repeat(scene.mesh.nodes, 2, axis=0)[space.free]


def factor(K, rank):
    """A pattern in the order ``rank`` with the factor of K."""
    column = np.repeat(np.arange(len(rank)), np.diff(K.indptr))
    pattern = Pattern.ranked(K.indices, column, rank)
    return pattern, pattern.factorise(pattern.by_row(K.data)[:-1])


def test_nested_dissection_fills_less_than_minimum_degree_on_a_fine_mesh():
    K, places = posed(40)
    pattern, lu = factor(K, dissection(K.indices, K.indptr, places))
    other = factor(K, minimum_degree(K.indices, K.indptr))[1]
    assert lu.L.nnz + lu.U.nnz < other.L.nnz + other.U.nnz
    b = np.sin(np.arange(len(places)))
    np.testing.assert_allclose(K @ pattern.solve(lu, b), b, atol=1e-11)


def test_what_has_no_place_is_eliminated_last():
    K, places = posed(6)
    places[[3, 40]] = np.nan
    rank = dissection(K.indices, K.indptr, places)
    assert sorted(rank) == list(range(len(places)))
    assert set(rank[[3, 40]]) == {len(places) - 2, len(places) - 1}


def test_unknowns_that_are_all_in_one_place_are_one_part():
    K, places = posed(6)
    rank = dissection(K.indices, K.indptr, np.zeros_like(places))
    np.testing.assert_array_equal(rank, minimum_degree(K.indices, K.indptr))


def test_a_march_in_another_order_has_the_same_answer(monkeypatch: pytest.MonkeyPatch):
    scene, schedule = upsetting(mu=0.3, reduction=0.02, elements=6), Schedule(3, first=0.05)
    forces = []
    for large in (ordering.LARGE[2], 0):
        monkeypatch.setitem(ordering.LARGE, 2, large)
        forces.append([a.solved.r for a in march(scene, schedule, Control(Newton(), ()))][-1])
    assert not np.array_equal(*forces)
    np.testing.assert_allclose(*forces, atol=1e-9 * np.abs(forces[0]).max())
