r"""Where contact is posed: at the nodes of a tool's boundaries, or in the mean around the ends of their edges.

A point p is a combination of nodes, x_p = sum_k D_pk x_k with sum_k D_pk = 1, and so is its gap to a flat tool. With
r_p dual to it the nodes take D_pk r_p. There are two choices of D:

    nodes       D = 1: one point a node,
    weighted    D_pk = int psi_p N_k dA / int psi_p dA: one point an end of an edge.

psi_p are the functions that are linear along each edge, 1 at p and 0 at the other ends; dA is that of rest, on a ring
too, and int is Gauss' rule of three points, exact on straight edges with the middle node in the middle. A pressure
p(s) = sum_p p_p psi_p gives the nodal forces int p N_k dA = sum_p D_pk r_p with r_p = p_p int psi_p dA: what the law
says of r_p it says of the pressure at p, and by convexity of all between. On quadratic edges there are half as many
points as nodes, which is a stable pair, and pressures do not alternate from corner to mid-side; in between a gap may be
below zero where another is above (:mod:`bipot.contact.overlap`). On linear edges psi_p are the dual functions,
int psi_p N_k dA = 0 for k other than p: weighted gaps are those of the nodes, and both choices are one.

Where a boundary turns by more than :data:`CREASE` the mean stops: at a corner of the body, of which one side lies on
the tool and the other goes up, both sides have a point of their own. So have a side and its mirror image beyond a plane
of symmetry, and all edges where parts of the body meet in one node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.fem.reduction import Geometry
from bipot.fem.surface import facet_mass
from bipot.meshes.mesh import Mesh
from bipot.tensors import norm
from bipot.tools.tool import Sampling, Tool
from bipot.typing import Bools, Floats, Ints, Vector

CREASE = 0.5
"""Cosine of the largest angle, 60 degrees, by which an edge may turn from its neighbour and share a point with it."""

HATS = np.array([[1.0, 0.5, 0.0], [0.0, 0.5, 1.0]])
"""The linear functions of a quadratic edge by its shape functions: psi = HATS N."""


@dataclass(frozen=True)
class Points:
    """Points (p,) of a tool's boundaries.

    ``node`` (p,) is where they are, ``weights`` D (p, a) what they are the means of, ``edges`` (f, n) the points of
    each edge of the boundaries, whose nodes are ``lines`` (f, m).
    """

    node: Ints
    weights: sp.csr_matrix
    edges: Ints
    lines: Ints

    @property
    def weighted(self) -> bool:
        """Whether they are means: there are fewer of them than nodes."""
        return self.edges.shape[1] < self.lines.shape[1]


def points(mesh: Mesh, geometry: Geometry, tool: Tool) -> Points:
    """Where contact with the tool is posed."""
    lines = mesh.edges(*tool.candidates)
    if tool.sampling is Sampling.NODES or lines.shape[1] == 2:
        node, edges = np.unique(lines, return_inverse=True)
        count, one = len(node), np.ones(len(node))
        weights = sp.csr_matrix((one, node, np.arange(count + 1)), shape=(count, len(mesh.nodes)))
        return Points(node, weights, edges.reshape(lines.shape), lines)
    edges, node = _ends(mesh.nodes, lines)
    shares = HATS @ facet_mass(mesh.nodes, lines, geometry)
    row, column = np.broadcast_arrays(edges[:, :, None], lines[:, None, :])
    shape = len(node), len(mesh.nodes)
    weights = sp.csr_matrix((shares.ravel(), (row.ravel(), column.ravel())), shape=shape)
    weights.sum_duplicates()
    weights.data /= np.repeat(np.asarray(weights.sum(axis=1)).ravel(), np.diff(weights.indptr))
    return Points(node, weights, edges, lines)


def hat_areas(nodes: Floats, lines: Ints, geometry: Geometry) -> Floats:
    """int psi dA (f, 2) of the ends of quadratic edges ``lines`` (f, 3).

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> hat_areas(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN).tolist()
    [[0.5, 0.5]]
    """
    return facet_mass(nodes, lines, geometry).sum(axis=2) @ HATS.T


def _ends(nodes: Floats, lines: Ints) -> tuple[Ints, Ints]:
    """Points (f, 2) at the ends of quadratic edges (f, 3), and their nodes (p,).

    One where two edges go on, or one ends; one for each edge at a crease and where more than two meet.
    """
    away = _away(nodes, lines)
    ends = lines[:, [0, 2]]
    node, inverse, count = np.unique(ends, return_inverse=True, return_counts=True)
    order = np.argsort(inverse.ravel(), kind="stable")
    first = np.cumsum(count) - count
    way = away.reshape(-1, 2)[order]
    second = np.minimum(first + 1, len(order) - 1)
    # Edges that go straight on leave their node in opposite directions; of three or more none goes on.
    split = (count > 2) | (count == 2) & (-np.vecdot(way[first], way[second]) < CREASE)
    parts = np.where(split, count, 1)
    own = np.repeat(split, count) * (np.arange(len(order)) - np.repeat(first, count))
    number = np.repeat(np.cumsum(parts) - parts, count) + own
    edges = np.empty(len(order), dtype=np.intp)
    edges[order] = number
    return edges.reshape(-1, 2), np.repeat(node, parts)


def _away(nodes: Floats, lines: Ints) -> Floats:
    """Unit vectors (f, 2, d) along which quadratic edges (f, 3), parabolas, go from their ends."""
    x = nodes[lines]
    away = np.stack([4 * x[:, 1] - 3 * x[:, 0] - x[:, 2], 4 * x[:, 1] - x[:, 0] - 3 * x[:, 2]], axis=1)
    return away / norm(away)[..., None]


def creased(mesh: Mesh, own: Points, normal: Vector) -> Bools:
    """Whether at points (p,) on a plane of symmetry with the unit ``normal`` the mean stops: mirror images begin.

    The mean of a node by itself is that of its mirror image too.
    """
    out = np.zeros(len(own.node), dtype=bool)
    if own.weighted:
        # Of an edge and its mirror image w . w' = 1 - 2 (n . w)^2.
        turns = 2 * (_away(mesh.nodes, own.lines) @ np.array(normal)) ** 2 - 1 < CREASE
        np.logical_or.at(out, own.edges, turns)
    return out
