"""Curved tools that nodes alone do not feel: between two of them, through the body, beyond a plane of symmetry."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from bipot.between import between, inside
from bipot.errors import IncrementFailed
from bipot.forms import Newton
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.mesh import block
from bipot.schedule import Schedule
from bipot.surfaces import Circle, Distance
from bipot.system import system_of
from bipot.tools import ShapedTool
from tests.curved import dragged, forces, marched, pressed
from tests.scenes import refused

RUBBER = Elastic(Elasticity(1e3, 0.3))


def needle(centre, radius, travel, elements=2, path=((0, 0), (1, 1))):
    """A circle smaller than an edge goes straight on, into a block that is held at its base."""
    scene = dragged(material=RUBBER, elements=elements)
    punch = replace(scene.tools[0], surface=Circle(centre, radius), travel=travel, path=path)
    return replace(scene, tools=(punch,))


@pytest.mark.parametrize("increments", [1, 5, 40])
@pytest.mark.parametrize(
    ("radius", "down"), [(0.05, 0.2), (0.05, 0.6), (0.05, 2.0), (0.01, 0.6), (0.15, 0.4), (0.15, 2.0)]
)
def test_a_circle_smaller_than_an_edge_does_not_come_in_between_its_nodes(radius, down, increments):
    """Between the nodes at 0.25 and 0.5, near them or not: whatever it does there, no node feels it."""
    for x in (0.375, 0.32):
        scene = needle((x, 1.0 + radius), radius, (0.0, -down))
        with pytest.raises(IncrementFailed, match=r"tools\[0\] comes into the body between nodes \d+ and \d+"):
            list(march(scene, Schedule(increments), Control(Newton(), fallbacks=())))


def test_a_circle_that_nodes_feel_may_be_as_small_as_an_edge():
    """Edges are 0.25 long: the chord of a circle of radius 0.2 is less deep than a fourth of it."""
    for x in (0.375, 0.32, 0.25):
        accepted = marched(needle((x, 1.2), 0.2, (0.0, -0.15)), increments=6)
        assert forces(accepted)[-1, 1] < -10.0


def test_who_passes_beside_the_body_is_not_between():
    scene = needle((1.2, 1.2), 0.05, (0.0, -1.0))
    assert abs(forces(marched(scene))[-1]).max() == 0.0


def test_between_is_by_the_way_of_both():
    """A turned segment, brute force: the tip's way against the segment in small steps."""
    rng = np.random.default_rng(3)
    mesh = block(1.0, 1.0, 1, 1)
    tool = ShapedTool(Circle((0.0, 0.0), 0.01), (0.0, 0.0), ("top",), 0.1)
    seen = 0
    for _ in range(400):
        start = mesh.nodes + rng.uniform(-1, 1, 2) + (0.0, -1.5)
        end = start + rng.uniform(-0.2, 0.2, (4, 2)) + (0.0, rng.uniform(0.0, 2.0))
        steps = [_depth(start + s * (end - start), mesh.surface("top")[0][0]) for s in np.linspace(0, 1, 400)]
        crossings = [b for a, b in pairwise(steps) if a[0] >= 0 > b[0]]
        if crossings and min(abs(f - k) for _, f in crossings for k in (0, 1)) < 0.05:
            continue  # the way is a straight line's only nearly
        expected = steps[0][0] >= 0 > steps[-1][0] and any(0 < foot < 1 for _, foot in crossings)
        found = between(mesh, tool, start, end) is not None
        assert found == expected
        seen += found
    assert 20 < seen < 380


def _depth(nodes, edge):
    """How far the origin is above what may be behind the edge, and its foot."""
    a, b = nodes[edge[0]], nodes[edge[-1]]
    along = b - a
    length = np.hypot(*along)
    height = (-a @ (along[1], -along[0])) / length
    return height - 0.01 + 0.25 * length, -a @ along / length**2


@pytest.mark.parametrize("centre", [(0.5, 0.5), (0.3, 0.85), (0.62, 0.2)])
def test_a_circle_that_is_in_the_body_at_rest_is_refused(centre):
    refused(lambda: needle(centre, 0.06, (0.0, -0.1)), r"tools\[0\].surface.*must be off the body")
    mesh = block(1.0, 1.0, 2, 2)
    assert not inside(mesh, ShapedTool(Circle((0.5, 1.05), 0.06), (0.0, 0.0), ("top",), 0.1))
    assert not inside(mesh, ShapedTool(Circle((0.5, 0.5), 3.0, concave=True), (0.0, 0.0), ("top",), 0.1))


def test_a_mirror_image_that_meets_the_modelled_part_is_named():
    """Beyond the plane of symmetry the circle is none of the modelled part's, but its image is there."""
    scene = pressed(surface=Circle((-0.3, 1.5), 0.5), travel=(0.0, -0.1))
    with pytest.raises(IncrementFailed, match=r"the mirror image of tools\[0\].*Model the whole body"):
        marched(scene)
    refused(lambda: pressed(surface=Circle((-0.3, 1.4), 0.5)), r"tools\[0\].*mirror image .* is off the body")
    own = pressed(surface=Circle((0.3, 1.5), 0.5), travel=(0.0, -0.05))
    assert forces(marched(own))[-1, 1] < 0


@pytest.mark.parametrize("off", [1e-10, -3e-11])
def test_a_centre_off_the_plane_by_round_off_leaves_no_friction_at_the_pole(off):
    scene = pressed(surface=Circle((off, 3.0), 2.0))
    contacts = system_of(scene).candidates
    pole = contacts.node == np.argmin(np.hypot(*(scene.mesh.nodes - (0.0, 1.0)).T))
    assert not contacts.tangent_free[pole].any()
    np.testing.assert_allclose(forces(marched(scene))[-1], forces(marched(pressed()))[-1], rtol=1e-6)


class Broken:
    """A surface that says nothing."""

    def __init__(self, said: Any) -> None:
        self.said = said

    def distance(self, *x: Any) -> Any:
        return self.said(*x)

    gap = size = passed = crossed = tips = mirrored = distance


@pytest.mark.parametrize(
    "said",
    [
        lambda x: None,
        lambda x: Distance(x[..., 0], x, x[..., 0]),
        lambda x: Distance(x[..., 0] * np.nan, x * 0 + (0, 1.0), x[..., 0]),
        lambda x: Distance(x[..., :1], x * 0 + (0, 1.0), x[..., 0]),
    ],
)
def test_a_surface_that_is_none_is_refused(said):
    surface: Any = Broken(said)
    refused(lambda: pressed(surface=surface), r"tools\[0\].surface")
