"""Scenes refuse bad input when they are made, naming field, value and range."""

import pickle

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import cylinder
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mu": -0.1}, "mu = -0.1: must be >= 0"),
        ({"mu": float("nan")}, "mu = nan"),
        ({"reduction": 0.0}, "reduction = 0.0: must be in"),
        ({"reduction": 1.0}, "reduction = 1.0"),
        ({"height": -10.0}, "height = -10.0: must be finite and > 0"),
        ({"diameter": 0.0}, "diameter = 0.0"),
        ({"height": float("inf")}, "height = inf"),
        ({"young": -1.0}, "young = -1.0"),
        ({"young": float("nan")}, "young = nan"),
        ({"poisson": 0.5}, "poisson = 0.5"),
        ({"poisson": -1.0}, "poisson = -1.0"),
        ({"elements": 0}, "elements = 0: must be >= 1"),
    ],
)
def test_upsetting_refuses(options, words):
    with pytest.raises(SceneError, match=words):
        upsetting(**({"mu": 0.1} | options))


def tool(**changes):
    given = {"point": (0.0, 1.0), "normal": (0.0, -1.0), "travel": (0.0, -0.1), "candidates": ("top",), "mu": 0.1}
    return FlatTool(**(given | changes))


def scene(**changes):
    given = {
        "mesh": cylinder(1.0, 1.0, 1, 1, element=Element.Q8),
        "geometry": Geometry.AXISYMMETRIC,
        "material": VonMises(Elasticity(1.0, 0.3), Perfect(1.0)),
        "supports": (Support("axis", 0), Support("base", 1)),
        "tools": (tool(),),
    }
    return Scene(**(given | changes))


def reversed_mesh():
    mesh = cylinder(1.0, 1.0, 1, 1, element=Element.Q8)
    return Mesh(mesh.nodes, mesh.elements[:, [0, 3, 2, 1, 7, 6, 5, 4]], mesh.boundaries)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: tool(normal=(0.0, -2.0)), "tool.normal"),
        (lambda: tool(travel=(0.0, float("nan"))), "tool.travel"),
        (lambda: tool(candidates=()), "tool.candidates"),
        (lambda: Support("base", 3), "support.direction = 3: must be 0, 1 or, in space, 2"),
        (
            lambda: scene(tools=(tool(candidates=("lid",)),)),
            r"tools\[0\].candidates = 'lid': must be one of \['axis', 'base'",
        ),
        (lambda: scene(supports=(Support("floor", 1),)), r"supports\[0\].boundary = 'floor'"),
        (lambda: scene(mesh=reversed_mesh()), "Jacobian determinant .* is not positive: number nodes anticlockwise"),
    ],
)
def test_scene_refuses(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_held_unknowns_are_those_of_the_supports():
    mesh = cylinder(1.0, 1.0, 2, 2, element=Element.Q8)
    made = scene(mesh=mesh, supports=(Support("base", 1), Support("axis", 0)))
    expected = np.union1d(2 * mesh.boundary_nodes("base") + 1, 2 * mesh.boundary_nodes("axis"))
    np.testing.assert_array_equal(made.holding.numbers, expected)


def test_a_scene_without_supports_holds_nothing():
    assert scene(supports=(), geometry=Geometry.PLANE_STRAIN).holding.numbers.size == 0


def test_tool_offset_follows_its_travel():
    assert tool().face.offset(tool().moved(0.0, 0.0)) == pytest.approx(-1.0)
    assert tool().face.offset(tool().moved(0.0, 1.0)) == pytest.approx(-0.9)


def test_scenes_are_equal_where_all_their_parts_are():
    """As those that come back from another process, or keys of what was solved before."""
    one, other = upsetting(mu=0.1, elements=2), upsetting(mu=0.2, elements=2)
    back = pickle.loads(pickle.dumps(one))
    assert back == one
    assert hash(back) == hash(one)
    assert one != other
    assert len({one, back, other}) == 2
