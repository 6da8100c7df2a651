"""Overlap on the contact edges: parabolas of known depth, edges that are no candidates, a run between its nodes."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.contact.overlap import overlap, unfelt
from bipot.fem.elements import RULES
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paper import upsetting
from bipot.plot import curved
from bipot.results.columns import UNFELT
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile
from bipot.tools.tool import FlatTool, Sampling, ShapedTool

STEEL = upsetting(mu=0.3).material
ROOT = np.sqrt(0.5)

REST = np.zeros((1, 2))
"""No tool has moved."""


def under(*normal, point=(0.0, 2.0), candidates=("top",), path=((0.0, 0.0), (1.0, 1.0))):
    """A block 4 x 2 of one element under a tool whose plane goes through ``point``."""
    tool = FlatTool(point, normal, (0.0, -1.0), candidates, 0.3, path)
    return Scene(
        block(4.0, 2.0, 1, 1, element=Element.Q8), Geometry.PLANE_STRAIN, STEEL, (Support("base", 1),), (tool,)
    )


def with_top(scene, left, middle, right):
    """Nodes at rest with these heights on the top edge, end, middle, end."""
    nodes = scene.mesh.nodes.copy()
    edge = scene.mesh.boundary("top")[0]
    nodes[edge[np.argsort(nodes[edge, 0])], 1] = left, middle, right
    return nodes


@pytest.mark.parametrize(
    ("heights", "depth"),
    [
        ((2.0, 2.0, 2.0), 0.0),
        ((1.0, 1.5, 1.9), 0.0),
        # Symmetric: the middle is the highest.
        ((1.5, 2.25, 1.5), 0.25),
        # y = 2 + 0.5 s (1 - s) 4: ends and middle at s = 0, 1/2, 1.
        ((2.0, 2.5, 2.0), 0.5),
        # y = 2 + s - 1.5 s^2, highest at s = 1/3, where no node lies: 1/6 through.
        ((2.0, 2.125, 1.5), 1 / 6),
        # All three nodes clear of the plane, the parabola between them not: y = 1.99 + 0.4 s - s^2.
        ((1.99, 1.94, 1.39), 0.03),
        # A hollow edge is deepest at an end.
        ((2.5, 1.0, 2.25), 0.5),
        # Highest outside the edge: the end counts, not the vertex.
        ((2.0, 2.2, 2.3), 0.3),
    ],
)
def test_depth_of_a_parabola_is_that_of_its_closed_form(heights, depth):
    scene = under(0.0, -1.0)
    assert overlap(scene, with_top(scene, *heights), REST) == pytest.approx(depth / 4, rel=1e-13, abs=0)


def test_the_extremum_is_that_of_a_fine_sampling_of_any_edge():
    rng = np.random.default_rng(1)
    tool = under(-0.6, -0.8).tools[0]
    scene = replace(under(0.0, -1.0), tools=(tool,))
    for _ in range(100):
        nodes = scene.mesh.nodes + 0.5 * rng.standard_normal(scene.mesh.nodes.shape)
        points = curved(nodes, scene.mesh.boundary("top"), 2000).reshape(-1, 2)
        sampled = max(0.0, float((tool.face.offset(tool.moved(0.0, 0.3)) - points @ np.array(tool.normal)).max()))
        found = 4 * overlap(scene, nodes, scene.travel(0.0, 0.3))
        assert sampled <= found + 1e-12
        assert found == pytest.approx(sampled, rel=1e-5, abs=1e-6)


def test_the_tool_is_where_its_path_has_it_and_the_deepest_tool_counts():
    scene = under(0.0, -1.0, path=((0.0, 0.0), (0.5, 1.0), (1.0, 0.2)))
    nodes = scene.mesh.nodes
    assert [4 * overlap(scene, nodes, scene.travel(0.0, tau)) for tau in (0.0, 0.25, 0.5, 1.0)] == pytest.approx(
        [0, 0.5, 1, 0.2]
    )
    far = replace(scene.tools[0], point=(0.0, 9.0))
    both = replace(scene, tools=(far, scene.tools[0]))
    assert overlap(both, nodes, both.travel(0.0, 0.5)) == pytest.approx(0.25)


def test_only_candidate_boundaries_count_but_held_and_open_nodes_on_them_do():
    scene = under(-ROOT, ROOT, point=(4.5, -0.5), candidates=("right",))
    # The half-space right of the line through (4.5, -0.5) and (5, 0) holds no corner of the block.
    assert overlap(scene, scene.mesh.nodes, REST) == 0
    held = under(-ROOT, ROOT, point=(3.5, 0.0), candidates=("right",))
    # The lower right corner is held by the base in one direction, and 0.5/sqrt(2) inside.
    assert 4 * overlap(held, held.mesh.nodes, REST) == pytest.approx(0.5 * ROOT)
    # Off its candidates the tool may be anywhere.
    assert overlap(replace(held, tools=(replace(held.tools[0], candidates=("left",)),)), held.mesh.nodes, REST) == 0


def test_an_edge_that_passes_through_the_punch_between_its_nodes_is_seen():
    """Its nodes obey the gap to round-off, its parabola does not."""
    scene = upsetting(mu=0.3, elements=3)
    run = march(
        scene, Schedule(12, first=0.001 / 0.45, settling=1, growth=4.0), Control(Newton(), (Tangent(), Dissipation()))
    )
    found = [(overlap(scene, a.state.nodes, scene.travel(0.0, a.state.tau)), a) for a in run]
    deepest, at = max(found, key=lambda pair: pair[0])
    edges = scene.mesh.edges("top", "side")
    height, tool = curved(at.state.nodes, edges, 1000)[..., 1], scene.tools[0]
    sampled = float(height.max() + tool.face.offset(tool.moved(0.0, at.state.tau))) / scene.mesh.size
    assert at.solved.certificate.penetration < 1e-9
    assert sampled > 1e-5
    assert deepest == pytest.approx(sampled, rel=1e-4)


HOLLOW = Circle((0.0, 1.0), np.hypot(4.0, 1.0), concave=True)
WALLS = {
    "flat": lambda candidates: FlatTool((4.0, 0.0), (-1.0, 0.0), (-0.05, 0.0), candidates, 0.0),
    "hollow": lambda candidates: ShapedTool(HOLLOW, (-0.05, 0.0), candidates, 0.0),
}


@pytest.mark.parametrize("wall", WALLS.values(), ids=WALLS)
@pytest.mark.parametrize("candidates", [("top",), ("top", "right")])
def test_what_is_no_candidate_and_comes_behind_a_tool_is_told(candidates, wall):
    """A wall comes upon the side of a block; the side feels it where it is a candidate, its upper end in any case."""
    tool, held = wall(candidates), tuple(Support("left", d) for d in range(2))
    scene = Scene(block(4.0, 2.0, 8, 4), Geometry.PLANE_STRAIN, STEEL, held, (tool,))
    *_, last = march(scene, Schedule(4), Control(Newton()))
    found = float(UNFELT.value(system_of(scene), last))
    behind = max(-float(tool.distance(last.state.nodes, tool.pose(1.0)).min()), 0.0) / scene.mesh.size
    assert found == pytest.approx(behind, abs=1e-12)
    assert (found > 1e-3) == (candidates == ("top",))


def test_what_is_past_an_open_end_is_not_behind_a_tool():
    """A die's wall begins at a fifth of the side's height, and the side leans into it, the deeper the lower."""
    die = ShapedTool(Profile(((4.0, 0.4), (4.0, 3.0), (5.0, 3.0)), 0.1), (0.0, 0.0), ("base",), 0.0)
    mesh = block(4.0, 2.0, 1, 4)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, (Support("left", 0),), (die,))
    there = mesh.nodes + np.outer(0.25 - 0.1 * mesh.nodes[:, 1], [1.0, 0.0])
    assert unfelt(scene, there, np.zeros((1, 3))) == pytest.approx(0.2 / 4, rel=1e-12)


def test_what_was_behind_a_flat_tool_at_rest_is_no_matter():
    """A bolt's head rests on it, and its shank is in the hole."""
    scene = under(0.0, 1.0, point=(0.0, 1.0), candidates=("right",))
    assert unfelt(scene, scene.mesh.nodes, REST) == 0.0
    assert unfelt(scene, scene.mesh.nodes - [0.0, 1.5], REST) == pytest.approx(1.5 / scene.mesh.size)


@pytest.mark.parametrize(("element", "share"), [(Element.H8, 0.0), (Element.H20, 1.0), (Element.T10, 1 / 3)])
def test_a_face_that_goes_into_a_tool_between_its_edges_is_seen(element, share):
    """Of corners clear of a platen that the middles of edges touch, a face has -1/4 in its middle, or -1/9."""
    mesh, clear = brick(1.0, 1.0, 1.0, 1, 1, 1, element=element), 0.01
    platen = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.1), ("top",), 0.1, sampling=Sampling.WEIGHTED)
    held = tuple(Support("base", k) for k in range(3))
    scene = Scene(mesh, Geometry.SOLID, STEEL, held, (platen,), quadrature=RULES[element][-1])
    nodes = mesh.nodes.copy()
    nodes[(mesh.nodes[:, 2] == 1) & (mesh.nodes % 1 == 0).all(axis=1), 2] -= clear
    assert overlap(scene, nodes, scene.at_rest) == pytest.approx(share * clear, rel=0.02)


def test_the_body_size_is_that_of_the_modelled_part():
    """The right half of a block that is twice as long as high, pressed as deep as the whole."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.1)
    found = []
    for width, supports in ((2.0, ()), (1.0, (Symmetry("left", 0),))):
        held = (*supports, Support("base", 1))
        scene = Scene(block(width, 1.0, round(2 * width), 2), Geometry.PLANE_STRAIN, STEEL, held, (tool,))
        found.append(overlap(scene, scene.mesh.nodes, scene.placed(1.0, np.zeros(0))))
    np.testing.assert_allclose(found, [0.05, 0.1], rtol=1e-12)
