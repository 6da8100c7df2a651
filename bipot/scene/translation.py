"""The translation of a body that its supports carry: the nearest one to what they prescribe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import null_space

from bipot.fem.surface import facet_weights
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.typing import Floats, Vector

ROUND_OFF = 1e-12
"""A unit vector whose part within the planes is no longer than this is normal to them."""

LITTLE = 1e-9
"""The least weight of a support over the largest: an axis, which has no area, may be all that is held."""


def prescribed(scene: Scene, supports: Sequence[Support], begin: float, end: float) -> Floats:
    """The translation (d,) within all planes of symmetry nearest to what ``supports`` prescribe from begin to end.

    Planes of symmetry among these do not count, and the others by the areas that they hold.
    """
    supports = [support for support in supports if not isinstance(support, Symmetry)]
    if not supports:
        return np.zeros(scene.mesh.dimension)
    ways = np.array([support.along(scene.mesh.dimension) for support in supports])
    asked = np.array([support.at(end) - support.at(begin) for support in supports])
    return nearest(ways, asked, areas(scene, supports), scene.directions.planes)


def areas(scene: Scene, supports: Sequence[Support]) -> Floats:
    """The areas (s,) at rest of the modelled part that ``supports`` hold, over the largest.

    Half of an area within a plane of symmetry belongs to the mirror image.
    """
    mesh, out = scene.mesh, np.zeros(len(supports))
    for k, support in enumerate(supports):
        x = mesh.nodes[mesh.boundary_nodes(support.boundary)]
        within = sum(bool(plane.holds(x).all()) for plane in scene.planes)
        out[k] = facet_weights(mesh.nodes, mesh.boundaries[support.boundary], scene.geometry).sum() / 2**within
    largest = float(out.max())
    return np.maximum(out / largest, LITTLE) if largest > 0 else np.ones_like(out)


def nearest(ways: Floats, asked: Floats, weight: Floats, planes: Sequence[Vector] | Floats) -> Floats:
    """The v (d,) parallel to ``planes``, given by normals, with components along ``ways`` (s, d) nearest to ``asked``.

    It minimises sum_i weight_i (ways_i . v - asked_i)^2 and is the shortest of all minimisers.

    >>> nearest(np.eye(2), np.array([2.0, 3.0]), np.ones(2), [(1.0, 0.0)]).tolist()
    [0.0, 3.0]
    """
    basis = null_space(np.vstack([np.zeros(ways.shape[1]), *planes]))
    left, root = ways @ basis, np.sqrt(weight)
    left = root[:, None] * np.where(np.abs(left) > ROUND_OFF, left, 0.0)
    return np.asarray(basis @ np.linalg.lstsq(left, root * asked)[0])
