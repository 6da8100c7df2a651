"""Orders of elimination: minimum degree, and nested dissection of large patterns."""

from importlib.util import find_spec

import numpy as np
import pytest
import scipy.sparse as sp

from bipot import (
    Circle,
    DeformableTool,
    Element,
    Force,
    Geometry,
    Plane,
    Sampling,
    Scene,
    ShapedTool,
    Support,
    block,
    together,
)
from bipot.errors import ProgramError, SceneError
from bipot.forms import Newton
from bipot.forms.memory import ordered
from bipot.increment import Increment
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.programs import factors, ordering
from bipot.programs.factors import Pardiso, SuperLU
from bipot.programs.frames import Frames, Touched
from bipot.programs.ordering import Pattern, dissection, minimum_degree
from studies.accuracy.block_alone import scene_of
from tests.deformable import STEEL, pressed, shifted


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


def fill(factor):
    """Entries of L and U."""
    return factor.lu.L.nnz + factor.lu.U.nnz


def test_nested_dissection_fills_less_than_minimum_degree_on_a_fine_mesh():
    K, places = posed(40)
    pattern, lu = factor(K, dissection(K.indices, K.indptr, places))
    other = factor(K, minimum_degree(K.indices, K.indptr))[1]
    assert fill(lu) < fill(other)
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
    scene, schedule = upsetting(mu=0.3, reduction=0.02, elements=6), Schedule(3, first=0.05, settling=1, growth=4.0)
    forces = []
    for large in (ordering.LARGE[2], 0):
        monkeypatch.setitem(ordering.LARGE, 2, large)
        forces.append([a.solved.r for a in march(scene, schedule, Control(Newton(), ()))][-1])
    assert not np.array_equal(*forces)
    np.testing.assert_allclose(*forces, atol=1e-9 * np.abs(forces[0]).max())


class Filling(SuperLU):
    """SuperLU that counts the entries of its factors."""

    most = 0

    def factorise(self, transpose, panel):
        found = super().factorise(transpose, panel)
        object.__setattr__(self, "most", max(self.most, fill(found)))
        return found


def most(scene, monkeypatch: pytest.MonkeyPatch, *ways):
    """The most entries of factors of a march, with each way to say what contact couples."""
    found = []
    for coupled in ways:
        monkeypatch.setattr(Touched, "coupled", coupled)
        solver = Filling()
        next(march(scene, Schedule(1), Control(Newton(linear=solver), ())))
        found.append(solver.most)
    return found


def nothing(self, n):
    return sp.csc_matrix((n, n))


def test_unknowns_of_parts_that_contact_couples_count_as_neighbours(monkeypatch: pytest.MonkeyPatch):
    with_them, alone = most(pressed(elements=16, press=0.01), monkeypatch, Touched.coupled, nothing)
    assert with_them < 0.8 * alone


@pytest.mark.parametrize("face", [Plane((0.0, 2.0), (0.0, -1.0)), Circle((5.0, 10.0), 8.0)], ids=["flat", "curved"])
def test_means_at_a_tool_that_a_force_drives_make_no_neighbours(monkeypatch: pytest.MonkeyPatch, face):
    """All of them act on its coordinate: as neighbours of each other they would fill a third more."""
    push, mesh = Force((0.0, -100.0)), block(10.0, 2.0, 40, 8, element=Element.Q8)
    tool = ShapedTool(face, (0.0, 0.0), ("top",), 0.2, sampling=Sampling.WEIGHTED, driven_by=push)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, tuple(Support("base", k) for k in range(2)), (tool,))
    as_made, alone = most(scene, monkeypatch, Touched.coupled, nothing)
    assert as_made <= 1.05 * alone


PARDISO = pytest.mark.skipif(find_spec("pypardiso") is None, reason="pypardiso is not installed")


def cube(elements=4):
    """The eighth of a block."""
    return scene_of(0.3, elements, 0.02)


def test_a_coarse_side_before_a_fine_one_does_not_make_all_of_it_neighbours():
    """Squares of its unknowns would take longer to be ordered than the factors do."""
    fine, coarse = block(10.0, 1.0, 300, 1), shifted(block(8.0, 1.0, 1, 1), 1.0, 1.0)
    tool = DeformableTool(("fine/top",), ("coarse/base",), 0.2)
    mesh = together({"fine": fine, "coarse": coarse})
    system = system_of(Scene(mesh, Geometry.PLANE_STRAIN, STEEL, (Support("fine/base", 1),), (tool,)))
    space, rows = system.body.space, Increment(system, system.rest(), 0.1).rows
    assert len(Touched.of(rows).dof) > 600
    assert Touched.of(rows).coupled(space.size).nnz == 0
    np.testing.assert_array_equal(ordered(space, rows).order, ordered(space).order)


def test_in_space_nested_dissection_is_the_order_and_fills_less():
    space = system_of(cube(6)).body.space
    found = ordered(space)
    column = np.repeat(np.arange(space.size), np.diff(space.indptr))
    other = Pattern.ranked(space.indices, column, minimum_degree(space.indices, space.indptr))
    data = np.where(space.indices == column, 100.0, -1.0)
    fills = [fill(pattern.factorise(pattern.by_row(data)[:-1])) for pattern in (found, other)]
    assert found.panel > 1
    assert fills[0] < 0.97 * fills[1]


def test_in_space_no_contact_of_a_flat_tool_borders_the_matrix():
    """Nodes of planes of symmetry, where the normal or a tangent is held, own what is left."""
    system = system_of(cube())
    frames = Frames.of(Increment(system, system.rest(), 0.1).rows, ordered(system.body.space))
    assert frames.border is None


@PARDISO
@pytest.mark.slow
def test_a_march_by_pardiso_has_the_same_answer():
    forces = []
    for linear in (SuperLU(), Pardiso()):
        control = Control(Newton(linear=linear), ())
        forces.append([a.solved.r for a in march(cube(), Schedule(2, first=0.05, settling=1, growth=4.0), control)][-1])
    assert not np.array_equal(*forces)
    np.testing.assert_allclose(*forces, atol=1e-9 * np.abs(forces[0]).max())


@PARDISO
def test_pardiso_calls_a_singular_matrix_so():
    K, _ = posed(3)
    K.data[K.indptr[4] : K.indptr[5]] = 0.0
    pattern = Pattern.of(K.indices, K.indptr)
    with pytest.raises(ProgramError, match="singular"):
        pattern.factorise(pattern.by_row(K.data)[:-1], Pardiso())


def test_pardiso_is_refused_in_words_where_it_is_not_installed(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(factors, "find_spec", lambda name: None)
    with pytest.raises(SceneError, match="pip install pypardiso"):
        Pardiso()
