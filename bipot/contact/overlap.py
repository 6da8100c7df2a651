r"""Overlap: the largest penetration anywhere on the edges and faces that may touch a tool, not only at their nodes.

The law is posed at nodes. A straight edge of two nodes is nearest to a flat tool at one of them. An edge of three nodes
is the parabola through them, and its gap n . x(s) - n . x_tool is the parabola through their gaps g_0, g_m, g_1,

    g(s) = g_0 + b s + a s^2,    a = 2 (g_0 - 2 g_m + g_1),    b = 4 g_m - 3 g_0 - g_1,    0 <= s <= 1,

which is least at an end or, where a > 0, at s = -b/(2 a): exact, without sampling. The gap of an edge to a curved tool
has no such form: it is sampled, and near its minimum the slope n . x'(s) is bisected to zero. Overlap is a
discretisation error that a certificate of the nodal law does not contain.

In space the edges are those of the faces. Every point of a face without middle nodes is a mean of its nodes, so that
one of these is nearest to a flat tool. Other faces, and all under a curved tool, are sampled inside too: the middle of
a face of eight nodes is -1/4 of the sum of its corners plus 1/2 of that of its middle nodes, and goes into a flat tool
that middle nodes touch and corners do not.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from bipot.fem.elements import tabulated_at
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from bipot.scene.symmetry import PLANAR
from bipot.tools.deformable import DeformableTool
from bipot.tools.facing import lowest
from bipot.tools.flats import edge_shapes, edge_slopes
from bipot.tools.tool import Tool
from bipot.typing import Floats, Ints, read_only

SAMPLES = 17
"""Samples along an edge under a curved tool, of which the gap has at most one dip between three of them, and along each
axis of a face."""

HALVINGS = 52
"""Halvings of the bracket around a dip, down to the round-off of s."""


def overlap(scene: Scene, nodes: Floats, placed: Floats) -> float:
    """Largest penetration of ``nodes`` (a, d), edges and faces into the tools, over the body size; 0 if none.

    At deformable tools it is that along normals of either side, between polygons through their nodes.

    The tools are in the poses ``placed`` (k, p). All facets of their boundaries count, with open, closed or held nodes.
    """
    deepest = 0.0
    for tool, pose in zip(scene.tools, placed, strict=True):
        if isinstance(tool, DeformableTool):
            one, other = tool.sides.one, tool.sides.other
            for sides in ((one, other), (other, one)):
                deepest = max(deepest, -lowest(nodes, *sides, scene.ring))
            continue
        edges = nodes[tool_edges(scene.mesh, tool)]
        deepest = max(deepest, -float(least_gap(tool, edges, pose).min()))
        if scene.mesh.dimension == 3 and (scene.mesh.element.quadratic or not tool.flat):
            faces = nodes[scene.mesh.edges(*tool.candidates)]
            points = _shapes(Element.of(faces.shape[1])) @ faces
            deepest = max(deepest, -float(tool.distance(points, pose).min()))
    return deepest / scene.mesh.size


def unfelt(scene: Scene, nodes: Floats, placed: Floats) -> float:
    """How far surface nodes that are no candidates of a tool went behind its surface, over the body size; 0 if none.

    Of the ``nodes`` (a, d), with tools in the poses ``placed`` (k, p), those count that were not behind the surface at
    rest and are not past an open end. They are rightly there beside a flat punch that ends at its candidates; where the
    tool extends further, they should have been candidates.
    """
    deepest, surface = 0.0, np.unique(scene.mesh.outline)
    for tool, at_rest, pose in zip(scene.tools, scene.at_rest, placed, strict=True):
        others = np.setdiff1d(surface, scene.mesh.boundary_nodes(*tool.candidates))
        others = others[tool.distance(scene.mesh.nodes[others], at_rest) >= -PLANAR * scene.mesh.size]
        depth = np.where(tool.face.beyond(tool.own(nodes[others], pose)), 0.0, -tool.distance(nodes[others], pose))
        deepest = max(deepest, float(depth.max(initial=0.0)))
    return deepest / scene.mesh.size


@cache
def _shapes(element: Element) -> Floats:
    """The shape functions (p, n) of a face, a plane ``element``, at points spread over it."""
    return read_only(tabulated_at(element, element.grid(SAMPLES)).values, np.float64)


def tool_edges(mesh: Mesh, tool: Tool) -> Ints:
    """Edges (f, n) of a tool's boundaries, nodes as end (middle) end; in space of each face, shared ones twice."""
    facets = mesh.edges(*tool.candidates)
    if mesh.dimension == 2:
        return facets
    edges = Element.of(facets.shape[1]).edges
    return facets[:, edges].reshape(-1, edges.shape[1])


def least_gap(tool: Tool, edges: Floats, pose: Floats) -> Floats:
    """Least gaps (f,) along ``edges`` (f, n, d) to the tool in the ``pose`` (p,)."""
    return _least_on_parabolas(tool.distance(edges, pose)) if tool.flat else least_along(tool, tool.own(edges, pose))


def _least_on_parabolas(gap: Floats) -> Floats:
    """Least values (f,) on 0 <= s <= 1 of the parabolas through ``gap`` (f, 3) at s = 0, 1/2, 1, or lines (f, 2).

    >>> _least_on_parabolas(np.array([[1.0, -0.5, 1.0], [0.0, 0.75, 2.0]])).tolist()
    [-0.5, 0.0]
    """
    if gap.shape[1] == 2:
        return gap.min(axis=1)
    start, middle, end = gap.T
    a, b = 2 * (start - 2 * middle + end), 4 * middle - 3 * start - end
    inside = (a > 0) & (-b > 0) & (-b < 2 * a)
    drop = np.divide(b**2, 4 * a, out=np.zeros_like(a), where=inside)
    return np.minimum(np.minimum(start, end), start - drop)


def least_along(tool: Tool, edges: Floats) -> Floats:
    """Least gaps (f,) to the tool at rest along ``edges`` (f, n, d), parabolas or lines through their nodes."""
    s = np.linspace(0.0, 1.0, SAMPLES)
    gap = tool.face.distance(_along(edges, s)).gap
    near = s[np.argmin(gap, axis=1)][:, None]
    low, high = np.maximum(near - 1 / (SAMPLES - 1), 0.0), np.minimum(near + 1 / (SAMPLES - 1), 1.0)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        rises = np.vecdot(tool.face.distance(_along(edges, middle)).normal, _ahead(edges, middle)) > 0
        low, high = np.where(rises, low, middle), np.where(rises, middle, high)
    return np.minimum(gap.min(axis=1), tool.face.distance(_along(edges, low)).gap[:, 0])


def _along(edges: Floats, s: Floats) -> Floats:
    """Points (f, s, d) of edges (f, n, d) at s (s,) or (f, s)."""
    s = np.broadcast_to(s, (len(edges), s.shape[-1]))
    return edge_shapes(s, edges.shape[1]) @ edges


def _ahead(edges: Floats, s: Floats) -> Floats:
    """dx/ds (f, s, d) of edges (f, n, d) at s (f, s)."""
    return edge_slopes(s, edges.shape[1]) @ edges
