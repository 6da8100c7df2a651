"""Motions without strain that few integration points leave are refused; elements beside each other have none."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Mesh,
    Newton,
    Quadrature,
    Scene,
    SceneError,
    Schedule,
    Support,
    Symmetry,
    Traction,
    VolumeChange,
    block,
    brick,
    cylinder_3d,
    march,
    ring_3d,
)
from bipot.fem.elements import RULES
from bipot.fem.projection import VOLUMES
from bipot.fem.strainless import Held, kept_by_means
from bipot.scene.holding import Holding

RUBBER = Elastic(Elasticity(1e3, 0.3))
CLAMPED = tuple(Support("base", k) for k in range(3))
CUT = (Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2))
ROW = brick(1.0, 1.0, 4.0, 1, 1, 4, element=Element.H20)
PAIR = brick(1.0, 1.0, 2.0, 1, 1, 2, element=Element.H20)
BETWEEN = (*CLAMPED, *(Support("top", k) for k in range(3)))
ONE = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]], {"base": [[0, 1, 2]]}).to(Element.T10)


PRISM = Mesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
    [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]],
    {"base": [[0, 1, 2]], "top": [[3, 4, 5]]},
).to(Element.T10)
SIX = brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.T10)


def part(mesh: Mesh, elements: list[int], name: str) -> Mesh:
    """Some elements of a mesh, with what they have of the boundary ``name``."""
    kept = mesh.elements[elements]
    used, number = np.unique(kept, return_inverse=True)
    faces = np.array([face for face in mesh.boundary(name) if any(np.isin(face, own).all() for own in kept)])
    return Mesh(mesh.nodes[used], number.reshape(kept.shape), {name: np.searchsorted(used, faces)})


def boss() -> Mesh:
    """A block of two by two elements with a single one on its top."""
    return part(brick(2.0, 2.0, 2.0, 2, 2, 2, element=Element.H20), [0, 1, 2, 3, 4], "base")


def tower(element: Element) -> Mesh:
    """Two by two by two cubes with a single one on top."""
    mesh = brick(2.0, 2.0, 3.0, 2, 2, 3, element=element)
    middle = mesh.nodes[mesh.elements[:, : element.corners]].mean(axis=1)
    return part(mesh, np.flatnonzero((middle[:, 2] < 2) | (middle[:, :2] < 1).all(axis=1)).tolist(), "base")


def frame(n: int) -> Mesh:
    """A square frame of one element's width, n along each side."""
    mesh = brick(n, n, 1.0, n, n, 1, element=Element.H20)
    middle = mesh.nodes[mesh.elements].mean(axis=1)[:, :2]
    return part(mesh, np.flatnonzero((np.abs(middle - n / 2) > n / 2 - 1).any(axis=1)).tolist(), "left")


def moved(mesh: Mesh, far: float, seed: int = 0) -> Mesh:
    """The mesh with nodes moved at random."""
    by = far * np.random.default_rng(seed).uniform(-1, 1, mesh.nodes.shape)
    return Mesh(mesh.nodes + by, mesh.elements, mesh.boundaries)


@pytest.mark.parametrize(
    ("mesh", "supports", "said"),
    [
        (
            ROW,
            CLAMPED,
            r"'GAUSS2 with P1': must be of \['GAUSS3 with P1', .*row of single ones, as element 0 at \(0\.5, 0\.5",
        ),
        (moved(ROW, 0.01), CLAMPED, "GAUSS2 with P1"),
        (moved(ROW, 0.05), CLAMPED, "GAUSS2 with P1"),
        (moved(ROW, 0.1), CLAMPED, "GAUSS2 with P1"),
        (moved(ROW, 0.05), (Support("base", 2),), "GAUSS2 with P1"),
        (moved(PAIR, 0.05), BETWEEN, "GAUSS2 with P1"),
        (moved(PAIR, 0.1), BETWEEN, "GAUSS2 with P1"),
        (moved(PAIR, 0.1, 2), BETWEEN, "GAUSS2 with P1"),
        (ring_3d(1.0, 1.2, 0.1, 3, 1, 1, element=Element.H20), (Symmetry("left", 0), Symmetry("front", 1)), "GAUSS2"),
        (ROW, (Support("base", 2),), "GAUSS2 with P1"),
        (boss(), CLAMPED, "as element 4 at"),
        (moved(boss(), 0.1), CLAMPED, "as element 4 at"),
        (ONE, (Support("base", 2),), r"'TETRAHEDRON4 with P0': must be of \['TETRAHEDRON4 with AS_IS'"),
        (PRISM, (), "TETRAHEDRON4 with P0"),
        (moved(PRISM, 0.05), (), "TETRAHEDRON4 with P0"),
        (PRISM, (Support("base", 2),), "TETRAHEDRON4 with P0"),
        (SIX, (), "TETRAHEDRON4 with P0"),
        (SIX, (Support("base", 2),), r"must be of \['TETRAHEDRON4 with AS_IS'.*middles.* nearly in one plane"),
    ],
    ids=[
        "row",
        "distorted row",
        "row distorted by a twentieth",
        "row distorted by a tenth",
        "distorted row on a plane",
        "distorted pair",
        "pair distorted by a tenth",
        "pair distorted otherwise",
        "ring",
        "row on a plane",
        "boss",
        "distorted boss",
        "tetrahedron",
        "prism",
        "distorted prism",
        "prism on a plane",
        "cube of six tetrahedra",
        "cube on a plane",
    ],
)
def test_what_integration_points_do_not_see_is_refused(mesh, supports, said):
    with pytest.raises(SceneError, match=r"scene\.quadrature, scene\.volume = .*" + said):
        Scene(mesh, Geometry.SOLID, RUBBER, supports)


def test_a_single_element_in_a_plane_that_nothing_else_holds_is_refused():
    single = block(1.0, 1.0, 1, 1, element=Element.Q8)
    with pytest.raises(SceneError, match=r"GAUSS2 with P1.*motions without strain"):
        Scene(single, Geometry.PLANE_STRAIN, RUBBER, (), quadrature=Quadrature.GAUSS2)
    Scene(single, Geometry.PLANE_STRAIN, RUBBER, ())


@pytest.mark.parametrize("volume", [VolumeChange.P1, VolumeChange.AS_IS])
def test_a_cantilever_of_single_elements_bends_as_a_beam_by_the_rule_that_sees_it(volume):
    """F L^3/(3 E I) and the shear's F L/(5/6 G A), together 0.0537; by eight points it was off by any amount."""
    scene = Scene(
        ROW,
        Geometry.SOLID,
        RUBBER,
        CLAMPED,
        loads=(Traction("top", (0.2, 0.0, 0.0)),),
        quadrature=Quadrature.GAUSS3,
        volume=volume,
    )
    *_, last = march(scene, Schedule(2), Control(Newton()))
    tip = last.displacement[ROW.boundary_nodes("top"), 0]
    np.testing.assert_allclose(tip, 0.2 * (4**3 * 12 / 3e3 + 4 * 6 / 5 * 2.6 / 1e3), rtol=0.06)
    assert np.ptp(tip) < 0.01 * tip.mean()


@pytest.mark.parametrize(
    "mesh",
    [
        brick(2.0, 2.0, 1.0, 2, 2, 1, element=Element.H20),
        brick(2.0, 0.2, 3.0, 3, 1, 3, element=Element.H20),
        brick(2.0, 2.0, 2.0, 2, 2, 2, element=Element.T10),
        ring_3d(1.0, 1.2, 1.0, 3, 2, 1, element=Element.H20),
    ],
    ids=["slab", "plate", "tetrahedra", "ring"],
)
@pytest.mark.parametrize("far", [0.0, 0.005])
def test_no_motion_is_without_strain_where_elements_are_beside_each_other(mesh, far):
    """So that nothing is factorised for them where a scene is made."""
    mesh = moved(mesh, far)
    holding = Holding.of((Support("base", 2),), mesh)
    held = Held(mesh, Geometry.SOLID, holding.numbers, holding.axes)
    assert not replace(held, numbers=holding.numbers[:0]).alone.any()
    for volume in {VOLUMES[mesh.element][0], VolumeChange.AS_IS}:
        assert held.all_strained(RULES[mesh.element][0], volume, np.arange(len(mesh.elements)), least=5e-3)


def test_a_slice_of_a_thin_ring_is_taken():
    thin = ring_3d(1.0, 1.005, 0.1, 2, 1, 1, element=Element.H20)
    Scene(
        thin, Geometry.SOLID, RUBBER, (Symmetry("left", 0), Symmetry("front", 1), Support("base", 2), Support("top", 2))
    )


def test_a_frame_of_one_element_between_its_corners_is_taken_and_of_two_refused():
    held = tuple(Support("left", k) for k in range(3))
    Scene(frame(3), Geometry.SOLID, RUBBER, held)
    Scene(moved(frame(3), 0.05), Geometry.SOLID, RUBBER, held)
    for mesh in (frame(4), moved(frame(4), 0.05)):
        with pytest.raises(SceneError, match="motions without strain"):
            Scene(mesh, Geometry.SOLID, RUBBER, held)


def test_a_row_that_planes_of_symmetry_hold_is_taken():
    Scene(ROW, Geometry.SOLID, RUBBER, CUT)
    holding = Holding.of(CUT, ROW)
    asked = Quadrature.GAUSS2, VolumeChange.P1
    held = Held(ROW, Geometry.SOLID, holding.numbers, holding.axes)
    assert not held.strainless(*asked).size
    assert replace(held, numbers=holding.numbers[:0]).strainless(*asked).size == 4


def test_a_ring_of_two_triangles_with_middles_at_one_height_is_refused():
    """Means over both are blind to a motion with strain in proportion to the height above their middles."""
    corners = [[1.0, 0.0], [1.5, -0.5], [2.0, 0.0], [1.5, 0.5]]
    ring = Mesh(corners, [[0, 1, 3], [1, 2, 3]], {"low": [[0, 1]]}).to(Element.T6)
    with pytest.raises(SceneError, match=r"TRIANGLE3 with P0.*middles.* in one plane"):
        Scene(ring, Geometry.AXISYMMETRIC, RUBBER, ())
    Scene(ring, Geometry.AXISYMMETRIC, RUBBER, (Support("low", 0), Support("low", 1)))
    Scene(ring, Geometry.PLANE_STRAIN, RUBBER, ())


def test_tetrahedra_that_supports_hold_or_with_middles_apart_are_taken():
    Scene(SIX, Geometry.SOLID, RUBBER, CLAMPED)
    Scene(SIX, Geometry.SOLID, RUBBER, CUT)
    Scene(brick(1.0, 1.0, 2.0, 2, 2, 2, element=Element.T10), Geometry.SOLID, RUBBER, ())


@pytest.mark.parametrize(
    ("mesh", "supports"),
    [
        (brick(1.0, 1.0, 2.0, 1, 1, 2, element=Element.T10), ()),
        (brick(1.0, 1.0, 6.0, 1, 1, 6, element=Element.T10), CLAMPED),
        (brick(2.0, 1.0, 2.0, 2, 1, 2, element=Element.T10), CLAMPED),
        (moved(brick(1e-3, 1e-3, 4e-3, 1, 1, 4, element=Element.T10), 5e-5), CLAMPED),
        (tower(Element.T10), CLAMPED),
    ],
    ids=["two cubes", "row", "two rows", "distorted row in other units", "single cube on a block"],
)
def test_rows_of_tetrahedra_that_means_leave_soft_are_refused(mesh, supports):
    """Tractions that are linear on each face move them 4 to 15 times as far as they should."""
    with pytest.raises(SceneError, match=r"TETRAHEDRON4 with P0.*middles of elements .* in one plane, as element"):
        Scene(mesh, Geometry.SOLID, RUBBER, supports)
    Scene(mesh, Geometry.SOLID, RUBBER, supports, volume=VolumeChange.AS_IS)


@pytest.mark.parametrize(
    ("mesh", "supports"),
    [
        (brick(1.0, 1.0, 1.0, 2, 2, 2, element=Element.T10), ()),
        (moved(brick(2.0, 2.0, 2.0, 2, 2, 2, element=Element.T10), 0.05, 1), ()),
        (brick(10.0, 10.0, 1.0, 2, 2, 2, element=Element.T10), CLAMPED),
        (brick(8.0, 8.0, 0.2, 4, 4, 1, element=Element.T10), (Support("base", 2),)),
        (brick(1.0, 1.0, 10.0, 2, 2, 10, element=Element.T10), ()),
        (brick(1.0, 1.0, 1.0, 2, 2, 2, element=Element.T10, grading=(5.0, 5.0, 5.0)), ()),
        (brick(1.0, 1.0, 6.0, 1, 1, 6, element=Element.T10), CUT),
        (cylinder_3d(5.0, 5.0, 2, 1, 2, element=Element.T10), ()),
        (cylinder_3d(5.0, 5.0, 1, 1, 1, element=Element.T10), CUT),
        (ring_3d(1.0, 1.1, 0.3, 4, 1, 1, element=Element.T10), CUT),
        (ring_3d(1.0, 2.0, 1.0, 3, 2, 2, element=Element.T10), ()),
    ],
    ids=["2 2 2", "distorted", "flat", "plate", "bar", "graded", "quarter bar", "cylinder", "eighth", "tube", "ring"],
)
def test_tetrahedra_beside_each_other_are_taken(mesh, supports):
    Scene(mesh, Geometry.SOLID, RUBBER, supports)


@pytest.mark.parametrize("rule", [Quadrature.GAUSS2, Quadrature.GAUSS3])
def test_a_slab_of_hexahedra_with_volume_changes_on_constants_is_refused(rule):
    """Tractions that are linear on each face move one of any width 15 times as far as they should, and more."""
    slab = brick(3.0, 1.0, 3.0, 3, 1, 3, element=Element.H20)
    with pytest.raises(SceneError, match=f"{rule.name} with P0.*motions without strain"):
        Scene(slab, Geometry.SOLID, RUBBER, CLAMPED, quadrature=rule, volume=VolumeChange.P0)
    few = brick(1.0, 1.0, 1.0, 2, 2, 2, element=Element.H20)
    with pytest.raises(SceneError, match=r"few elements beside each other are projected on constants, as element 0"):
        Scene(few, Geometry.SOLID, RUBBER, CLAMPED, volume=VolumeChange.P0)
    cube = brick(1.0, 1.0, 1.0, 3, 3, 3, element=Element.H20)
    Scene(cube, Geometry.SOLID, RUBBER, CLAMPED, quadrature=rule, volume=VolumeChange.P0)


def test_on_a_meridian_parts_of_conformal_motions_are_weighted_by_the_volumes_of_rings():
    """Of triangles of different sizes and radii, with those that share a corner: sums over them one by one."""
    mesh = block(1.0, 1.0, 4, 3, element=Element.T6)
    mesh = Mesh(mesh.nodes**2 + 0.1 * mesh.nodes, mesh.elements, mesh.boundaries)
    corners = mesh.elements[:, :3]
    x = mesh.nodes[corners]
    a, b = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    volume, middle = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * x[:, :, 0].mean(axis=1), x[:, :, 1].mean(axis=1)
    inside = volume / 12 * ((x[:, :, 1] - middle[:, None]) ** 2).sum(axis=1)
    found = kept_by_means(mesh, Geometry.AXISYMMETRIC)
    for own, kept in zip(corners, found, strict=True):
        beside = np.isin(corners, own).any(axis=1)
        V, c = volume[beside], middle[beside]
        between = V @ (c - V @ c / V.sum()) ** 2
        assert kept == pytest.approx(between / (between + inside[beside].sum()))
    assert np.ptp(found) > 0.01
