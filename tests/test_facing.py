"""Tools that face the wrong way are refused by what is wrong; a mandrel may be drawn on one side of its axis."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Circle,
    Control,
    Elasticity,
    FlatTool,
    Geometry,
    Linear,
    Newton,
    Profile,
    Revolved,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    VonMises,
    block,
    brick,
    cylinder,
    flat_punch,
    march,
    ring,
)
from bipot.errors import SceneError

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 300.0))
DOWN = (0.0, -1.0)
PUNCH = flat_punch((1.0, 1.0), 1.0, 3.0, 0.2)
UNEVEN = Profile(((1.5, 4.0), (1.5, 1.0), (0.5, 1.0), (0.5, 4.0)), fillets=(0.3, 0.1))


def pressed(tool):
    """A block, held at its base."""
    held = tuple(Support("base", d) for d in range(2))
    return Scene(block(2.0, 1.0, 8, 4), Geometry.PLANE_STRAIN, STEEL, held, (tool,))


@pytest.mark.parametrize("line", [PUNCH, UNEVEN])
def test_a_line_with_the_tool_on_its_wrong_side_is_told_to_be_turned_round(line):
    right = ShapedTool(line, (0.0, -0.1), ("top",), 0.1)
    wrong = replace(right, surface=line.followed_back())
    x = np.random.default_rng(0).uniform(-1.0, 3.0, (50, 2))
    np.testing.assert_allclose(wrong.surface.distance(x).gap, -line.distance(x).gap, atol=1e-14)
    assert pressed(right)
    said = r"tools\[0\].surface = .*: must be off the body at rest: all of the body is inside it; with its points in"
    with pytest.raises(SceneError, match=said):
        pressed(wrong)


def test_a_line_that_neither_way_is_off_the_body_is_not_told_to_be_turned_round():
    with pytest.raises(SceneError, match=r"must be off the body at rest: a part of it .* feels it; let its way begin"):
        pressed(ShapedTool(flat_punch((1.0, 0.5), 1.0, 3.0, 0.2), (0.0, -0.1), ("top",), 0.1))


def test_a_tool_beyond_a_plane_of_symmetry_is_said_to_meet_a_mirror_image():
    """It is clear of what is modelled, below it, and the whole body goes on there."""
    below = ShapedTool(Circle((0.0, -0.7), 0.6), (0.0, 0.1), ("top",), 0.1)
    whole = pressed(below)
    with pytest.raises(SceneError, match=r"must be off the body at rest and its mirror images: a part of it is"):
        replace(whole, supports=(Symmetry("base", 1), Support("left", 0)))


def test_a_plane_that_looks_away_from_the_body_is_refused():
    said = r"tools\[0\].normal = \(0.0, 1.0\): must point from the tool into the body: all of the body is inside it"
    with pytest.raises(SceneError, match=said):
        pressed(FlatTool((0.0, 1.0), (0.0, 1.0), (0.0, -0.1), ("top",), 0.1))
    held = tuple(Support("base", d) for d in range(3))
    space = Scene(brick(1.0, 1.0, 1.0, 1, 1, 1), Geometry.SOLID, STEEL, held)
    with pytest.raises(SceneError, match=r"tools\[0\].normal = \(0.0, 0.0, 1.0\): must point"):
        replace(space, tools=(FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, -0.1), ("top",), 0.1),))
    line = Profile(((-0.5, 0.0), (0.5, 0.0)))
    with pytest.raises(SceneError, match="with its points in the other order"):
        replace(
            space,
            tools=(ShapedTool(Revolved(line, (0.5, 0.5, 1.0), (0.0, 0.0, 1.0)), (0.0, 0.0, -0.1), ("top",), 0.1),),
        )


def test_a_hollow_that_has_all_the_body_outside_is_refused():
    with pytest.raises(SceneError, match=r"must be off the body at rest: all of the body is inside it$"):
        pressed(ShapedTool(Circle((1.0, 2.1), 1.0, concave=True), (0.0, -0.1), ("top",), 0.1))


def test_a_plane_that_part_of_the_body_is_behind_is_one():
    """The head of a bolt rests on it, its shank is through the hole."""
    assert pressed(FlatTool((0.0, 0.5), (0.0, 1.0), (0.0, 0.1), ("right",), 0.1))


def expanded(line):
    tube = ring(10.0, 12.0, 10.0, 3, 8)
    tool = ShapedTool(line, (0.0, -12.0), ("bore",), 0.05)
    return Scene(tube, Geometry.AXISYMMETRIC, STEEL, (Support("base", 1),), (tool,))


def test_a_mandrel_is_one_whether_its_line_is_on_both_sides_of_the_axis_or_on_one():
    one = ((12.0, 60.0), (12.0, 30.0), (9.5, 16.0), (9.5, -30.0))
    both = (*[(-r, z) for r, z in one[::-1]], *one)
    lines = Profile(one, 4.0), Profile(both, (4.0, 4.0, 0.0, 0.0, 4.0, 4.0))
    runs = [list(march(expanded(line), Schedule(10), Control(Newton()))) for line in lines]
    assert len(runs[0]) == len(runs[1])
    for a, b in zip(*runs, strict=True):
        np.testing.assert_allclose(a.tool_forces, b.tool_forces, rtol=1e-9, atol=1e-9)
    assert abs(runs[0][-1].tool_forces[0, 1]) > 100.0


def test_a_mandrel_that_is_too_wide_for_the_bore_is_refused():
    with pytest.raises(SceneError, match=r"tools\[0\].surface = .*must be off the body"):
        expanded(Profile(((12.0, 60.0), (12.0, 12.0), (9.5, -2.0), (9.5, -30.0)), 4.0))


def test_a_pin_in_a_solid_body_is_refused_on_one_side_of_the_axis_as_on_both():
    solid = cylinder(1.0, 1.0, 4, 4)
    for line in (((0.2, 5.0), (0.2, 0.5), (0.0, 0.5)), ((0.2, 5.0), (0.2, 0.5), (-0.2, 0.5), (-0.2, 5.0))):
        pin = ShapedTool(Profile(line), (0.0, -0.1), ("top",), 0.1)
        with pytest.raises(SceneError, match=r"tools\[0\].surface = .*must be off the body"):
            Scene(solid, Geometry.AXISYMMETRIC, STEEL, (Support("axis", 0), Support("base", 1)), (pin,))
