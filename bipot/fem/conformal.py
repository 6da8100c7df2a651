r"""Conformal motions: those whose strain is a change of volume alone, of which means over elements may see none.

In space

    v = (b . x) x - (x . x) b/2,    e = (b . x) 1,

is one for any b. It is quadratic, and the volume change tr e = 3 b . x is linear. Where it is projected on constants
its mean over an element is that in the element's middle, and with the origin in a plane that has the middles of all
elements and the normal b there is none. So one to three tetrahedra have such motions, and so have the six of a cube.
Of what the volume change of these motions costs, elements of volumes V with middles c keep at least the part

    min over b of  sum V (b . (c - o))^2 / int (b . (x - o))^2 dx,    o the middle of all.

On a meridian b is along the axis, and in a plane the strain e = (b . x) 1 has a component across it, which is none.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigvalsh

from bipot.fem.reduction import Geometry
from bipot.meshes.mesh import Mesh
from bipot.typing import Floats

WAYS = {Geometry.SOLID: slice(None), Geometry.AXISYMMETRIC: slice(1, 2), Geometry.PLANE_STRAIN: slice(0)}
"""Along which coordinates b may be."""


def kept_by_means(mesh: Mesh, geometry: Geometry) -> float:
    """The part that a mesh of triangles or tetrahedra keeps, by its straight sides; one where no b is possible.

    >>> from bipot.meshes.elements import Element
    >>> from bipot.meshes.solids import brick
    >>> cubes = (brick(1.0, 1.0, n, 1, 1, n, element=Element.T10) for n in (1, 2))
    >>> [abs(round(kept_by_means(cube, Geometry.SOLID), 3)) for cube in cubes]
    [0.0, 0.203]
    """
    ways = range(mesh.dimension)[WAYS[geometry]]
    if not ways:
        return 1.0
    x = mesh.nodes[mesh.elements[:, : mesh.element.corners]]
    middle = x.mean(axis=1)
    volume = np.abs(np.linalg.det(x[:, 1:] - x[:, :1]))
    if geometry is Geometry.AXISYMMETRIC:
        volume = volume * middle[:, 0]
    between = _second(volume, middle - np.average(middle, axis=0, weights=volume), ways)
    count = mesh.element.corners
    off = (x - middle[:, None]).reshape(-1, mesh.dimension)
    inside = _second(np.repeat(volume / (count * (count + 1)), count), off, ways)
    return float(eigvalsh(between, between + inside)[0])


def _second(weights: Floats, x: Floats, ways: range) -> Floats:
    """sum w x x' (k, k) of the coordinates ``ways`` of points x (n, d)."""
    some = x[:, list(ways)]
    return some.T @ (weights[:, None] * some)
