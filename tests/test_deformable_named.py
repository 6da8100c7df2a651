"""Deformable tools of other boundaries than those that meet: what the refusal of the scene says."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.together import together
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.deformable import DeformableTool

METAL = VonMises(Elasticity(1000.0, 0.3), Linear(10.0, 20.0))
HELD = tuple(Support("low/base", axis) for axis in (0, 1))


def test_parts_that_meet_at_other_boundaries_than_the_tools_are_to_be_named_in_one():
    """It was said to merge them, or to open a crack between them."""
    low, up = block(4.0, 2.0, 4, 2), block(4.0, 2.0, 4, 2)
    mesh = together({"low": low, "up": replace(up, nodes=up.nodes + np.array([0.0, 2.0]))})
    named = "must be different places .* let the boundaries that meet there be surface and candidates of a deformable"
    with pytest.raises(SceneError, match=named):
        Scene(mesh, Geometry.PLANE_STRAIN, METAL, HELD, (DeformableTool(("up/top",), ("low/top",), inf),))


def test_two_sides_of_a_crack_in_one_part_are_to_be_merged_or_opened():
    nodes = np.array([(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (2, 2), (2, 1)])
    elements = np.array([(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 9, 8, 7)])
    mesh = Mesh(nodes, elements, {"low/base": np.array([(0, 1), (1, 2)])})
    with pytest.raises(SceneError, match=r"nodes \[5, 9\] at one place.* merge them, or open a crack"):
        Scene(mesh, Geometry.PLANE_STRAIN, METAL, HELD)
