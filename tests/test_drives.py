"""Coordinates of driven tools by themselves: their levers, and what of a force or moment acts on the modelled part."""

import numpy as np
import pytest

from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.drives import Drives
from bipot.scene.symmetry import Mirror
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.surfaces import Plane
from bipot.tools.tool import ShapedTool


def roll(radius):
    surface = Circle((0.0, 1.0 + radius), radius)
    return ShapedTool(surface, (0.0, 0.0), ("top",), 0.1, turn=Turn(0.0, (0.0, 1.0 + radius), driven_by=Moment(12.0)))


@pytest.mark.parametrize("radius", [7.0, 0.5])
def test_the_lever_is_the_distance_from_centre_to_surface_or_the_body_where_that_is_larger(radius):
    mesh = block(2.0, 1.0, 2, 1)
    drives = Drives.of((roll(radius),), (), mesh)
    lever = max(radius, mesh.size)
    np.testing.assert_allclose(drives.spins, [1 / lever])
    np.testing.assert_allclose(drives.at(1.0), [12.0 / lever])
    np.testing.assert_allclose(drives.poses(np.array([0.2]), 1), [[0.0, 0.0, 0.2 / lever]])


@pytest.mark.parametrize(("normal", "part"), [((1.0, 0.0, 0.0), 0.5), ((0.0, 0.0, 1.0), 1.0)])
def test_a_plane_that_cuts_a_tool_leaves_half_of_its_force_and_moment(normal, part):
    """A platen that a force presses along the third axis and a moment turns about the first."""
    platen = ShapedTool(
        Plane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)),
        (0.0, 0.0, 0.0),
        ("top",),
        0.1,
        driven_by=Force((0.0, 0.0, -3.0)),
        turn=Turn(0.0, (0.0, 0.0, 1.0), axis=(1.0, 0.0, 0.0), driven_by=Moment(12.0)),
    )
    mesh = brick(1.0, 1.0, 1.0, 1, 1, 1)
    drives = Drives.of((platen,), (Mirror(normal, 0.0, 1e-9),), mesh)
    np.testing.assert_allclose(drives.at(1.0), [3.0 * part, 12.0 / mesh.size * part])
