"""Where a deformable tool ends just beyond a node of the candidates: its end is rounded, and answers do not jump."""

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
    Linear,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    Support,
    Symmetry,
    VolumeChange,
    VonMises,
    block,
    brick,
    march,
    together,
)
from bipot.tools.facing import FILLET, ROUND, facing, rounding
from studies.accuracy.die import scene_of
from studies.independent.facing import farther
from tests.deformable import ELASTIC, flared, shifted
from tests.deformable import pressed as pressed_by_wider

NEWTON = Control(Newton(), ())


def pressed(coarse=10, fine=3, at=0.5, mu=0.3, element=Element.Q4):
    """A block of one that presses a longer one, whose nodes may be those of its corners."""
    low, up = block(3.0, 1.0, coarse, 2, element=element), shifted(block(1.0, 0.5, fine, 2, element=element), at, 1.0)
    supports = (Support("low/base", 0), Support("low/base", 1), Support("up/top", 0), Prescribed("up/top", 1, -0.002))
    tools = (DeformableTool(("up/base",), ("low/top",), mu),)
    return Scene(together({"low": low, "up": up}), Geometry.PLANE_STRAIN, ELASTIC, supports, tools)


@pytest.mark.parametrize(
    ("coarse", "fine", "at", "mu", "element"), [(10, 3, 0.5, 0.3, Element.Q4), (9, 2, 1.0, 0.3, Element.Q4)]
)
def test_corners_on_nodes_are_pressed_to_the_end(coarse, fine, at, mu, element):
    """With the point beyond it the answer ended before the corner, and without it behind: there was none."""
    scene = pressed(coarse, fine, at, mu, element)
    *_, five = march(scene, Schedule(5), NEWTON)
    *_, twelve = march(scene, Schedule(12), NEWTON)
    np.testing.assert_allclose(five.tool_force(0)[1], twelve.tool_force(0)[1], rtol=1e-2)


def test_what_barely_faces_the_end_bears_nothing_and_forces_go_on_from_there():
    """By how far, over an edge, the block is beyond a node of the other one, of which nothing else depends."""
    low = block(3.0, 1.0, 3, 2)
    found = []
    for by in (0.0, 1e-9, 1e-4, 0.01, 0.05, 0.1, 0.11):
        up = shifted(block(1.0 + 2 * by, 0.5, 2, 1), 1.0 - by, 1.0)
        supports = Support("low/base", 0), Support("low/base", 1), Support("up/top", 0), Prescribed("up/top", 1, -0.002)
        tools = (DeformableTool(("up/base",), ("low/top",), 0.2),)
        scene = Scene(together({"low": low, "up": up}), Geometry.PLANE_STRAIN, ELASTIC, supports, tools)
        *_, last = march(scene, Schedule(1), NEWTON)
        candidates, r = last.solved.iterate.increment.system.candidates, last.state.forces[:, 0]
        (points,) = candidates.points
        assert points.faced is not None
        found.append((last.tool_force(0)[1], r[points.faced.part < 0.5e-2].max(initial=0.0) / r.max()))
    forces, beyond = np.array(found).T
    np.testing.assert_allclose(beyond[:4], 0.0)
    np.testing.assert_allclose(np.diff(forces[:4]) / forces[0], 0.0, atol=0.02)
    assert abs(np.diff(forces) / forces[0]).max() < 0.1


def test_a_thin_pin_before_the_middle_of_a_face_is_no_end():
    """It faces a ten-thousandth of the areas of all points, and sank in by what ends are rounded, without a force."""
    low, up = brick(1.0, 1.0, 1.0, 2, 2, 1), shifted(brick(0.01, 0.01, 0.01, 1, 1, 1), 0.25, 0.25, 1.0)
    supports = (
        *(Support("low/base", axis) for axis in range(3)),
        *(Support("up/top", axis) for axis in range(2)),
        Prescribed("up/top", 2, -1e-4),
    )
    forces = []
    for surface, candidates in (("up/base", "low/top"), ("low/top", "up/base")):
        tool = DeformableTool((surface,), (candidates,), 0.2)
        scene = Scene(together({"low": low, "up": up}), Geometry.SOLID, ELASTIC, supports, (tool,))
        *_, last = march(scene, Schedule(1), NEWTON)
        forces.append(abs(last.tool_force(0)[2]))
    np.testing.assert_allclose(forces[0], forces[1], rtol=0.1)


@pytest.mark.parametrize("space", [False, True])
def test_the_end_is_rounded_by_how_far_it_reaches(space):
    """By s along an edge of h = 1/2, over which psi^2 over psi is 2/3 s/h; in space 2/3 of that, along another."""

    def made(by):
        if space:
            low, up = brick(1.0, 1.0, 1.0, 2, 2, 1), shifted(brick(1.0, 1.0, 1.0, 1, 1, 1), 0.5 - by, 0.0, 1.0)
        else:
            low, up = block(1.0, 1.0, 2, 1), shifted(block(1.0, 1.0, 1, 1), 0.5 - by, 1.0)
        mesh = together({"low": low, "up": up})
        sides = DeformableTool(("up/base",), ("low/top",), 0.0).of(mesh).sides
        found = facing(mesh.nodes, sides, ring=False)
        off = rounding(mesh.nodes, sides, found)
        np.testing.assert_allclose(
            farther(mesh.nodes[sides.flats], sides.point, found.reach, found.squarely), off, rtol=1e-12
        )
        return mesh.nodes[sides.node], found.reach, off

    for by in (1e-4, 0.02, 0.04, 0.06):
        x, reach, off = made(by)
        ends = x[:, 0] == 0.0
        expected = (2 / 3) ** (1 + space) * by / 0.5
        np.testing.assert_allclose(reach[ends], expected, rtol=1e-6)
        h = 0.5 * np.sqrt(2.0) if space else 0.5
        np.testing.assert_allclose(off[ends], FILLET * h * max(1 - expected / ROUND, 0.0) ** 2, rtol=1e-6, atol=1e-15)
        np.testing.assert_allclose(off[~ends], 0.0)


def test_walls_beside_a_corner_are_not_faced_all_at_once():
    """Of a billet whose side comes to lie on a wider punch, with the candidates on either of them.

    The punch's points saw the side, at 84 degrees to them, as far off as its middle is: they did not feel the corner,
    which sank in, and the force was 17 % less.
    """
    scene = pressed_by_wider(press=0.6)
    swapped = DeformableTool(("billet/top", "billet/side"), ("punch/base",), 0.2)
    forces = []
    for of in (scene, replace(scene, tools=(swapped,))):
        *_, last = march(of, Schedule(4, first=0.02, settling=1, growth=4.0), NEWTON)
        forces.append(abs(last.tool_force(0)[1]))
    assert forces[1] == pytest.approx(forces[0], rel=2e-3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_what_is_faced_changes_continuously_as_a_wall_leans(dimension):
    """A wall that leans over a face, from a right angle to 79 degrees: the means, normals and parts of its points."""
    make, up_to = (block, (1.0,)) if dimension == 2 else (brick, (0.0, 1.0))
    counts = (2, 1) if dimension == 2 else (2, 2, 1)
    low, up = (make(*sizes, *counts) for sizes in ((2.0, *(dimension - 1) * [1.0]), dimension * [1.0]))
    found = []
    for lean in np.linspace(0.0, 0.2, 41):
        nodes = up.nodes.copy()
        nodes[:, 0] += lean * nodes[:, -1]
        mesh = together({"low": low, "up": shifted(replace(up, nodes=nodes), 0.2, *up_to)})
        sides = DeformableTool(("up/base", "up/right"), ("low/top",), 0.0).of(mesh).sides
        of = facing(mesh.nodes, sides, False)
        found.append(np.concatenate([of.weights @ mesh.nodes[:, -1], of.normal.ravel(), of.part]))
    steps = np.abs(np.diff(found, axis=0)).max(axis=1)
    assert 0 < steps.max() < 0.05


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(("dimension", "degrees"), [(2, 60), (2, 75), (2, 84), (3, 75), (3, 84)])
def test_walls_that_lean_away_bear_as_if_they_were_not_there(dimension, degrees, swapped):
    """They held means open: 17 % less force in the plane, and in space half of it."""
    sides = ("left", "right") if dimension == 2 else ("left", "right", "front", "back")
    assert _less(degrees, sides, dimension=dimension, swapped=swapped) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("swapped", [False, True])
def test_what_a_shallow_wall_takes_from_a_force_halves_with_the_elements(swapped):
    """Such a wall is faced over much of an element beside the edge."""
    coarse, fine = (_less(30, ("left", "right"), swapped=swapped, fine=fine) for fine in (1, 2))
    assert 0 < fine < 0.6 * coarse < 0.12


def _less(degrees, sides, **how):
    """How much less, over it, the force is where the sides of the block may touch."""
    forces = []
    for surface in (("up/base",), ("up/base", *(f"up/{side}" for side in sides))):
        *_, last = march(flared(degrees, surface, **how), Schedule(2), NEWTON)
        forces.append(abs(last.tool_force(0)[-1]))
    return 1 - forces[1] / forces[0]


def test_a_side_that_turns_towards_a_die_does_not_bear_at_once_what_its_corner_does():
    """Its foot is faced from 84 degrees on, near the corner; without an end configurations pushed each other off."""
    steps = list(march(scene_of(0.3, 5), Schedule(accuracy=1e-3), NEWTON))
    assert all(step.cuts == 0 for step in steps)
    assert sum(step.passes for step in steps) < 200


@pytest.mark.slow
@pytest.mark.parametrize(("element", "geometry"), [(Element.Q8, "plane"), (Element.T6, "plane"), (Element.Q8, "ring")])
def test_the_edge_of_a_die_goes_past_a_node_of_what_it_dents(element, geometry):
    """Its end sank in by more than it was rounded: as the node passed it the force there ended at once."""
    low = block(5.0, 5.0, 4, 4, element=element)
    die = shifted(block(3.3, 4.0, 5, 4, element=element), 0.0, 5.0)
    plane = geometry == "plane"
    middle = Symmetry if plane else Support
    supports = (
        *(middle(f"{part}/left", 0) for part in ("low", "die")),
        Symmetry("low/base", 1),
        Support("die/top", 0),
        Prescribed("die/top", 1, -1.0),
    )
    soft = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 300.0))
    scene = Scene(
        together({"low": low, "die": die}),
        Geometry.PLANE_STRAIN if plane else Geometry.AXISYMMETRIC,
        soft,
        supports,
        (DeformableTool(("die/base",), ("low/top", "low/right"), 0.0),),
        regions={"die": Elastic(Elasticity(30e3, 0.3))},
    )
    *_, last = march(scene, Schedule(accuracy=1e-2), NEWTON)
    assert last.state.tau == 1.0


@pytest.mark.slow
def test_an_elastic_die_that_is_narrower_dents_a_cube_in_quadratic_elements():
    """The top of the cube, in touch with the die, was taken for deep inside of the side that leans beside it."""
    low = brick(5.0, 5.0, 5.0, 2, 2, 2, element=Element.H20)
    die = brick(4.0, 4.0, 4.0, 2, 2, 2, element=Element.H20)
    die = replace(die, nodes=die.nodes + np.array([0.0, 0.0, 5.0]))
    supports = (
        *(Symmetry(f"{part}/{side}", axis) for part in ("low", "die") for axis, side in enumerate(("left", "front"))),
        Symmetry("low/base", 2),
        *(Support("die/top", axis) for axis in range(2)),
        Prescribed("die/top", 2, -0.5),
    )
    scene = Scene(
        together({"low": low, "die": die}),
        Geometry.SOLID,
        VonMises(Elasticity(210e3, 0.3), Linear(300.0, 300.0)),
        supports,
        (DeformableTool(("die/base",), ("low/top", "low/right", "low/back"), 0.1),),
        regions={"die": Elastic(Elasticity(30e3, 0.3))},
        volume=VolumeChange.AS_IS,
    )
    *_, last = march(scene, Schedule(accuracy=1e-3), NEWTON)
    assert last.state.tau == 1.0
