"""Deformable tools in space with quadratic faces: tetrahedra with ten nodes, bricks with twenty."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    DeformableTool,
    Dissipation,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Newton,
    Schedule,
    Symmetry,
    brick,
    together,
)
from bipot.fem.surface import facet_mass
from bipot.tools.facing import facing
from bipot.tools.fans import beside
from bipot.tools.flats import flats
from bipot.tools.passing import crossed, deep
from bipot.tools.plane import area_of
from tests.deformable import shifted
from tests.test_deformable_caps import K, dragged
from tests.test_deformable_space import FEW, NEWTON, TURNS, last, pressed, stack

ELEMENTS = Element.T10, Element.H20


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("form", [Newton(), pytest.param(Dissipation(), marks=pytest.mark.slow)])
def test_a_uniform_pressure_passes_meshes_that_do_not_match(turn, element, form):
    scene = stack(TURNS[turn], mu=0.3, element=element, kind=Symmetry)
    accepted = last(scene, Control(form, ()))
    stress = accepted.state.stress
    assert np.ptp(stress, axis=(0, 1)).max() < 1e-6 * np.abs(stress).max()
    # That on the mirror images, too.
    along = accepted.tool_force(0) @ TURNS[turn][:, 2] / 4
    assert along == pytest.approx(210e3 * 0.01 / 2, rel=0.01)
    np.testing.assert_allclose(accepted.tool_force(0), 4 * along * TURNS[turn][:, 2], atol=1e-6 * along)


def bent(rng):
    """Two faces of different size above each other, of six nodes that are all off their planes."""
    low, up = (brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.T10) for _ in range(2))
    mesh = together({"low": low, "up": shifted(replace(up, nodes=0.7 * up.nodes), 0.2, 0.1, 1.1)})
    nodes = mesh.nodes + 0.03 * rng.uniform(-1, 1, mesh.nodes.shape)
    return mesh, nodes


def test_means_are_those_of_a_fine_sampling():
    """Of int psi_p N_k dA: places on the four triangles of a face, and before them along their normals."""
    mesh, nodes = bent(np.random.default_rng(0))
    sides = DeformableTool(("low/top",), ("up/base",), 0.0).of(mesh).sides
    found = facing(nodes, sides, ring=False)
    places = _places(300)
    total, area = np.zeros(found.weights.get_shape()), np.zeros(len(sides.node))
    for face in sides.one:
        for part, corners in zip(PARTS, flats(face[None], 3), strict=True):
            a, b, c = nodes[corners]
            normal = np.cross(b - a, c - a)
            longest = max(np.linalg.norm(of) for of in (b - a, c - a, c - b))
            x, shapes = places @ nodes[corners], _quadratic(places @ part)
            for other in sides.other:
                for its, across in zip(PARTS, flats(other[None], 3), strict=True):
                    # x + h n = u . corners with u_1 + u_2 + u_3 = 1.
                    A = np.vstack([np.column_stack([nodes[across].T, -normal]), [1.0, 1.0, 1.0, 0.0]])
                    u = np.linalg.solve(A, np.vstack([x.T, np.ones(len(x))])).T
                    u, height = u[:, :3], u[:, 3] * np.linalg.norm(normal)
                    met = (u >= 0).all(axis=1) & (height * _sine(normal, nodes[across]) <= 0.03 * longest)
                    for k, node in enumerate(corners):
                        (p,) = np.flatnonzero(sides.node == node)
                        share = met * places[:, k] * np.linalg.norm(normal)
                        area[p] += share.sum()
                        np.add.at(total[p], face, share @ shapes)
                        np.add.at(total[p], other, -(share @ _quadratic(u @ its)))
    np.testing.assert_allclose(found.weights.toarray(), total / area[:, None], atol=3e-3)
    # Rows of both sides sum to one.
    np.testing.assert_allclose(found.weights @ np.ones(len(nodes)), 0.0, atol=1e-13)


def _sine(normal, corners):
    """Of the angle between the normal of a triangle and that of another one, with corners (3, 3)."""
    other = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return np.linalg.norm(np.cross(normal, other)) / np.linalg.norm(normal) / np.linalg.norm(other)


MIDDLES = (np.eye(3) + np.roll(np.eye(3), 1, axis=1)) / 2
PARTS = np.array([np.vstack([np.eye(3), MIDDLES])[of] for of in ([0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5])])


def _places(n):
    """The middles of the n^2 triangles of a triangle, barycentric."""
    i, j = (of.ravel() for of in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    up, down = i + j < n, i + j < n - 1
    first = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / n
    second = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / n
    return np.stack([1 - first - second, first, second], axis=1)


def _quadratic(place):
    """The shape functions of a triangle with six nodes at barycentric places (n, 3)."""
    a, b, c = place.T
    return np.stack([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a], axis=1)


@pytest.mark.parametrize("count", [6, 8])
def test_flats_are_all_of_a_face_and_run_as_it_does(count):
    """Whichever its first corner is."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    ends = square if count == 8 else square[[0, 1, 3]]
    nodes, half = np.vstack([ends, (ends + np.roll(ends, -1, axis=0)) / 2]), count // 2
    found = []
    for first in range(half):
        turned = np.concatenate([np.roll(np.arange(half), -first), half + np.roll(np.arange(half), -first)])
        of = flats(turned[None], 3)
        areas = area_of(nodes[of])
        assert (areas > 0).all()
        assert areas.sum() == pytest.approx(area_of(ends))
        found.append({tuple(sorted({*part})) for part in of.tolist()})
    assert found.count(found[0]) == half
    assert set().union(*found[0]) == {*range(count)}


def test_where_more_than_two_faces_meet_in_an_edge_none_continues():
    """A middle node is the double corner of one triangle in most faces, and of two or none in others."""
    faces = []
    for k, first in enumerate((1, 1, 2, 3)):
        far, up, low, side, top = range(3 + 5 * k, 8 + 5 * k)
        faces.append([*np.roll([0, far, up, 1], first), *np.roll([low, side, top, 2], first)])
    faces = np.array(faces)
    one, other = beside(flats(faces, 3))
    whose, node = np.repeat(np.arange(4), 20), flats(faces, 3).ravel()
    assert (whose[one] == whose[other]).all()
    np.testing.assert_array_equal(node[one], node[other])


def test_points_share_the_area_of_plane_faces():
    mesh = brick(2.0, 1.0, 1.0, 2, 1, 1, element=Element.T10)
    faces = flats(mesh.around("top"), 3)
    assert facet_mass(mesh.nodes, faces, Geometry.SOLID).sum() == pytest.approx(2.0)
    assert len(faces) == 4 * len(mesh.around("top"))
    middle = np.cross(*(np.diff(mesh.nodes[faces], axis=1)[:, k] for k in range(2)))
    assert (middle[:, 2] > 0).all()


def test_the_nodes_of_a_face_that_one_goes_through_are_told_once_each():
    """A triangle at a corner of a face of eight nodes is a square of which one corner is told twice."""
    mesh = together(
        {"low": (one := brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.H20)), "up": shifted(one, 0.1, 0.1, 1.1)}
    )
    node = mesh.boundary_nodes("up/base")
    node = node[np.argmin(mesh.nodes[node, :2].sum(axis=1))]
    moved = mesh.nodes.copy()
    moved[node, 2] -= 0.6
    found, face = crossed(mesh.nodes, moved, np.array([node]), mesh.around("low/top"), np.ones(1))
    assert found == node
    assert len(face) == len({*face}) == 3


def test_middle_nodes_that_go_through_faces_are_found():
    mesh, _ = bent(np.random.default_rng(0))
    moved = mesh.nodes.copy()
    node = np.setdiff1d(mesh.boundary_nodes("up/base"), mesh.elements[:, :4])[0]
    moved[node, 2] -= 0.6
    volume = np.full(2, 1 / 6)
    assert crossed(mesh.nodes, moved, mesh.boundary_nodes("up/base"), mesh.around("low/top"), volume)[0] == node
    assert deep(moved, mesh.around("up/base"), mesh.around("low/top"), False) > 0.3
    assert deep(mesh.nodes, mesh.around("up/base"), mesh.around("low/top"), False) == 0


@pytest.mark.slow
@pytest.mark.parametrize("element", ELEMENTS)
def test_forms_agree_and_work_is_kept(element):
    scene = pressed(press=0.2, element=element)
    first, other = (last(scene, Control(form, ()), FEW) for form in (Newton(), Dissipation()))
    np.testing.assert_allclose(other.tool_force(0), first.tool_force(0), rtol=1e-5)
    assert abs(first.energies.energy_error) < 1e-3
    assert first.energies.friction > 0.01 * first.energies.work


@pytest.mark.slow
def test_all_elements_tend_to_one_force():
    """The pressing of a block by a punch: 0.5 per cent on meshes as coarse as these."""
    schedule = Schedule(3, first=0.05, settling=1, growth=4.0)
    force = [
        last(pressed(press=0.3, n=n, element=of), NEWTON, schedule).tool_force(0)[2]
        for of, n in ((Element.H8, 4), (Element.T10, 2), (Element.H20, 2))
    ]
    np.testing.assert_allclose(force[1:], force[0], rtol=5e-3)


@pytest.mark.parametrize("height", [0.05, 0.2])
@pytest.mark.parametrize("element", ELEMENTS)
def test_a_uniform_pressure_passes_a_curved_interface(element, height):
    """That of two welded blocks without lateral strain, on meshes that do not match; errors are of order two in slopes.

    Points with gaps that curved sides only seem to have slipped in the first increment, as if they were not welded.
    """
    scene = stack(np.eye(3), mu=np.inf, element=element, kind=Symmetry)
    x = scene.mesh.nodes.copy()
    x[:, 2] -= height * (x[:, 0] ** 2 + x[:, 1] ** 2) * np.clip(1 - np.abs(x[:, 2] - 1), 0, 1)
    curved = replace(scene, mesh=replace(scene.mesh, nodes=x), material=Elastic(Elasticity(210e3, 0.0)))
    stress = last(curved).state.stress
    assert np.abs(stress - stress.mean(axis=(0, 1))).max() < 0.2 * height**2 * np.abs(stress).max()


@pytest.mark.slow
@pytest.mark.parametrize("element", ELEMENTS)
def test_caps_of_friction_are_those_of_the_area(element):
    """Of a cube that is dragged, 1 by 1: m k A, of which what has lifted at its trailing edge bears nothing."""
    slid = last(dragged(element), NEWTON, Schedule(5))
    rows, (normal, *along) = slid.solved.iterate.rows, slid.state.forces.T
    assert rows.cap.sum() == pytest.approx(0.3 * K, rel=2e-3)
    cap, bears = np.minimum(rows.cap, rows.mu * normal), normal > 0
    np.testing.assert_allclose(np.hypot(*along), cap, rtol=1e-6, atol=1e-6 * cap.max())
    assert cap[bears].sum() > 0.97 * cap.sum()
