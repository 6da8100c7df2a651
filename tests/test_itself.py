"""A body goes through itself or its mirror image neither at rest nor in an increment; its surface's nodes are apart."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.control.accepted import Accepted
from bipot.errors import IncrementFailed, SceneError
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.meshes.together import together
from bipot.scene.itself import Itself
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.tool import FlatTool
from tests.curved import STEEL

PLANE, SPACE = (Element.Q4, Element.Q8, Element.Q9), (Element.H8, Element.H20, Element.T10)


def gaping(element: Element | None = Element.Q4) -> Mesh:
    """Two flanges, of y from 0 to 2 and from 3 to 4, with a web between them where x is below 2; None: of triangles."""
    solid = Element.T4 if element is Element.T10 else Element.H8
    mesh = brick(8.0, 4.0, 1.0, 8, 4, 1, element=solid) if element in SPACE else block(8.0, 4.0, 8, 4)
    middle = mesh.nodes[mesh.elements].mean(axis=1)
    kept = mesh.elements[(middle[:, 0] < 2) | (middle[:, 1] < 2) | (middle[:, 1] > 3)]
    if element is None:
        kept = np.vstack([kept[:, [0, 1, 2]], kept[:, [0, 2, 3]]])
    used, numbers = np.unique(kept, return_inverse=True)
    number = np.full(len(mesh.nodes), -1)
    number[used] = np.arange(len(used))
    ends = {name: number[mesh.boundaries[name]] for name in ("base", "top")} if mesh.dimension == 2 else {}
    return Mesh(mesh.nodes[used], numbers.reshape(kept.shape), ends).to(element or Element.T6)


def closed(mesh: Mesh, depth: float) -> np.ndarray:
    """Nodes (a, d) with the upper flange bent down, by ``depth`` into the lower one at its end."""
    nodes = mesh.nodes.copy()
    upper = (nodes[:, 1] >= 3) & (nodes[:, 0] > 2)
    nodes[upper, 1] -= (1 + depth) * (nodes[upper, 0] - 2) / 6
    return nodes


@pytest.mark.parametrize("element", [*PLANE, None, *SPACE])
def test_a_flange_in_the_other_is_seen_and_one_that_only_comes_near_is_not(element):
    mesh = gaping(element)
    itself = Itself.of(mesh, ())
    itself.require_apart()
    assert itself.through(closed(mesh, -1e-4)) is None
    for depth in (0.01, 0.3, 1.5):
        assert "is in element" in str(itself.through(closed(mesh, depth)))


@pytest.mark.parametrize("axes", [(0, 1), (1, 0)])
def test_it_is_seen_wherever_the_body_is_and_however_it_is_turned(axes):
    mesh = gaping()
    turned = closed(mesh, 0.23)[:, axes] * (1.0, -1.0) + (1e3, -40.0)
    assert Itself.of(mesh, ()).through(turned) is not None
    assert Itself.of(mesh, ()).through(turned * 1e-6) is not None


def test_an_increment_that_closes_a_gap_is_refused_and_says_where():
    mesh = gaping()
    tool = FlatTool((0.0, 4.0), (0.0, -1.0), (0.0, -1.5), ("top",), 0.2)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, (Support("base", 0), Support("base", 1)), (tool,))
    running, seen = march(scene, Schedule(6), Control(Newton(), (), cuts=4)), list[Accepted]()
    with pytest.raises(IncrementFailed, match=r"goes through itself: node \d+ is in element \d+\)\. End the path"):
        seen.extend(running)
    assert seen
    assert all(scene.itself.through(step.state.nodes) is None for step in seen)


def notched(element: Element) -> Mesh:
    """A row of four elements under two on either side of a notch, whose flanks have its tip in common alone."""
    low, tip, left, right = range(5), range(5, 10), range(10, 13), range(13, 16)
    x = [-2.0, -1.0, 0.0, 1.0, 2.0]
    upper = [(-2.0, 2.0), (-1.0, 2.0), (-0.3, 2.0), (0.3, 2.0), (1.0, 2.0), (2.0, 2.0)]
    cells = [[low[k], low[k + 1], tip[k + 1], tip[k]] for k in range(4)]
    cells += [[tip[k], tip[k + 1], left[k + 1], left[k]] for k in range(2)]
    cells += [[tip[k + 2], tip[k + 3], right[k + 1], right[k]] for k in range(2)]
    nodes = np.array([(a, 0.0) for a in x] + [(a, 1.0) for a in x] + upper)
    return Mesh(nodes, np.array(cells), {}).to(element)


@pytest.mark.parametrize("element", PLANE)
def test_flanks_of_a_notch_that_go_through_each_other_are_seen(element):
    """They have its tip in common, and no element is folded: the angles around the tip are more than a whole turn."""
    mesh = notched(element)
    itself = Itself.of(mesh, ())
    itself.require_apart()
    for closing, seen in ((0.29, False), (0.32, True), (0.5, True)):
        nodes = mesh.nodes.copy()
        # Right and left go towards each other above the tip, as far as they are high there.
        flank = (nodes[:, 1] > 1) & (np.abs(nodes[:, 0]) < 0.9)
        nodes[flank, 0] -= closing * (nodes[flank, 1] - 1) * np.sign(nodes[flank, 0])
        assert (itself.through(nodes) is not None) == seen


def test_a_body_that_goes_through_its_own_mirror_image_is_refused():
    """Half of it above the plane: a free face there, beside the part that is held, is pushed across."""
    mesh = block(4.0, 1.0, 8, 2)
    held = {"held": mesh.boundaries["base"][:2], "free": mesh.boundaries["base"][2:]}
    mesh = replace(mesh, boundaries={**mesh.boundaries, **held})
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.2), ("top",), 0.0)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, (Symmetry("held", 1), Support("left", 0)), (tool,))
    with pytest.raises(IncrementFailed, match=r"past x_1 = 0, in the body's own mirror image"):
        list(march(scene, Schedule(4), Control(Newton(), (), cuts=2)))


def test_a_seam_that_is_not_merged_is_refused_by_its_nodes():
    """A row of nodes that is there twice, the fault that mesh generators make most often."""
    mesh = block(4.0, 2.0, 4, 2)
    seam = np.flatnonzero((np.abs(mesh.nodes[:, 1] - 1) < 1e-9) & (mesh.nodes[:, 0] < 2.5))
    elements, upper = mesh.elements.copy(), mesh.nodes[mesh.elements].mean(axis=1)[:, 1] > 1
    other = np.arange(len(mesh.nodes))
    other[seam] = len(mesh.nodes) + np.arange(len(seam))
    elements[upper] = other[elements[upper]]
    nodes = np.vstack([mesh.nodes, mesh.nodes[seam] + (0.0, 1e-12)])
    boundaries = {name: mesh.boundaries[name] for name in ("base", "top")}
    supports = (Support("base", 0), Support("base", 1))
    with pytest.raises(SceneError, match=r"mesh\.nodes = 'nodes \[\d+, \d+\] at one place': must be different places"):
        Scene(Mesh(nodes, elements, boundaries), Geometry.PLANE_STRAIN, STEEL, supports)
    nodes[len(mesh.nodes) :, 1] += 0.01
    Scene(Mesh(nodes, elements, boundaries), Geometry.PLANE_STRAIN, STEEL, supports)


def test_a_body_that_is_in_itself_at_rest_is_refused():
    mesh = gaping()
    folded = replace(mesh, nodes=closed(mesh, 0.23))
    supports = (Support("base", 0), Support("base", 1))
    with pytest.raises(SceneError, match=r"mesh = 'node \d+ is in element \d+': must be a body no part of which"):
        Scene(folded, Geometry.PLANE_STRAIN, STEEL, supports)


@pytest.mark.parametrize("element", [Element.Q8, Element.T6, Element.H20])
def test_a_thin_ring_in_another_is_not_in_it(element):
    """The means of the nodes of elements that are thinner than their arcs are high were outside these elements."""

    def ring(radius: float, count: int) -> Mesh:
        flat = element.dimension == 2
        mesh = (
            block(0.03, 1.0, 1, count, element=element) if flat else brick(0.03, 1.0, 0.5, 1, count, 1, element=element)
        )
        r, turn = radius + mesh.nodes[:, 0], np.pi / 2 * mesh.nodes[:, 1]
        x = np.column_stack([r * np.cos(turn), r * np.sin(turn), mesh.nodes[:, 2:]])
        return replace(mesh, nodes=x)

    mesh = together({"in": ring(0.97, 3), "out": ring(1.0, 5)})
    touching = mesh.boundary_nodes("in/right", "out/left")
    Itself.of(mesh, (), touching).require_apart()
    moved = mesh.nodes * np.where(mesh.part == mesh.part[0], 1.05, 1.0)[:, None]
    assert Itself.of(mesh, (), touching).through(moved) is not None
