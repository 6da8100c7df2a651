r"""Conformal motions: those whose strain is a change of volume alone, of which means over elements may see none.

In space

    v = (b . x) x - (x . x) b/2,    e = (b . x) 1,

is one for any b. It is quadratic, and the volume change tr e = 3 b . x is linear. Where it is projected on constants
its mean over an element is that in the element's middle, and with the origin in a plane that has the middles of all
elements and the normal b there is none. So one to three tetrahedra have such motions, and so have the six of a cube.
Of what the volume change of these motions costs, elements of volumes V with middles c keep at least the part

    min over b of  sum V (b . (c - o))^2 / int (b . (x - o))^2 dx,    o the middle of all.

It is found for an element with those that share a corner with it: a row of single cubes on a large body has such
motions by itself. On a meridian b is along the axis, and in a plane the strain e = (b . x) 1 has a component across it,
which is none.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from bipot.fem.reduction import Geometry
from bipot.meshes.mesh import Mesh
from bipot.typing import Floats, Ints, einsum

WAYS = {Geometry.SOLID: slice(None), Geometry.AXISYMMETRIC: slice(1, 2), Geometry.PLANE_STRAIN: slice(0)}
"""Along which coordinates b may be."""

FLAT = 1e-14
"""Of a second moment, over the largest of the same body, what is no more than round-off."""


def kept_by_means(mesh: Mesh, geometry: Geometry) -> Floats:
    """The parts (e,) that triangles or tetrahedra keep with their neighbours, by straight sides; one without a b.

    >>> from bipot.meshes.elements import Element
    >>> from bipot.meshes.solids import brick
    >>> cubes = (brick(1.0, 1.0, n, 1, 1, n, element=Element.T10) for n in (1, 2))
    >>> [abs(round(float(kept_by_means(cube, Geometry.SOLID).min()), 3)) for cube in cubes]
    [0.0, 0.203]
    """
    ways = range(mesh.dimension)[WAYS[geometry]]
    corners = mesh.elements[:, : mesh.element.corners]
    if not ways:
        return np.ones(len(corners))
    x = (mesh.nodes[corners] - mesh.nodes.mean(axis=0)) / mesh.size
    middle = x.mean(axis=1)
    volume = np.abs(np.linalg.det(x[:, 1:] - x[:, :1]))
    if geometry is Geometry.AXISYMMETRIC:
        volume = volume * mesh.nodes[corners, 0].mean(axis=1)
    x, middle = x[..., list(ways)], middle[:, list(ways)]
    off, count = x - middle[:, None], corners.shape[1]
    inside = einsum("e,eki,ekj->eij", volume / (count * (count + 1)), off, off)
    beside = _beside(corners)
    whole, first = beside @ volume, beside @ (volume[:, None] * middle)
    second = beside @ einsum("e,ei,ej->eij", volume, middle, middle).reshape(len(middle), -1)
    between = second.reshape(inside.shape) - einsum("ei,ej,e->eij", first, first, 1 / whole)
    every = between + (beside @ inside.reshape(len(inside), -1)).reshape(inside.shape)
    part, along = np.linalg.eigh(every)
    # Of a body so flat that round-off decides, what it keeps across its plane comes out as too little.
    over = along / np.sqrt(np.maximum(part, FLAT * part[:, -1:]))[:, None]
    least: Floats = np.linalg.eigh(over.transpose(0, 2, 1) @ between @ over)[0]
    return least[:, 0]


def _beside(corners: Ints) -> sp.csr_matrix:
    """Which elements (e, e) share a corner, of elements' ``corners`` (e, n), themselves included: ones."""
    count, width = corners.shape
    own = sp.csr_matrix((np.ones(corners.size), corners.ravel(), width * np.arange(count + 1)))
    shared = sp.csr_matrix(own @ own.T)
    shared.data[:] = 1.0
    return shared
