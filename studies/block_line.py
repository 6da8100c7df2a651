"""How much the contact pressure of a block alternates from node to node, as :mod:`studies.corner` measures it.

Along each midline of the upper face, from its centre to the edge, ``line`` is the root mean square of the amplitudes of
what alternates in the pressure of the consistent mass, over the mean pressure of the contact, ``corner`` the amplitude
next to the edge alone.

Between landings the node on the edge carries what all of the side above the last landed node will: a peak one element
wide, which no mesh resolves. The amplitude there is mostly that peak, what is left inside its echo; both grow until the
next node of the side lands, and are gone with it.
"""

from __future__ import annotations

import numpy as np

from bipot.contact.closeness import carries
from bipot.control.accepted import Accepted
from bipot.fem.surface import facet_mass
from bipot.increment import System
from bipot.results.columns import Column
from bipot.traction import consistent_tractions, on_line
from bipot.typing import Floats
from studies.corner import alternation

LEAST = 5
"""Nodes of which an alternation is told from a cubic."""


def line(system: System, accepted: Accepted) -> float:
    """The larger ``line`` of the two midlines; NaN where one has fewer than five nodes that carry."""
    return max(float(np.sqrt(np.mean(along**2))) if along.size else np.nan for along in amplitudes(system, accepted))


def corner(system: System, accepted: Accepted) -> float:
    """The larger amplitude next to the edge; NaN as :func:`line`."""
    return max(float(along[-1]) if along.size else np.nan for along in amplitudes(system, accepted))


def amplitudes(system: System, accepted: Accepted) -> tuple[Floats, Floats]:
    """Of what alternates, from the centre to the edge, over the mean pressure, of both midlines.

    Empty where a midline has fewer than five nodes that carry.
    """
    r, nodes, points, scene = accepted.solved.r, accepted.solved.iterate.balanced, system.candidates, system.body.scene
    closed = carries(r)
    pressure, _ = consistent_tractions(points, nodes, r, closed)
    faces = points.points[0].lines[on_line(points, 0, closed)]
    area = facet_mass(nodes, faces, scene.geometry).sum()
    mean = -accepted.tool_forces[0, -1] / area if area > 0 else np.nan
    first, second = (_along(system, pressure, d) / mean for d in (0, 1))
    return first, second


def _along(system: System, pressure: Floats, d: int) -> Floats:
    """Amplitudes (MPa) of what alternates along axis ``d`` of the upper face."""
    mesh, node = system.body.scene.mesh, system.candidates.node
    # Where contact is posed in means the side has points of its own on the edge.
    upper = system.candidates.number[0][system.candidates.points[0].edges[: len(mesh.boundary("top"))]]
    middle = np.isin(node, mesh.boundary_nodes(("front", "left")[d])) & np.isfinite(pressure)
    own = np.intersect1d(upper, np.flatnonzero(middle))
    along = pressure[own[np.argsort(mesh.nodes[node[own], d])]]
    return alternation(along) if len(along) >= LEAST else np.empty(0)


LINE = Column("line", "alternation of the pressure along midlines over its mean, the larger; nan if short", line)
CORNER = Column("corner", "that of the pressure next to the edge alone, the larger; nan if short", corner)
