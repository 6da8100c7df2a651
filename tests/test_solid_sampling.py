"""Contact in weighted means on faces: weights by their definition, patch tests, whole bodies, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Bounds,
    Circle,
    Control,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Limits,
    Mesh,
    Newton,
    Perfect,
    Plane,
    Revolved,
    Sampling,
    Scene,
    SceneError,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    VonMises,
    brick,
    march,
)
from bipot.contact.sampling import CREASE, hat_areas, points
from bipot.system import system_of
from tests.scenes import refused
from tests.solids import distorted

WEIGHTED = Sampling.WEIGHTED

QUADRATIC = (Element.H20, Element.T10)

STEEL = VonMises(Elasticity(210e3, 0.3), Perfect(300.0))

ELASTIC = VonMises(Elasticity(1000.0, 0.3), Perfect(1e6))

PLANES = (Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2))

WELDED = tuple(Support("base", d) for d in range(3))

BALL = Revolved(Circle((0.0, 0.0), 2.0), (1.0, 1.0, 4.0), (0.0, 0.0, 1.0))

TIGHT = Limits(Bounds(equilibrium=1e-12, penetration=1e-15))


def press(height, travel, mu=0.2, **given):
    return FlatTool((0.0, 0.0, height), (0.0, 0.0, -1.0), travel, given.pop("candidates", ("top",)), mu, **given)


def upset(element=Element.H20, mu=0.2, n=2, sampling=WEIGHTED, travel=-0.03):
    """An eighth of a cube under a punch that touches its sides too."""
    punch = press(5.0, (0.0, 0.0, travel), mu, candidates=("top", "right", "back"), sampling=sampling)
    return Scene(brick(5.0, 5.0, 5.0, n, n, n, element=element), Geometry.SOLID, STEEL, PLANES, (punch,))


def graded(element):
    """A block whose faces are rectangles, or triangles, of different sizes."""
    straight = brick(2.0, 1.5, 1.0, 3, 2, 2, element=Element.H8 if element.shape.cube else Element.T4)
    nodes = straight.nodes * (1 + 0.2 * straight.nodes)
    return Mesh(nodes, straight.elements, straight.boundaries).to(element)


def by_quadrature(x, count=8):
    """int psi_p N_k dA (k, n) over a flat face x (8 or 6, 3) with straight sides, from shape functions of its own."""
    t, w = np.polynomial.legendre.leggauss(count)
    out = np.zeros((len(x) // 2, len(x)))
    for s, ws in zip(t, w, strict=True):
        for r, wr in zip(t, w, strict=True):
            if len(x) == 8:
                ends = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
                psi = (1 + ends[:, 0] * s) * (1 + ends[:, 1] * r) / 4
                middle = [(1 - s * s) * (1 - r) / 2, (1 + s) * (1 - r * r) / 2]
                middle += [(1 - s * s) * (1 + r) / 2, (1 - s) * (1 - r * r) / 2]
                N = np.concatenate([psi * (ends @ (s, r) - 1), middle])
                slope = ends / 4 * (1 + ends[:, ::-1] * (r, s))
                area = ws * wr
            else:
                # The square taken together to a triangle at its far end.
                a, b = (1 + s) / 2, (1 + r) / 2 * (1 - (1 + s) / 2)
                psi = np.array([1 - a - b, a, b])
                N = np.concatenate([psi * (2 * psi - 1), 4 * psi * np.roll(psi, -1)])
                slope = np.array([(-1.0, -1.0), (1.0, 0.0), (0.0, 1.0)])
                area = ws * wr / 4 * (1 - a)
            along = x[: len(psi)].T @ slope
            out += area * np.linalg.norm(np.cross(*along.T)) * np.outer(psi, N)
    return out


@pytest.mark.parametrize("element", QUADRATIC)
def test_weights_are_the_means_of_their_definition_and_areas_are_positive(element):
    mesh = graded(element)
    found = points(mesh, Geometry.SOLID, press(1.0, (0.0, 0.0, -0.1), candidates=("top", "right"), sampling=WEIGHTED))
    integral = np.zeros((len(found.node), len(mesh.nodes)))
    for face, corners in zip(found.facets, found.point, strict=True):
        shares = by_quadrature(mesh.nodes[face])
        np.add.at(integral, np.ix_(corners, face), shares)
        np.testing.assert_allclose(hat_areas(mesh.nodes, face[None], Geometry.SOLID)[0], shares.sum(axis=1), rtol=1e-12)
    area = integral.sum(axis=1, keepdims=True)
    assert area.min() > 0
    # What a uniform pressure does at nodes: less than nothing at corners of bricks, nothing at those of tetrahedra.
    at_corners = integral.sum(axis=0)[found.node]
    assert at_corners.max() < -0.01 if element is Element.H20 else np.abs(at_corners).max() < 1e-14
    np.testing.assert_allclose(found.weights.toarray(), integral / area, atol=1e-13)
    assert found.node.tolist() == np.sort(found.node).tolist()
    assert (found.node[found.point] == found.facets[:, : found.point.shape[1]]).all()


@pytest.mark.parametrize(("turn", "shared"), [(0.0, True), (55.0, True), (65.0, False)])
@pytest.mark.parametrize("element", QUADRATIC)
def test_where_a_face_turns_too_far_from_its_neighbour_both_have_points(element, turn, shared):
    straight = brick(2.0, 1.0, 1.0, 2, 1, 1, element=element)
    x, y, z = straight.nodes.T
    bent = np.column_stack([x, y, z - np.tan(np.radians(turn)) * np.maximum(x - 1.0, 0.0)])
    mesh = Mesh(bent, straight.elements, straight.boundaries)
    found = points(mesh, Geometry.SOLID, press(1.0, (0.0, 0.0, -0.1), sampling=WEIGHTED))
    ridge = np.isclose(mesh.nodes[found.node, 0], 1.0)
    assert ridge.sum() == (2 if shared else 4)
    assert (np.cos(np.radians(turn)) >= CREASE) is np.bool_(shared)
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, rtol=1e-14)


def test_on_linear_faces_both_choices_are_one_bit_for_bit():
    ends = [list(march(upset(Element.H8, sampling=one), Schedule(3), Control(Newton())))[-1] for one in Sampling]
    np.testing.assert_array_equal(ends[0].state.nodes, ends[1].state.nodes)
    np.testing.assert_array_equal(ends[0].solved.r, ends[1].solved.r)


@pytest.mark.parametrize("travel", [-1e-3, -0.3])
@pytest.mark.parametrize("element", [Element.H8, *QUADRATIC])
def test_the_contact_patch_test_is_passed(element, travel):
    """The multipliers are the pressure times the area that is a point's, however far the smooth tool goes."""
    mesh = graded(element)
    tool = press(1.2, (0.0, 0.0, travel), 0.0, sampling=WEIGHTED)
    scene = Scene(mesh, Geometry.SOLID, ELASTIC, PLANES, (tool,))
    *_, last = march(scene, Schedule(3), Control(Newton(), limits=TIGHT))
    stress, pressure = last.state.stress, last.traction.recovered_pressure
    np.testing.assert_allclose(stress, np.broadcast_to(stress[0, 0], stress.shape), atol=1e-9 * abs(stress).max())
    np.testing.assert_allclose(pressure, -stress[0, 0, 2], rtol=1e-9)
    if element.quadratic:
        own, area = system_of(scene).candidates.points[0], np.zeros(len(pressure))
        np.add.at(area, own.point, hat_areas(last.state.nodes, own.facets, scene.geometry))
        np.testing.assert_allclose(last.solved.r[:, 0], pressure * area, rtol=1e-9)


def test_the_patch_test_is_passed_on_tetrahedra_of_any_shape():
    mesh = distorted(Element.T10)
    tool = press(2.0, (0.0, 0.0, -0.2), 0.0, sampling=WEIGHTED)
    *_, last = march(
        Scene(mesh, Geometry.SOLID, ELASTIC, PLANES, (tool,)), Schedule(2), Control(Newton(), limits=TIGHT)
    )
    np.testing.assert_allclose(last.traction.recovered_pressure, -last.state.stress[0, 0, 2], rtol=1e-9)


def test_half_of_a_body_bears_half_the_force_of_the_whole():
    """Points in the plane between are means of the whole body: they slip along the plane, not across it."""
    seen = []
    for whole in (True, False):
        mesh = brick(4.0 if whole else 2.0, 2.0, 2.0, 4 if whole else 2, 1, 1, element=Element.H20)
        held = WELDED if whole else (*WELDED, Symmetry("left", 0))
        faces = ("top", "right", *(("left",) if whole else ()))
        tool = press(2.0, (0.0, 0.1, -0.04), candidates=faces, sampling=WEIGHTED)
        scene = Scene(mesh, Geometry.SOLID, STEEL, held, (tool,))
        *_, last = march(scene, Schedule(3), Control(Newton(), limits=TIGHT))
        seen.append(last)
    whole, half = seen
    force = whole.tool_forces[0]
    assert half.tool_forces[0, 1:] == pytest.approx(force[1:] / 2, rel=1e-8)
    np.testing.assert_allclose(half.tool_force(0), force, atol=1e-7 * abs(force).max())
    assert force[1] > 0.03 * abs(force[2])
    candidates = half.solved.iterate.increment.system.candidates
    middle = candidates.scene.mesh.nodes[candidates.node, 0] == 0.0
    np.testing.assert_allclose(candidates.vectors(half.solved.r)[middle, 0], 0.0, atol=1e-9 * abs(force).max())
    assert abs(half.energies.energy_error) < 0.02


@pytest.mark.parametrize(
    "tool",
    [
        press(2.0, (0.0, 0.0, -0.1)),
        press(2.0, (0.0, 0.0, -0.1), candidates=("right", "top")),
        ShapedTool(Plane((0.0, 0.0, 2.0), (0.0, 0.0, -1.0)), (0.0, 0.0, -0.1), ("top",), 0.2),
        ShapedTool(BALL, (0.0, 0.0, -0.1), ("top",), 0.2),
        ShapedTool(BALL, (0.0, 0.0, -0.1), ("right",), 0.2),
    ],
    ids=["flat", "on a side too", "a plane", "a ball", "a ball beside"],
)
def test_nodes_with_negative_shares_of_faces_that_a_tool_may_press_are_refused(tool):
    """A uniform pressure pulls at the corners of faces of eight nodes: contact left them, and let the middles in."""
    mesh = brick(2.0, 2.0, 2.0, 1, 1, 1, element=Element.H20)
    said = (
        r"tools\[1\].sampling = <Sampling.NODES.*>: must be Sampling.WEIGHTED on faces of H20: their corners have neg"
    )
    smooth = press(2.0, (0.0, 0.0, -0.1), 0.0, candidates=("back",))
    with pytest.raises(SceneError, match=said):
        Scene(mesh, Geometry.SOLID, STEEL, PLANES, (smooth, tool))
    assert Scene(mesh, Geometry.SOLID, STEEL, PLANES, (smooth, replace(tool, sampling=WEIGHTED)))
    for element in (Element.H8, Element.T4, Element.T10):
        assert Scene(brick(2.0, 2.0, 2.0, 1, 1, 1, element=element), Geometry.SOLID, STEEL, PLANES, (smooth, tool))


@pytest.mark.parametrize(("lean", "side"), [(0.0, True), (25.0, True), (35.0, False)])
def test_sides_beside_a_flat_tool_may_be_met_at_nodes(lean, side):
    """They lean to it by so many degrees."""
    straight = brick(2.0, 2.0, 2.0, 1, 1, 1, element=Element.H20)
    x, y, z = straight.nodes.T
    narrow = np.column_stack([x * (1 - np.tan(np.radians(lean)) * z / 2), y, z])
    mesh = Mesh(narrow, straight.elements, straight.boundaries)
    tool = press(2.0, (0.0, 0.0, -0.1), candidates=("right", "back"))
    if side:
        assert Scene(mesh, Geometry.SOLID, STEEL, PLANES, (tool,))
    else:
        with pytest.raises(SceneError, match="Sides that roll onto a flat tool may be met at nodes"):
            Scene(mesh, Geometry.SOLID, STEEL, PLANES, (tool,))


def test_a_coefficient_at_a_node_without_a_point_is_refused():
    scene = upset()
    face = scene.mesh.boundary("top")[0]
    corner, middle = int(face[0]), int(face[4])
    given = replace(scene, tools=(replace(scene.tools[0], mu_at={corner: 0.4}),))
    assert system_of(given).candidates.mu.max() == 0.4
    refused(lambda: replace(scene, tools=(replace(scene.tools[0], mu_at={middle: 0.4}),)), f"mu_at node = {middle}")
