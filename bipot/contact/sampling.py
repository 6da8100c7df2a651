r"""Where contact is posed: at the nodes of a tool's boundaries, or in the mean around the ends of their facets.

A point p is a combination of nodes, x_p = sum_k D_pk x_k with sum_k D_pk = 1. Its gap is the same combination of their
gaps (:mod:`bipot.tools.parts`), which for a flat tool is the gap of x_p. The force r_p dual to it acts on the nodes as
D_pk r_p. There are two choices of D:

    nodes       D = 1: one point per node,
    weighted    D_pk = int psi_p N_k dA / int psi_p dA: one point per end of an edge, or per corner of a face.

psi_p are the functions that are linear along each edge and on each triangle, bilinear on each square, 1 at p and 0 at
the other ends. dA is the area at rest (of the ring on a meridian), and int is Gauss' rule of :mod:`bipot.fem.surface`,
exact on straight facets with centred middle nodes. A pressure p = sum_p p_p psi_p gives the nodal forces
int p N_k dA = sum_p D_pk r_p with r_p = p_p int psi_p dA. The law for r_p is thus the law for the pressure at p and, by
convexity, between the points. On quadratic facets there are fewer points than nodes, which is a stable pair, and
pressures do not alternate from corner to mid-side. The nodal forces of a uniform pressure pull at the corners of a face
of eight nodes and are zero at the corners of one of six, but int psi_p dA is positive at all points. Between the points
the gap may be negative at some places and positive at others (:mod:`bipot.contact.overlap`).

On linear edges psi_p are the dual functions, int psi_p N_k dA = 0 for k other than p: weighted gaps are those of the
nodes, and both choices are the same. On linear faces the points are always the nodes: hat functions in place of dual
functions would give the same forces r for closed contacts, but pressures M^-1 r, M_ij = int N_i N_j dA, whose
alternating part is up to nine times that of r_p / int N_p dA.

Facets that continue into each other at their ends (:mod:`bipot.tools.fans`) share a point there. A mean around such an
end stops where the boundary turns by more than :data:`~bipot.tools.fans.CREASE`. At a corner of the body with one side
on the tool and the other going up, each side has its own point. So have a side and its mirror image beyond a plane of
symmetry if they form a crease there, and all facets where parts of the body touch (at one node in a plane, along one
edge in space).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.sparse as sp

from bipot.fem.reduction import Geometry
from bipot.fem.surface import facet_mass
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.tools.deformable import Faced
from bipot.tools.fans import CREASE, beside, fans, twice
from bipot.tools.flats import away, normals
from bipot.tools.surfaces import ACROSS
from bipot.tools.tool import Sampling, Tool
from bipot.typing import Bools, Floats, Ints, Vector, read_only


@dataclass(frozen=True)
class Points:
    """Points (p,) of a tool's boundaries.

    They are at the nodes ``node`` (p,) with the ``weights`` D (p, a); ``point`` (f, k) are the points and ``facets``
    (f, n) the nodes of each facet of the boundaries, between parts of each flat part of one. What they have ``faced``
    at a deformable tool is None for others.
    """

    node: Ints
    weights: sp.csr_matrix
    point: Ints
    facets: Ints
    faced: Faced | None = None

    @property
    def farther(self) -> Floats:
        """How much farther off (p,) than they are deformable tools are felt; zero of others."""
        return np.zeros(len(self.node)) if self.faced is None else self.faced.farther

    @property
    def weighted(self) -> bool:
        """Whether they are means of several nodes."""
        return self.point.shape[1] < self.facets.shape[1]

    @property
    def in_means(self) -> bool:
        """Whether contact is posed in means at these points, of several nodes or between parts."""
        return self.weighted or self.faced is not None

    def areas(self, nodes: Floats, geometry: Geometry) -> Floats:
        """The area (f, k) of each facet that each of its points stands for, with the ``nodes`` at (a, d)."""
        return (hat_areas if self.weighted else nodal_areas)(nodes, self.facets, geometry)


def points(mesh: Mesh, geometry: Geometry, tool: Tool) -> Points:
    """Where contact with the tool is posed."""
    facets = mesh.edges(*tool.candidates)
    if tool.sampling is Sampling.NODES or not mesh.element.quadratic:
        node, point = np.unique(facets, return_inverse=True)
        count, one = len(node), np.ones(len(node))
        weights = sp.csr_matrix((one, node, np.arange(count + 1)), shape=(count, len(mesh.nodes)))
        return Points(node, weights, point.reshape(facets.shape), facets)
    point, node = ends_of(mesh.nodes, facets, mesh.element.ends)
    shares = hats(facets.shape[1], mesh.dimension) @ facet_mass(mesh.nodes, facets, geometry)
    row, column = np.broadcast_arrays(point[:, :, None], facets[:, None, :])
    shape = len(node), len(mesh.nodes)
    weights = sp.csr_matrix((shares.ravel(), (row.ravel(), column.ravel())), shape=shape)
    weights.sum_duplicates()
    weights.data /= np.repeat(np.asarray(weights.sum(axis=1)).ravel(), np.diff(weights.indptr))
    # On a straight edge the weight of the far end is round-off of zero.
    weights.data[np.abs(weights.data) <= ACROSS] = 0.0
    weights.eliminate_zeros()
    return Points(node, weights, point, facets)


@cache
def hats(count: int, dimension: int) -> Floats:
    """psi_k at the nodes (k, n) of quadratic facets of n = ``count`` nodes, in ``dimension`` d: psi = sum_n psi_kn N_n.

    >>> hats(3, 2).tolist()
    [[1.0, 0.5, 0.0], [0.0, 0.5, 1.0]]
    """
    if dimension == 2:
        return read_only([[1.0, 0.5, 0.0], [0.0, 0.5, 1.0]], np.float64)
    face = Element.of(count)
    out = np.eye(face.corners, count)
    out[face.edges[:, [0, 2]], face.edges[:, [1]]] = 0.5
    return read_only(out, np.float64)


def hat_areas(nodes: Floats, facets: Ints, geometry: Geometry) -> Floats:
    """int psi_k dA (f, k) for the ends of quadratic ``facets`` (f, n).

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> hat_areas(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN).tolist()
    [[0.5, 0.5]]
    """
    return facet_mass(nodes, facets, geometry).sum(axis=2) @ hats(facets.shape[1], nodes.shape[1]).T


def nodal_areas(nodes: Floats, facets: Ints, geometry: Geometry) -> Floats:
    """The nodes' shares (f, n) of the areas of ``facets`` (f, n), none of them negative.

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> (6 * nodal_areas(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN)).round(12)
    array([[1., 4., 1.]])
    """
    signed = facet_mass(nodes, facets, geometry).sum(axis=2)
    part = np.maximum(signed, 0.0)
    whole = part.sum(axis=1)
    return part * np.divide(signed.sum(axis=1), whole, out=np.zeros_like(whole), where=whole > 0)[:, None]


def ends_of(nodes: Floats, facets: Ints, ends: Ints) -> tuple[Ints, Ints]:
    """Points (f, k) at the ``ends`` (k,) of quadratic facets (f, n), one for each fan, and their nodes (p,), sorted."""
    node = facets[:, ends]
    if nodes.shape[1] == 2:
        # Edges that continue straight leave their node in opposite directions.
        (one, other), way = twice(node.reshape(-1, 1)), away(nodes[facets]).reshape(-1, 2)
        return fans(node, one, other, -np.vecdot(way[one], way[other]))
    (one, other), normal = beside(node), normals(nodes[facets]).reshape(-1, 3)
    return fans(node, one, other, np.vecdot(normal[one], normal[other]))


def beyond(nodes: Floats, facets: Ints, inside: Bools, normal: Vector) -> Bools:
    """Whether ends (f, k) of quadratic ``facets`` continue into their mirror images in a plane of symmetry.

    The nodes ``inside`` (a,) are in the plane, which has the unit ``normal``. In space a face continues across an edge
    in the plane; the mirror image of a face with a single corner there is no neighbour.
    """
    s = np.array(normal)
    # A unit vector w, along an edge or normal to a face, and its mirror image w' have w . w' = 1 - 2 (s . w)^2.
    if nodes.shape[1] == 2:
        return np.asarray(2 * (away(nodes[facets]) @ s) ** 2 - 1 >= CREASE)
    corner = inside[facets[:, : facets.shape[1] // 2]]
    along = corner & (np.roll(corner, 1, axis=1) | np.roll(corner, -1, axis=1))
    return np.asarray(along & (1 - 2 * (normals(nodes[facets]) @ s) ** 2 >= CREASE))
