"""Pictures of runs, and of meshes and curves: each takes ``ax=None`` (the current axes) and returns what it drew.

:func:`contour`, :func:`contact_traction` and :func:`animate` take an opened run, :func:`tools` one of its steps,
:func:`body` an accepted increment, the others arrays. matplotlib is needed only when one of them is called.
"""

from bipot.plot.animation import animate
from bipot.plot.contours import body, contact_traction, contour, tools
from bipot.plot.lines import boundary, curved, force_stroke, mesh, vectors

__all__ = [
    "animate",
    "body",
    "boundary",
    "contact_traction",
    "contour",
    "curved",
    "force_stroke",
    "mesh",
    "tools",
    "vectors",
]
