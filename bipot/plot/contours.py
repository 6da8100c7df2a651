"""Fields in colours on the deformed body: of a run, with its tools, or of an accepted increment, element by element.

Contact tractions of a run are drawn along the surface of the deformed body.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bipot.control.accepted import Accepted
from bipot.errors import require, require_count, require_number, require_type
from bipot.fem.elements import tabulated_at
from bipot.fem.reduction import Geometry
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.plot.lines import axes_of, boundary
from bipot.results import History
from bipot.results.fields import NO_CANDIDATE
from bipot.results.history import REDUCTION
from bipot.results.names import AXES, Place, Quantity, Rank, meant, unit_of
from bipot.results.snapshot import Snapshot
from bipot.tools.tool import Sampling
from bipot.typing import Floats, Ints, as_numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection, PolyCollection, TriMesh
    from matplotlib.lines import Line2D

PIECES = 4
"""Pieces into which the side of an element is divided, for curved sides and fields."""

SHRUNK = 0.8
"""Height of the colour bar over that of the axes, because the body is seldom as high as these."""

UPRIGHT = 1e-9
"""A surface whose ends are no farther apart across than this, over the size of the body, is upright."""

THIN = 0.8
"""Width of the lines between regions, in points; the outline's is 1.2."""

MARGIN = 0.08
"""Margin around the body over its size."""


def contour(
    result: History,
    field: str = "mises",
    at: float | None = None,
    ax: Axes | None = None,
    *,
    by: str | None = None,
    limits: tuple[float, float] | None = None,
    colorbar: bool = True,
    **style: Any,
) -> TriMesh:
    """Draw a nodal ``field`` of a run on the deformed body, with its outline, its tools and a bar of colours.

    Thin lines run between elements of different regions; the colours there are means of both sides (:func:`body` has
    those of each element).

    ``at`` is as in :meth:`~bipot.results.History.at`: a reduction or pseudo-time, or a value of the column ``by``;
    None is the last step. ``field`` may be a component, "stress_zz"; of a vector the magnitude is drawn. Between nodes
    the field follows the element's shape functions. ``limits`` are those of the colours; ``style`` is matplotlib's and
    has precedence.

    Raises:
        SceneError: an unknown field, one that is not defined on the whole body, a tensor as a whole, a value that is
            not recorded; limits that are no range; no opened run, a body in space.
    """
    require_plane(result)
    if limits is not None:
        _require_limits(limits)
    snapshot = result.at(at, by)
    values = nodal_values(snapshot, field)
    axes = axes_of(ax)
    mesh, nodes = result.mesh, snapshot.nodes
    points, triangles = tessellation(mesh.element)
    shapes = tabulated_at(mesh.element, points).values
    x, y = (shapes @ nodes[mesh.elements]).reshape(-1, 2).T
    fine = (shapes @ values[mesh.elements][..., None]).ravel()
    corners = (triangles + len(points) * np.arange(len(mesh.elements))[:, None, None]).reshape(-1, 3)
    low, high = limits or (float(fine.min()), float(fine.max()))
    coloured: Any = axes.tripcolor  # Its overloads lack colours of nodes as a positional argument.
    usual = {"cmap": "viridis", "shading": "gouraud", "vmin": low, "vmax": high}
    drawn = coloured(x, y, corners, fine, **usual | style)
    boundary(nodes, mesh.outline, axes)
    _interfaces(mesh, nodes, axes)
    tools(snapshot, axes)
    frame(axes, result, nodes)
    axes.set_title(moment(result, snapshot))
    if colorbar:
        _, known, part = meant(Place.NODES, field, result.geometry)
        name = f"|{field}|" if known.rank is Rank.VECTOR and not part else field
        unit = "" if known.quantity is Quantity.RATIO else f" ({_unit(result, known.quantity)})"
        axes.figure.colorbar(drawn, ax=axes, label=name + unit, shrink=SHRUNK)
    return drawn


def _interfaces(mesh: Mesh, nodes: Floats, axes: Axes) -> None:
    """Thin lines between elements of different regions, if there are any."""
    if len(mesh.interfaces):
        boundary(nodes, mesh.interfaces, axes, lw=THIN)


def tools(snapshot: Snapshot, ax: Axes | None = None, **style: Any) -> LineCollection:
    """Draw the lines of the tools in a step; the axes keep their limits."""
    from matplotlib.collections import LineCollection

    lines = LineCollection([line.points for line in snapshot.tools], **{"color": "tab:red", "lw": 1.8, **style})
    axes_of(ax).add_collection(lines, autolim=False)
    return lines


def moment(result: History, snapshot: Snapshot) -> str:
    """The step in words: by increment and reduction if the run has it, else by its pseudo-time.

    In a run that begins in the middle of a march, increments count on, but steps count from zero.
    """
    reductions = result.columns.get(REDUCTION)
    if reductions is not None and reductions.dtype.kind in "fiu" and snapshot.step > 0:
        return f"increment {snapshot.course.number}, reduction {100 * reductions[snapshot.step - 1]:.4g} %"
    return f"step {snapshot.step}, tau = {snapshot.tau:.4g}"


def _unit(result: History, quantity: Quantity) -> str:
    return unit_of(quantity, result.units, result.geometry)


def require_plane(result: History) -> None:
    """Refuse anything but an opened run of a plane body."""
    require(isinstance(result, History), "result", result, "a History, as bipot.results.open(folder) gives it")
    flat = result.geometry is not Geometry.SOLID
    require(
        flat, "result", result.geometry, "of a body in a plane: ParaView and PyVista draw run.vtkhdf of one in space"
    )


@cache
def tessellation(element: Element) -> tuple[Floats, Ints]:
    """Points (p, 2) on the reference shape of a plane element, and the triangles (t, 3) between them.

    >>> [len(part) for part in tessellation(Element.T3)]
    [15, 16]
    """
    from scipy.spatial import Delaunay

    points = element.grid(PIECES + 1)
    return points, Delaunay(points).simplices.astype(np.intp)


def nodal_values(snapshot: Snapshot, field: str) -> Floats:
    """The drawn values of a field at the nodes (a,); raises SceneError as :func:`contour`."""
    base, known, part = meant(Place.NODES, field, snapshot.geometry)
    everywhere = known.finite and known.quantity is not Quantity.STATUS
    require(everywhere, "field", field, "one of the whole body; contact_traction(), or --traction, draws the others")
    if known.rank is Rank.TENSOR and not part:
        require(False, "field", field, f"a component, as in {base}_{snapshot.points(base).names[0]}")
    values = snapshot.nodal(field)
    return np.linalg.norm(values, axis=1) if values.ndim == 2 else values


def _require_limits(limits: object) -> None:
    pair = isinstance(limits, tuple | list) and len(limits) == 2
    require(pair, "limits", limits, "two numbers, the least and the largest of the colours")
    low, high = limits  # type: ignore[misc]
    for value in (low, high):
        require_number(value, "limits")
    require(-np.inf < low <= high < np.inf, "limits", limits, "finite and in rising order")


def frame(axes: Axes, result: History, nodes: Floats) -> None:
    """Set the limits of the axes by the body's ``nodes`` (a, d) alone, because tools may be infinite."""
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    margin = MARGIN * float((high - low).max())
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal")
    across, up = (f"{axis} ({_unit(result, Quantity.LENGTH)})" for axis in AXES[result.geometry])
    axes.set(xlabel=across, ylabel=up)


def body(
    accepted: Accepted, values: Floats, ax: Axes | None = None, label: str = "", shrink: float = 1.0, **style: Any
) -> PolyCollection:
    """Draw the deformed plane elements with straight edges, coloured by their ``values`` (e,).

    A ``label`` adds a colour bar, whose size over that of the axes is ``shrink``. Thin black lines run between elements
    of different regions. ``style`` is matplotlib's.

    Raises:
        SceneError: no increment, a body in space, values that are not one an element.
    """
    from matplotlib.collections import PolyCollection

    require_type(accepted, Accepted, "accepted")
    values, mesh = as_numbers(values, "values"), accepted.scene.mesh
    require(mesh.dimension == 2, "mesh.dimension", mesh.dimension, "2: use pyvista in space")
    require(values.shape == mesh.elements.shape[:1], "values", f"shape {values.shape}", "one number an element")
    corners = accepted.state.nodes[mesh.elements[:, : mesh.element.corners]]
    axes = axes_of(ax)
    faces = PolyCollection(list(corners), array=values, **{"edgecolor": "0.6", "lw": 0.4, **style})
    axes.add_collection(faces)
    _interfaces(mesh, accepted.state.nodes, axes)
    axes.autoscale_view()
    if label:
        axes.figure.colorbar(faces, ax=axes, label=label, shrink=shrink)
    return faces


def contact_traction(
    result: History, at: float | None = None, ax: Axes | None = None, *, tool: int = 0, by: str | None = None
) -> tuple[Line2D, Line2D]:
    """Draw pressure and shear at the candidates of a tool over the arc of the body's surface, as (pressure, shear).

    ``at`` and ``by`` are those of :meth:`~bipot.results.History.at`. The arc is that of the deformed surface along the
    boundaries that may touch the tool. In all steps it begins at the end that at rest is nearer to the axis or farther
    to the left; on an upright surface at the lower end. Shear is positive along (n_y, -n_x), n from the tool into the
    body. Nodes off the contact line, as where a weld pulls, or held by a support have no traction, and the lines end
    there. If no edge is on the line, as with a single node in contact, the picture says so; tractions of a start that
    carries forces are not known. Where another tool presses a node more, the traction is of that one: lines end there.

    Raises:
        SceneError: a ``tool`` that the run has not, a value that is not recorded, no opened run, a body in space.
    """
    require_plane(result)
    count = len(result.tools)
    require_count(tool, "tool", 0)
    require(tool < count, "tool", tool, f"in [0, {count}), the run's tools")
    snapshot, axes = result.at(at, by), axes_of(ax)
    nodes, shown, about = snapshot.nodes, snapshot.nodal("status") != NO_CANDIDATE, result.tools[tool]
    # Nodes that supports hold are shown, so that lines end there. Means have no points at the middle of edges.
    edges = result.mesh.edges(*about["candidates"])
    shown[edges[:, [0, -1]] if about.get("sampling") == Sampling.WEIGHTED else edges] = True
    paths = [path[shown[path]] for path in chains(result.mesh, about["candidates"])]
    touched, arcs = snapshot.touched, _arcs(paths, nodes)
    others = (touched != NO_CANDIDATE) & (touched != tool)
    drawn = []
    for name, style in (("contact_pressure", "o-"), ("contact_shear", "s--")):
        values = np.where(others, np.nan, snapshot.nodal(name))
        # NaN separates the lines of two parts of the surface.
        x = np.concatenate([np.append(arc, np.nan) for arc in arcs])
        y = np.concatenate([np.append(values[path], np.nan) for path in paths])
        (line,) = axes.plot(x, y, style, ms=3, lw=1.2, label=name.removeprefix("contact_"))
        drawn.append(line)
    if not np.isfinite(drawn[0].get_ydata()).any():
        # Step 0 has the forces of a state that a run begins at, but no tractions (bipot.results.fields).
        begun = snapshot.step == 0 and snapshot.nodal("contact_force").any()
        words = "tractions of the start are not known" if begun else "no edge of the surface is pressed"
        axes.text(0.5, 0.6, words, ha="center", transform=axes.transAxes)
    length, stress = (_unit(result, quantity) for quantity in (Quantity.LENGTH, Quantity.STRESS))
    axes.set(xlabel=f"arc along the surface ({length})", ylabel=f"traction ({stress})", title=moment(result, snapshot))
    axes.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    axes.legend()
    return drawn[0], drawn[1]


def chains(mesh: Mesh, names: list[str]) -> list[Ints]:
    """Nodes in sequence along the boundaries ``names``: one array for each connected part.

    Each begins at the end with the smaller first coordinate at rest, an upright one at the lower end, a closed one
    anywhere.
    """
    edges = np.unique(mesh.around(*names), axis=0)
    ahead = {int(edge[0]): edge for edge in edges}
    begins = sorted(set(ahead) - set(edges[:, -1].tolist())) or sorted(ahead)[:1]
    found = []
    for begin in begins:
        path, node = [begin], begin
        while node in ahead:
            edge = ahead.pop(node)
            path += edge[1:].tolist()
            node = int(edge[-1])
        first, last = mesh.nodes[path[0]], mesh.nodes[path[-1]]
        k = int(abs(first[0] - last[0]) <= UPRIGHT * mesh.size)
        found.append(np.array(path if first[k] <= last[k] else path[::-1]))
    return found


def _arcs(paths: list[Ints], nodes: Floats) -> list[Floats]:
    """Arcs (p,) of the nodes of each path, which begin where those of the path before end."""
    arcs, begin = [], 0.0
    for path in paths:
        steps = np.linalg.norm(np.diff(nodes[path], axis=0), axis=1)
        arcs.append(begin + np.concatenate([[0.0], np.cumsum(steps)]))
        begin = float(arcs[-1][-1])
    return arcs
