"""Contact tractions of a run along the surface of the deformed body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bipot.errors import require, require_count
from bipot.meshes.mesh import Mesh
from bipot.plot.contours import moment, require_plane
from bipot.plot.lines import axes_of
from bipot.results import History
from bipot.results.fields import NO_CANDIDATE
from bipot.results.names import Quantity, unit_of
from bipot.typing import Floats, Ints

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


def contact_traction(
    result: History, at: float | None = None, ax: Axes | None = None, *, tool: int = 0, by: str | None = None
) -> tuple[Line2D, Line2D]:
    """Draw pressure and shear at the candidates of a tool over the arc of the body's surface, as (pressure, shear).

    ``at`` and ``by`` are those of :meth:`~bipot.results.History.at`. The arc is that of the deformed surface along the
    boundaries that may touch the tool, from the end that is nearer to the axis or farther to the left. Shear is
    positive along (n_y, -n_x), n from the tool into the body. Nodes off the contact line have no traction, and the
    lines end there. Where no edge is on it, as with a single node in contact, the picture says so. A node that two
    tools share has the traction of the one that pushes harder.

    Raises:
        SceneError: a number that is no tool's, a value that is not recorded, no opened run, a body in space.
    """
    require_plane(result)
    count = len(result.scene["tools"])
    require_count(tool, "tool", 0)
    require(tool < count, "tool", tool, f"in [0, {count}), the run's tools")
    snapshot, axes = result.at(at, by), axes_of(ax)
    nodes, known = snapshot.nodes, snapshot.nodal("status") != NO_CANDIDATE
    names = result.scene["tools"][tool]["candidates"]
    paths = [path[known[path]] for path in chains(result.mesh, names, nodes)]
    arcs = _arcs(paths, nodes)
    drawn = []
    for name, style in (("contact_pressure", "o-"), ("contact_shear", "s--")):
        values = snapshot.nodal(name)
        # A NaN between two parts of the surface keeps a line from leading from one to the other.
        x = np.concatenate([np.append(arc, np.nan) for arc in arcs])
        y = np.concatenate([np.append(values[path], np.nan) for path in paths])
        (line,) = axes.plot(x, y, style, ms=3, lw=1.2, label=name.removeprefix("contact_"))
        drawn.append(line)
    if not np.isfinite(drawn[0].get_ydata()).any():
        axes.text(0.5, 0.6, "no edge of the surface is in contact", ha="center", transform=axes.transAxes)
    length, stress = (unit_of(quantity, result.units) for quantity in (Quantity.LENGTH, Quantity.STRESS))
    axes.set(xlabel=f"arc along the surface ({length})", ylabel=f"traction ({stress})", title=moment(result, snapshot))
    axes.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    axes.legend()
    return drawn[0], drawn[1]


def chains(mesh: Mesh, names: list[str], nodes: Floats) -> list[Ints]:
    """Nodes in order along the boundaries of those names: one array for each connected part.

    Each begins at its end with the smaller first coordinate; a closed one begins anywhere.
    """
    edges = np.unique(np.concatenate([mesh.surface(name)[0] for name in names]), axis=0)
    ahead = {int(edge[0]): edge for edge in edges}
    begins = sorted(set(ahead) - set(edges[:, -1].tolist())) or sorted(ahead)[:1]
    found = []
    for begin in begins:
        path, node = [begin], begin
        while node in ahead:
            edge = ahead.pop(node)
            path += edge[1:].tolist()
            node = int(edge[-1])
        found.append(np.array(path if nodes[path[0], 0] <= nodes[path[-1], 0] else path[::-1]))
    return found


def _arcs(paths: list[Ints], nodes: Floats) -> list[Floats]:
    """Arcs (p,) of the nodes of every path, each from where the last one ended."""
    arcs, begin = [], 0.0
    for path in paths:
        steps = np.linalg.norm(np.diff(nodes[path], axis=0), axis=1)
        arcs.append(begin + np.concatenate([[0.0], np.cumsum(steps)]))
        begin = float(arcs[-1][-1])
    return arcs
