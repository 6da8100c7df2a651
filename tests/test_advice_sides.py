"""What a march that ends advises where a side comes to lie on a tool that does not have it among its candidates."""

from dataclasses import replace

import pytest

from bipot.control.control import Control
from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import march
from bipot.meshes.elements import Element
from bipot.meshes.sections import cylinder
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.tool import FlatTool

METAL = VonMises(Elasticity(70_000.0, 0.33), Linear(100.0, 200.0))


def pressed(element, *candidates):
    """How the march of a rough cylinder ends that is upset by half by a tool with these ``candidates``."""
    scene = Scene(
        mesh=cylinder(5.0, 5.0, 4, 4, element=element),
        geometry=Geometry.AXISYMMETRIC,
        material=METAL,
        supports=(Support("axis", 0), Symmetry("base", 1)),
        tools=(FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -2.5), candidates, 0.3),),
    )
    try:
        list(march(scene, Schedule(10, first=0.005), Control(Newton(), (), cuts=1)))
    except IncrementFailed as failed:
        return str(failed)
    return ""


def test_a_side_that_comes_to_lie_on_a_tool_is_to_be_its_candidate():
    """It was said to remesh alone."""
    assert pressed(Element.Q4, "top", "side") == ""
    words = pressed(Element.Q4, "top")
    assert "emesh there" in words
    assert words.endswith(". Or make 'side' a candidate of tools[0], on which it comes to lie.")


def test_where_a_side_is_a_candidate_already_nothing_is_said_of_it():
    words = pressed(Element.Q8, "top", "side")
    assert "emesh there" in words
    assert "candidate" not in words


def test_what_is_beside_a_tool_on_the_same_face_is_not_to_be_its_candidate():
    """The rest of the top beside a punch, which is level with it from the start."""
    mesh = cylinder(5.0, 5.0, 4, 4)
    top = mesh.boundary("top")
    below = top[(mesh.nodes[top, 0] < 2.6).all(axis=1)]
    scene = Scene(
        mesh=replace(mesh, boundaries={**mesh.boundaries, "below": below}),
        geometry=Geometry.AXISYMMETRIC,
        material=METAL,
        supports=(Support("axis", 0), Symmetry("base", 1)),
        tools=(FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -4.0), ("below",), 0.3),),
    )
    with pytest.raises(IncrementFailed) as failed:
        list(march(scene, Schedule(10, first=0.005), Control(Newton(), (), cuts=1)))
    assert "candidate" not in str(failed.value)
