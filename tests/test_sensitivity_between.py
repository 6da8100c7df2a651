"""Slopes of bodies of several parts, whose contact is posed in what sides face in the end, beside differences."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    DeformableTool,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Mesh,
    Prescribed,
    Pressure,
    Scene,
    Schedule,
    Support,
    block,
    brick,
    march,
    sensitivities,
    together,
)
from tests.deformable import ELASTIC, pressed, shifted
from tests.test_sensitivity import EXACT, agree, fields, metal


def punched(mu=0.2, strength=600.0, width=4.0, depth=0.4, shift=0.3, element=Element.Q4):
    """A block on a wider one, whose nodes do not match, off the middle of it."""
    low, up = block(10.0, 4.0, 7, 2).to(element), shifted(block(width, 3.0, 4, 2).to(element), 3.0 + shift, 4.0)
    supports = *(Support("low/base", k) for k in range(2)), Support("up/top", 0), Prescribed("up/top", 1, -depth)
    tool = DeformableTool(("low/top",), ("up/base",), mu)
    return Scene(together({"low": low, "up": up}), Geometry.PLANE_STRAIN, metal(strength), supports, (tool,))


def quadratic(mu=0.2, width=4.0):
    return punched(mu, width=width, element=Element.Q8)


def ring(mu=0.2, press=0.5):
    """A billet whose side may fold onto the punch, which yields, too."""
    scene = pressed(mu, press=press)
    return replace(scene, material=metal(), regions={})


def laid(mu=0.4, pressure=40.0, push=10.0):
    """A block that nothing but friction and loads holds."""
    low, up = block(6.0, 2.0, 6, 2), shifted(block(3.0, 2.0, 4, 2), 1.4, 2.0)
    loads = Pressure("up/top", pressure), Pressure("up/left", push)
    tool = DeformableTool(("low/top",), ("up/base",), mu)
    supports = tuple(Support("low/base", k) for k in range(2))
    return Scene(together({"low": low, "up": up}), Geometry.PLANE_STRAIN, metal(), supports, (tool,), loads=loads)


def bricks(mu=0.2, width=2.0, depth=0.1):
    """Two bricks, the upper one turned about the way on which it is pressed."""
    low, up = brick(4.0, 4.0, 2.0, 3, 3, 1), brick(width, 2.0, 2.0, 2, 2, 1)
    c, s = np.cos(0.2), np.sin(0.2)
    nodes = (up.nodes - [1.0, 1.0, 0.0]) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + [2.1, 1.9, 2.0]
    mesh = together({"low": low, "up": Mesh(nodes, up.elements, up.boundaries)})
    held = *(Support("low/base", k) for k in range(3)), *(Support("up/top", k) for k in range(2))
    supports, tool = (*held, Prescribed("up/top", 2, -depth)), DeformableTool(("low/top",), ("up/base",), mu)
    return Scene(mesh, Geometry.SOLID, metal(), supports, (tool,))


def slow(*of):
    return pytest.param(*of, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("scene_of", "at"),
    [
        (punched, {"mu": 0.2, "shift": 0.3}),
        slow(punched, {"strength": 600.0, "depth": 0.4, "width": 4.0}),
        slow(quadratic, {"mu": 0.2, "width": 4.0}),
        slow(ring, {"mu": 0.2, "press": 0.5}),
        (laid, {"push": 10.0}),
        slow(bricks, {"mu": 0.2, "width": 2.0}),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_slopes_contain_how_what_is_faced_changes(scene_of, at):
    agree(scene_of, at, Schedule(2), EXACT)


def test_where_all_parts_are_says_nothing_of_what_they_face():
    """What a parameter that moves the whole body changes there is round-off, and no kink."""

    def moved(x):
        scene = punched()
        return replace(scene, mesh=shifted(scene.mesh, x, 0.0))

    *_, (_, slopes) = sensitivities(moved, {"x": 0.0}, Schedule(1), EXACT, sizes={"x": 10.0})
    assert slopes["x"].smooth
    assert slopes["x"].resolved
    np.testing.assert_allclose(slopes["x"].nodes, [[1.0, 0.0]] * len(slopes["x"].nodes), atol=1e-8)


def flush(over=0.0, poisson=0.3, mu=0.3):
    """Two blocks on each other, the upper one wider by ``over``."""
    upper = shifted(block(1.0 + over, 1.0, 3, 2), 0.0, 1.0)
    sides = *(Support(name, 0) for name in ("low/left", "up/left")), Support("low/base", 1)
    mesh, tool = together({"low": block(1.0, 1.0, 5, 2), "up": upper}), DeformableTool(("low/top",), ("up/base",), mu)
    supports, regions = (*sides, Prescribed("up/top", 1, -0.01)), {"up": Elastic(Elasticity(210e3, poisson))}
    return Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, supports, (tool,), regions=regions)


@pytest.mark.parametrize(
    ("name", "at", "smooth"),
    [
        ("over", {"over": 0.0}, False),
        ("over", {"over": 0.05}, True),
        ("poisson", {"poisson": 0.3, "mu": 0.0}, False),
        ("poisson", {"poisson": 0.29, "mu": 0.0}, True),
        ("mu", {"mu": 0.3}, True),
    ],
)
def test_where_an_end_is_right_before_another_one_results_have_a_kink(name, at, smooth):
    def scene_of(**changed):
        return flush(**{**at, **changed})

    *_, (_, slopes) = sensitivities(scene_of, {name: at[name]}, Schedule(1), EXACT, sizes={name: at[name] or 1.0})
    assert slopes[name].smooth == smooth
    # Differences to the one side and to the other are those of two slopes.
    parts = [
        [fields(accepted)["stress"] for accepted in march(scene_of(**{name: at[name] + h}), Schedule(1), EXACT)][-1]
        for h in (-1e-4, 0.0, 1e-4)
    ]
    less, here, more = parts
    assert (np.abs(more - 2 * here + less).max() > 5e-3 * np.abs(more - less).max()) == (not smooth)
