"""Deformable tools in space with quadratic faces: tetrahedra with ten nodes."""

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
from bipot.scene.deformable import require_facing
from bipot.tools.facing import facing
from bipot.tools.flats import flats
from bipot.tools.passing import crossed, deep
from tests.deformable import shifted
from tests.scenes import refused
from tests.test_deformable_caps import K, dragged
from tests.test_deformable_space import FEW, NEWTON, TURNS, last, pressed, stack


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("form", [Newton(), pytest.param(Dissipation(), marks=pytest.mark.slow)])
def test_a_uniform_pressure_passes_meshes_that_do_not_match(turn, form):
    scene = stack(TURNS[turn], mu=0.3, element=Element.T10, kind=Symmetry)
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
            x, shapes = places @ nodes[corners], _quadratic(places @ part)
            for other in sides.other:
                for its, across in zip(PARTS, flats(other[None], 3), strict=True):
                    # x + h n = u . corners with u_1 + u_2 + u_3 = 1.
                    A = np.vstack([np.column_stack([nodes[across].T, -normal]), [1.0, 1.0, 1.0, 0.0]])
                    u = np.linalg.solve(A, np.vstack([x.T, np.ones(len(x))])).T[:, :3]
                    met = (u >= 0).all(axis=1)
                    for k, node in enumerate(corners):
                        (p,) = np.flatnonzero(sides.node == node)
                        share = met * places[:, k] * np.linalg.norm(normal)
                        area[p] += share.sum()
                        np.add.at(total[p], face, share @ shapes)
                        np.add.at(total[p], other, -(share @ _quadratic(u @ its)))
    np.testing.assert_allclose(found.weights.toarray(), total / area[:, None], atol=3e-3)
    # Rows of both sides sum to one.
    np.testing.assert_allclose(found.weights @ np.ones(len(nodes)), 0.0, atol=1e-13)


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


def test_points_share_the_area_of_plane_faces():
    mesh = brick(2.0, 1.0, 1.0, 2, 1, 1, element=Element.T10)
    faces = flats(mesh.around("top"), 3)
    assert facet_mass(mesh.nodes, faces, Geometry.SOLID).sum() == pytest.approx(2.0)
    assert len(faces) == 4 * len(mesh.around("top"))
    middle = np.cross(*(np.diff(mesh.nodes[faces], axis=1)[:, k] for k in range(2)))
    assert (middle[:, 2] > 0).all()


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
def test_forms_agree_and_work_is_kept():
    scene = pressed(press=0.2, element=Element.T10)
    first, other = (last(scene, Control(form, ()), FEW) for form in (Newton(), Dissipation()))
    np.testing.assert_allclose(other.tool_force(0), first.tool_force(0), rtol=1e-5)
    assert abs(first.energies.energy_error) < 1e-3
    assert first.energies.friction > 0.01 * first.energies.work


@pytest.mark.slow
def test_tetrahedra_and_bricks_tend_to_one_force():
    """The pressing of a block by a punch: 0.5 per cent on meshes as coarse as these."""
    schedule = Schedule(3, first=0.05)
    force = [
        last(pressed(press=0.3, n=n, element=of), NEWTON, schedule).tool_force(0)[2]
        for of, n in ((Element.H8, 4), (Element.T10, 2))
    ]
    assert force[0] == pytest.approx(force[1], rel=5e-3)


@pytest.mark.parametrize("height", [0.05, 0.2])
def test_a_uniform_pressure_passes_a_curved_interface(height):
    """That of two welded blocks without lateral strain, on meshes that do not match."""
    scene = stack(np.eye(3), mu=np.inf, element=Element.T10, kind=Symmetry)
    x = scene.mesh.nodes.copy()
    x[:, 2] -= height * (x[:, 0] ** 2 + x[:, 1] ** 2) * np.clip(1 - np.abs(x[:, 2] - 1), 0, 1)
    curved = replace(scene, mesh=replace(scene.mesh, nodes=x), material=Elastic(Elasticity(210e3, 0.0)))
    stress = last(curved).state.stress
    assert np.abs(stress - stress.mean(axis=(0, 1))).max() < 0.12 * height * np.abs(stress).max()


@pytest.mark.slow
def test_caps_of_friction_are_those_of_the_area():
    """Of a cube that is dragged, 1 by 1: m k A, of which what has lifted at its trailing edge bears nothing."""
    slid = last(dragged(Element.T10), NEWTON, Schedule(5))
    cap, friction = slid.solved.iterate.rows.cap, np.hypot(*slid.state.forces[:, 1:].T)
    assert cap.sum() == pytest.approx(0.3 * K, rel=2e-3)
    bears = slid.state.forces[:, 0] > 0
    np.testing.assert_allclose(friction, np.where(bears, cap, 0.0), rtol=1e-6)
    assert cap[bears].sum() > 0.97 * cap.sum()


def test_faces_of_which_no_pieces_are_known_are_refused():
    mesh = stack(np.eye(3)).mesh.to(Element.H20)
    tool = DeformableTool(("low/top",), ("up/base",), 0.0).of(mesh)
    refused(lambda: require_facing(mesh, False, tool, "tools[0]"), r"H20.*one of H8, T4 and T10 in space")
