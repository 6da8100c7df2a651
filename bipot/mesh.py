"""Meshes with named boundaries: eight-node quadrilaterals on rectangles, made with scikit-fem.

A mesh is a frozen value. Nodes are (a, d), elements (e, 8) in the order *four corners, four mid-sides* (mid-side
``k`` lies between corners ``k`` and ``k + 1``), and a boundary is an array of edges (f, 3): end, middle, end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import skfem
from numpy.typing import NDArray

from bipot.errors import require

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Mesh:
    """Nodes (a, d), elements (e, 8) and named boundaries, each an array of edges (f, 3).

    Raises:
        SceneError: a coordinate is not finite, a boundary is empty, or an index is outside the node list.
    """

    nodes: Floats
    elements: Ints
    boundaries: Mapping[str, Ints] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.nodes)
        require(bool(np.isfinite(self.nodes).all()), "mesh.nodes", "NaN or infinite", "finite")
        require(len(self.elements) > 0, "mesh.elements", len(self.elements), "at least one element")
        for name, connectivity in {"elements": self.elements, **self.boundaries}.items():
            require(connectivity.size > 0, f"mesh boundary {name!r}", "empty", "at least one edge")
            inside = connectivity.min() >= 0 and connectivity.max() < count
            require(bool(inside), f"mesh {name!r} node index", int(connectivity.max()), f"in [0, {count})")

    def boundary(self, name: str) -> Ints:
        """Edges (f, 3) of the boundary ``name``; raises SceneError naming the known ones."""
        require(name in self.boundaries, "boundary", name, f"one of {sorted(self.boundaries)}")
        return self.boundaries[name]

    def boundary_nodes(self, *names: str) -> Ints:
        """Sorted node numbers on the union of the named boundaries."""
        return np.unique(np.concatenate([self.boundary(name).ravel() for name in names]))

    @cached_property
    def size(self) -> float:
        """Largest extent of the mesh along an axis: the body size that scales lengths."""
        return float(np.ptp(self.nodes, axis=0).max())


def cylinder(radius: float, height: float, n_r: int, n_z: int) -> Mesh:
    """Meridian half-section [0, radius] x [0, height] with boundaries axis, base, top, side.

    >>> cylinder(5.0, 5.0, 2, 2).elements.shape
    (4, 8)
    """
    _require_sizes(radius=radius, height=height)
    return _rectangle((0.0, radius), (0.0, height), (n_r, n_z), ("axis", "side", "base", "top"))


def block(width: float, height: float, n_x: int, n_y: int) -> Mesh:
    """Rectangle [0, width] x [0, height] with boundaries left, right, base, top."""
    _require_sizes(width=width, height=height)
    return _rectangle((0.0, width), (0.0, height), (n_x, n_y), ("left", "right", "base", "top"))


def ring(inner: float, outer: float, height: float, n_r: int, n_z: int) -> Mesh:
    """Meridian section [inner, outer] x [0, height] with boundaries bore, side, base, top."""
    _require_sizes(inner=inner, height=height)
    require(inner < outer < np.inf, "outer", outer, f"finite and > inner = {inner}")
    return _rectangle((inner, outer), (0.0, height), (n_r, n_z), ("bore", "side", "base", "top"))


def _rectangle(
    x: tuple[float, float], y: tuple[float, float], counts: tuple[int, int], names: tuple[str, str, str, str]
) -> Mesh:
    """Tensor mesh of Q8; ``names`` are those of the sides x0, x1, y0, y1."""
    for count, axis in zip(counts, ("first", "second"), strict=True):
        require(count >= 1, f"elements along the {axis} axis", count, ">= 1")
    quads = skfem.MeshQuad.init_tensor(np.linspace(*x, counts[0] + 1), np.linspace(*y, counts[1] + 1))
    corners = quads.p.T
    ends = quads.facets.T
    nodes = np.vstack([corners, corners[ends].mean(axis=1)])
    # scikit-fem numbers a tensor mesh's quads clockwise: reversed, the first reference axis is the first of space.
    elements = np.hstack([quads.t.T[:, [0, 3, 2, 1]], len(corners) + quads.t2f.T[:, ::-1]])
    middle = nodes[len(corners) :]
    on_side = {
        names[0]: middle[:, 0] == x[0],
        names[1]: middle[:, 0] == x[1],
        names[2]: middle[:, 1] == y[0],
        names[3]: middle[:, 1] == y[1],
    }
    boundaries = {}
    for name, chosen in on_side.items():
        edge = np.flatnonzero(chosen)
        boundaries[name] = np.column_stack([ends[edge, 0], len(corners) + edge, ends[edge, 1]])
    return Mesh(nodes, elements.astype(np.intp), boundaries)


def _require_sizes(**sizes: float) -> None:
    for name, value in sizes.items():
        require(0 < value < np.inf, name, value, "finite and > 0")
