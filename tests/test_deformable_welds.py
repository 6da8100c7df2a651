"""Welds of curved sides, which facets through nodes on one surface only seem to leave apart."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    DeformableTool,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    IncrementFailed,
    Newton,
    Prescribed,
    Pressure,
    Scene,
    Schedule,
    Support,
    Symmetry,
    block,
    brick,
    march,
    together,
)
from tests.deformable import flared, shifted
from tests.scenes import refused

NEWTON = Control(Newton(), ())
SOFT = Elastic(Elasticity(1.0, 0.3))


def around(mesh, radius):
    """A quarter of a ring from this radius on, of a block that is 1 high."""
    r, turn = mesh.nodes[:, 0] + radius, np.pi / 2 * mesh.nodes[:, 1]
    return replace(mesh, nodes=r[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1))


def moved(mesh, inner, outer, tools=()):
    """Work of a scene of quarters of rings, held outside, whose inside goes to a side."""
    supports = (*(Support(outer, axis) for axis in range(2)), Prescribed(inner, 0, 1e-3), Prescribed(inner, 1, -1e-3))
    *_, last = march(Scene(mesh, Geometry.PLANE_STRAIN, SOFT, supports, tools), Schedule(1), NEWTON)
    return last.energies.work


def rings(element, n, clearance=0.0):
    """Two quarters of rings about each other, n elements thick, 2 n and 3 n around."""
    inner = around(block(0.5 - clearance, 1.0, n, 2 * n, element=element), 0.5)
    return together({"in": inner, "out": around(block(0.5, 1.0, n, 3 * n, element=element), 1.0)})


SIDES = {"inner": (("in/right",), ("out/left",)), "outer": (("out/left",), ("in/right",))}


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("element", [Element.Q4, Element.T3, Element.Q8, Element.Q9, Element.T6])
def test_welded_rings_are_one_ring(element, side):
    """Of parabolas few points touched at rest, and the others slipped without friction: a quarter of this work.

    Of polygons none touched, and nothing was welded.
    """
    n = 2 if element.quadratic else 4
    one = moved(around(block(1.0, 1.0, 2 * n, 3 * n, element=element), 0.5), "left", "right")
    tool = DeformableTool(*SIDES[side], np.inf)
    assert moved(rings(element, n), "in/left", "out/right", (tool,)) == pytest.approx(one, rel=5e-3)


@pytest.mark.parametrize("element", [Element.Q8, Element.T6])
def test_a_fine_side_is_welded_to_one_of_a_single_element(element):
    """Straights of one element lean away from those of four: they were cut off, and 12 % of the work was missing."""
    low, up = (block(0.5, 1.0, 1, n, element=element) for n in (1, 4))
    mesh = together({"in": around(low, 0.5), "out": around(up, 1.0)})
    work = [moved(mesh, "in/left", "out/right", (DeformableTool(*of, np.inf),)) for of in SIDES.values()]
    assert work[0] == pytest.approx(work[1], rel=0.01)


@pytest.mark.parametrize("element", [Element.Q4, Element.Q8])
def test_a_clearance_is_none_that_only_seems_to_be(element):
    """Of a hundredth of the radius, which is more than polygons or parabolas of these meshes miss of the circle."""
    tool = DeformableTool(*SIDES["outer"], np.inf)
    assert moved(rings(element, 4, 0.01), "in/left", "out/right", (tool,)) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("side", SIDES)
def test_sides_in_each_other_are_welded_only_where_they_seem_to_be(side):
    """Polygons of these meshes miss the circle by 0.5 and 0.2 per cent of its radius."""

    def scene(overlap, mu):
        supports, tools = (Support("out/right", 0), Support("out/right", 1)), (DeformableTool(*SIDES[side], mu),)
        return Scene(rings(Element.Q4, 4, -overlap), Geometry.PLANE_STRAIN, SOFT, supports, tools)

    scene(0.004, np.inf)
    refused(lambda: scene(0.004, 0.3), r"off the tool's surface, not 0\.002[0-9]* in it")
    refused(lambda: scene(0.01, np.inf), r"off the tool's surface, not 0\.008[0-9]* in it")


@pytest.mark.parametrize(("lower", "upper"), [(2, 3), (3, 2)])
@pytest.mark.parametrize(("element", "most"), [(Element.H8, 0.2), (Element.T4, 1.0)])
def test_a_uniform_stress_passes_a_weld_on_a_paraboloid(element, most, lower, upper):
    """Of two blocks without lateral strain, on meshes that do not match; errors are of order two in its slopes.

    Those of quadratic elements are in tests/test_deformable_space_quadratic.py.
    """
    low, up = (brick(1.0, 1.0, 1.0, n, n, 1, element=element) for n in (lower, upper))
    mesh, height = together({"low": low, "up": shifted(up, 0.0, 0.0, 1.0)}), 0.1
    x = mesh.nodes.copy()
    x[:, 2] -= height * (x[:, 0] ** 2 + x[:, 1] ** 2) * np.clip(1 - np.abs(x[:, 2] - 1), 0, 1)
    mesh = replace(mesh, nodes=x)
    walls = (Symmetry(f"{part}/{side}", axis) for part in ("low", "up") for axis, side in enumerate(("left", "front")))
    supports = (Support("low/base", 2), *walls, Prescribed("up/top", 2, -0.01))
    tools = (DeformableTool(("low/top",), ("up/base",), np.inf),)
    scene = Scene(mesh, Geometry.SOLID, Elastic(Elasticity(210e3, 0.0)), supports, tools)
    *_, last = march(scene, Schedule(1), NEWTON)
    stress = last.state.stress
    assert np.abs(stress - stress.mean(axis=(0, 1))).max() < most * height**2 * np.abs(stress).max()


def bonded(inner, outer, stress):
    """Radial displacement at r = 1 of rings from r = 0.5 to 1 and to 1.5 that a ``stress`` outside pulls, plane strain.

    By Lame: in each sigma_r = A - B/r^2 and u = ((1 - 2 nu) A r + B/r) (1 + nu)/E, with u and sigma_r equal at r = 1.
    """

    def pulled(ring, r):
        """Rows of u and sigma_r at r by A and B."""
        young, nu = ring.elasticity.young, ring.elasticity.poisson
        return np.array([[(1 - 2 * nu) * r, 1 / r]]) * (1 + nu) / young, np.array([[1.0, -1 / r**2]])

    nothing = np.zeros((1, 2))
    rows = np.vstack(
        [
            np.hstack([pulled(inner, 0.5)[1], nothing]),
            np.hstack([pulled(inner, 1.0)[0], -pulled(outer, 1.0)[0]]),
            np.hstack([pulled(inner, 1.0)[1], -pulled(outer, 1.0)[1]]),
            np.hstack([nothing, pulled(outer, 1.5)[1]]),
        ]
    )
    return float((pulled(inner, 1.0)[0] @ np.linalg.solve(rows, [0.0, 0.0, 0.0, stress])[:2])[0])


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("element", [Element.Q4, Element.T3, Element.Q8, Element.T6])
def test_welded_rings_of_two_materials_are_pulled_as_lame_has_it(element, side):
    """No contact without a weld would bear the tension between them."""
    n, stress, stiff = 2 if element.quadratic else 6, 1e-5, Elastic(Elasticity(3.0, 0.2))
    mesh = rings(element, n)
    planes = (1, "base"), (0, "top")
    supports = tuple(Symmetry(f"{part}/{end}", axis) for part in ("in", "out") for axis, end in planes)
    scene = Scene(
        mesh=mesh,
        geometry=Geometry.PLANE_STRAIN,
        material=SOFT,
        supports=supports,
        tools=(DeformableTool(*SIDES[side], np.inf),),
        regions={"out": stiff},
        loads=(Pressure("out/right", -stress),),
    )
    *_, last = march(scene, Schedule(1), NEWTON)
    assert (last.state.forces[:, 0] < 0).all()
    for name in ("in/right", "out/left"):
        nodes = mesh.boundary_nodes(name)
        radial = np.vecdot(mesh.nodes[nodes], last.displacement[nodes])
        np.testing.assert_allclose(radial, bonded(SOFT, stiff, stress), rtol=1e-3 if element.quadratic else 1e-2)


@pytest.mark.parametrize("dimension", [2, 3])
def test_walls_beyond_a_crease_take_nothing_from_a_weld(dimension):
    """Before the floor's points there was a gap, of the wall's foot, and in space nothing was welded."""
    walls = ("left", "right") if dimension == 2 else ("left", "right", "front", "back")
    forces = []
    for surface in (("up/base",), ("up/base", *(f"up/{wall}" for wall in walls))):
        *_, last = march(flared(75, surface, dimension, press=-0.01, mu=np.inf), Schedule(1), NEWTON)
        forces.append(last.tool_force(0)[-1])
    assert abs(forces[0]) > 2000
    assert forces[1] == pytest.approx(forces[0], rel=1e-3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_support_moves_what_is_welded_to_a_part_that_follows(dimension):
    """Candidates on the moved part were refused: "a support moves node 0 against the tool that it is welded to"."""
    block_of = (lambda w, h: block(w, h, 3, 3)) if dimension == 2 else (lambda w, h: brick(w, 1.0, h, 2, 2, 2))
    normal = dimension - 1
    parts = {"up": shifted(block_of(1.0, 0.5), *np.eye(dimension)[normal]), "low": block_of(1.0, 1.0)}
    held = tuple(Support("low/base", axis) for axis in range(dimension))
    moved = (Prescribed("up/base", 0, 0.001), Prescribed("up/base", normal, 0.002))
    geometry = Geometry.PLANE_STRAIN if dimension == 2 else Geometry.SOLID
    works = []
    for sides in ((("up/base",), ("low/top",)), (("low/top",), ("up/base",))):
        scene = Scene(together(parts), geometry, SOFT, (*held, *moved), (DeformableTool(*sides, np.inf),))
        *_, last = march(scene, Schedule(1), NEWTON)
        np.testing.assert_allclose(last.state.du[scene.mesh.boundary_nodes("low/top"), normal], 0.002, rtol=1e-6)
        works.append(last.energies.work)
    np.testing.assert_allclose(*works, rtol=1e-9)


@pytest.mark.parametrize("way", [(0.001, 0.0), (0.0, 0.001)], ids=["along", "off"])
@pytest.mark.parametrize("side", [("up/base",), ("low/top",)], ids=lambda side: side[0])
def test_supports_of_both_sides_may_not_tear_a_weld(side, way):
    parts = {"up": shifted(block(1.0, 0.5, 3, 3), 0.0, 1.0), "low": block(1.0, 1.0, 3, 3)}
    held = (Support(of, axis) for of in ("low/base", "low/top") for axis in range(2))
    moved = (Prescribed("up/base", axis, by) for axis, by in enumerate(way))
    tool = DeformableTool(side, tuple({"up/base", "low/top"} - {*side}), np.inf)
    scene = Scene(together(parts), Geometry.PLANE_STRAIN, SOFT, (*held, *moved), (tool,))
    with pytest.raises(IncrementFailed, match=r"a support moves node \d+ against the tool that it is welded to"):
        list(march(scene, Schedule(1), NEWTON))
