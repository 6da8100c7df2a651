"""Plots of meshes and curves given as arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bipot.errors import require, require_number
from bipot.meshes.elements import Element
from bipot.meshes.facets import Facets
from bipot.typing import Floats, Ints

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D
    from matplotlib.quiver import Quiver


def curved(nodes: Floats, edges: Ints, pieces: int = 8) -> Floats:
    """Points (f, pieces + 1, 2) along the parabolas through the edges (f, 3), or along straight ones (f, 2)."""
    x = np.linspace(0.0, 1.0, pieces + 1)[:, None]
    start, end = nodes[edges[:, None, 0]], nodes[edges[:, None, -1]]
    middle = nodes[edges[:, None, 1]] if edges.shape[1] == 3 else (start + end) / 2
    return start + x * (4 * middle - 3 * start - end) + 2 * x**2 * (start - 2 * middle + end)


def mesh(nodes: Floats, elements: Ints, ax: Axes | None = None, **style: Any) -> LineCollection:
    """The edges of plane elements (e, k) between nodes (a, 2), with their curvature; ``style`` is matplotlib's."""
    _require_plane(nodes, elements, "elements", "(e, k), as mesh.elements", "node numbers")
    edges = Facets.of(elements, Element.of(elements.shape[1])).nodes
    lines = boundary(nodes, edges, ax, **{"color": "0.6", "lw": 0.5, **style})
    axes_of(ax).autoscale_view()
    return lines


def boundary(nodes: Floats, edges: Ints, ax: Axes | None = None, **style: Any) -> LineCollection:
    """The edges (f, n) of a boundary between nodes (a, 2), with their curvature."""
    from matplotlib.collections import LineCollection

    _require_plane(nodes, edges, "edges", "(f, n), as mesh.outline or mesh.boundary(name)", "node numbers")
    lines = LineCollection(list(curved(nodes, edges)), **{"color": "black", "lw": 1.2, **style})
    axes_of(ax).add_collection(lines)
    return lines


def vectors(nodes: Floats, values: Floats, ax: Axes | None = None, length: float = 1.0, **style: Any) -> Quiver:
    """Nodal vectors ``values`` (a, 2) at the nodes (a, 2); a unit vector has the ``length``, in data units."""
    _require_plane(nodes, values, "values", "(a, 2), one at each node", "vectors")
    require(np.shape(values) == np.shape(nodes), "values", f"shape {np.shape(values)}", f"{np.shape(nodes)}, as nodes")
    require_number(length, "length")
    kept = {"width": 0.002, "headwidth": 3.5, "headlength": 4.5, "headaxislength": 4.0, "zorder": 3, **style}
    scaled = values * length
    return axes_of(ax).quiver(*nodes.T, *scaled.T, angles="xy", scale_units="xy", scale=1.0, **kept)


def force_stroke(stroke: Floats, force: Floats, ax: Axes | None = None, **style: Any) -> Line2D:
    """Force over stroke, both (n,), from the origin."""
    require(
        np.shape(force) == np.shape(stroke), "force", f"shape {np.shape(force)}", f"one a stroke, {np.shape(stroke)}"
    )
    (line,) = axes_of(ax).plot(np.append(0.0, stroke), np.append(0.0, force), **style)
    return line


def _require_plane(nodes: object, rows: object, field: str, kind: str, what: str) -> None:
    """Refuse ``nodes`` that are no positions in a plane, and ``rows`` that are no array of rows."""
    flat = isinstance(nodes, np.ndarray) and nodes.ndim == 2 and nodes.shape[1] == 2
    require(flat, "nodes", nodes, "an array of positions (a, 2), as state.nodes of a body in a plane")
    array = isinstance(rows, np.ndarray) and rows.ndim == 2
    require(array, field, rows, f"an array of {what} {kind}")


def axes_of(ax: Axes | None) -> Axes:
    """The axes given, or the current ones of pyplot, which is imported only then."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.gca()
