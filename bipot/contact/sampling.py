r"""Where contact is posed: at the nodes of a tool's boundaries, or in the mean around the ends of their facets.

A point p is a combination of nodes, x_p = sum_k D_pk x_k with sum_k D_pk = 1. Its gap is the same combination of their
gaps (:mod:`bipot.tools.parts`), which for a flat tool is the gap of x_p. The force r_p dual to it acts on the nodes as
D_pk r_p. There are two choices of D:

    nodes       D = 1: one point a node,
    weighted    D_pk = int psi_p N_k dA / int psi_p dA: one point an end of an edge, or a corner of a face.

psi_p are the functions that are linear along each edge and on each triangle, bilinear on each square, 1 at p and 0 at
the other ends. dA is that at rest (of the ring on a meridian), and int is Gauss' rule of :mod:`bipot.fem.surface`,
exact on straight facets with centred middle nodes. A pressure p = sum_p p_p psi_p gives the nodal forces
int p N_k dA = sum_p D_pk r_p with r_p = p_p int psi_p dA. The law for r_p is thus the law for the pressure at p and, by
convexity, between the points. On quadratic facets there are fewer points than nodes, which is a stable pair, and
pressures do not alternate from corner to mid-side. A uniform pressure on a face pulls at the corners of eight nodes and
has no force at those of six, but the weights of psi_p are positive. Between the points the gap may be negative at some
places and positive at others (:mod:`bipot.contact.overlap`).

On linear edges psi_p are the dual functions, int psi_p N_k dA = 0 for k other than p: weighted gaps are those of the
nodes, and both choices are the same. On linear faces the points are the nodes too: hat functions in place of dual
functions would give the same forces r for closed contacts, but pressures M^-1 r, M_ij = int N_i N_j dA, whose
alternating part is up to nine times that of r_p / int N_p dA.

:mod:`bipot.contact.creases` decides which ends of facets share a point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.sparse as sp

from bipot.contact.creases import ends_of
from bipot.fem.reduction import Geometry
from bipot.fem.surface import facet_mass
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.tools.surfaces import ACROSS
from bipot.tools.tool import Sampling, Tool
from bipot.typing import Floats, Ints, read_only


@dataclass(frozen=True)
class Points:
    """Points (p,) of a tool's boundaries.

    ``node`` (p,) are the nodes at which they are, ``weights`` D (p, a) their means, ``edges`` (f, n) the points of each
    facet of the boundaries, whose nodes are ``lines`` (f, m).
    """

    node: Ints
    weights: sp.csr_matrix
    edges: Ints
    lines: Ints

    @property
    def weighted(self) -> bool:
        """Whether they are means of several nodes."""
        return self.edges.shape[1] < self.lines.shape[1]


def points(mesh: Mesh, geometry: Geometry, tool: Tool) -> Points:
    """Where contact with the tool is posed."""
    lines = mesh.edges(*tool.candidates)
    if tool.sampling is Sampling.NODES or not mesh.element.quadratic:
        node, edges = np.unique(lines, return_inverse=True)
        count, one = len(node), np.ones(len(node))
        weights = sp.csr_matrix((one, node, np.arange(count + 1)), shape=(count, len(mesh.nodes)))
        return Points(node, weights, edges.reshape(lines.shape), lines)
    edges, node = ends_of(mesh.nodes, lines, mesh.element.ends)
    shares = hats(lines.shape[1], mesh.dimension) @ facet_mass(mesh.nodes, lines, geometry)
    row, column = np.broadcast_arrays(edges[:, :, None], lines[:, None, :])
    shape = len(node), len(mesh.nodes)
    weights = sp.csr_matrix((shares.ravel(), (row.ravel(), column.ravel())), shape=shape)
    weights.sum_duplicates()
    weights.data /= np.repeat(np.asarray(weights.sum(axis=1)).ravel(), np.diff(weights.indptr))
    # Of a straight edge the far end is no part of the mean, but for round-off.
    weights.data[np.abs(weights.data) <= ACROSS] = 0.0
    weights.eliminate_zeros()
    return Points(node, weights, edges, lines)


@cache
def hats(count: int, dimension: int) -> Floats:
    """psi (k, n) at the nodes of quadratic facets of ``count`` nodes n, bounding elements of ``dimension`` d: psi N.

    >>> hats(3, 2).tolist()
    [[1.0, 0.5, 0.0], [0.0, 0.5, 1.0]]
    """
    if dimension == 2:
        return read_only([[1.0, 0.5, 0.0], [0.0, 0.5, 1.0]], np.float64)
    face = Element.of(count)
    out = np.eye(face.corners, count)
    out[face.edges[:, [0, 2]], face.edges[:, [1]]] = 0.5
    return read_only(out, np.float64)


def hat_areas(nodes: Floats, lines: Ints, geometry: Geometry) -> Floats:
    """int psi dA (f, k) of the ends of quadratic facets ``lines`` (f, n).

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> hat_areas(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN).tolist()
    [[0.5, 0.5]]
    """
    return facet_mass(nodes, lines, geometry).sum(axis=2) @ hats(lines.shape[1], nodes.shape[1]).T
