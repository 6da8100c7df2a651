"""The body of an accepted increment, with one colour per element."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bipot.control.accepted import Accepted
from bipot.errors import require, require_type
from bipot.plot.lines import axes_of
from bipot.typing import Floats, as_numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PolyCollection


def body(
    accepted: Accepted, values: Floats, ax: Axes | None = None, label: str = "", shrink: float = 1.0, **style: Any
) -> PolyCollection:
    """Draw the deformed plane elements with straight edges, coloured by their ``values`` (e,).

    With a ``label`` there is a colour bar, whose size over that of the axes is ``shrink``. ``style`` is matplotlib's.

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
    axes.autoscale_view()
    if label:
        axes.figure.colorbar(faces, ax=axes, label=label, shrink=shrink)
    return faces
