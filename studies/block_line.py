"""How much the contact pressure of a block alternates from node to node, as :mod:`studies.corner` measures it.

Along each midline of the upper face, from its centre to the edge, ``line`` is the root mean square of the amplitudes of
what alternates in the pressure of the consistent mass, over the mean pressure of the contact.
"""

from __future__ import annotations

import numpy as np

from bipot.accepted import Accepted
from bipot.closeness import carries
from bipot.columns import Column
from bipot.fem.surface import facet_mass
from bipot.increment import System
from bipot.traction import consistent_tractions, contact_edges
from bipot.typing import Floats
from studies.corner import alternation

LEAST = 5
"""Nodes of which an alternation is told from a cubic."""


def line(system: System, accepted: Accepted) -> float:
    """The larger ``line`` of the two midlines; NaN where one has fewer than five nodes that carry."""
    r, nodes, points, scene = accepted.solved.r, accepted.solved.iterate.balanced, system.candidates, system.body.scene
    closed = carries(r)
    pressure, _ = consistent_tractions(points, nodes, r, closed)
    faces = points.node[contact_edges(points, 0, closed)]
    area = facet_mass(nodes, faces, scene.geometry).sum()
    mean = -accepted.tool_forces[0, -1] / area if area > 0 else np.nan
    return max(_along(system, pressure, d) / mean for d in (0, 1))


def _along(system: System, pressure: Floats, d: int) -> float:
    """Root mean square (MPa) of what alternates along axis ``d`` of the upper face."""
    mesh, node = system.body.scene.mesh, system.candidates.node
    middle = np.intersect1d(mesh.boundary_nodes("top"), mesh.boundary_nodes(("front", "left")[d]))
    own = np.flatnonzero(np.isin(node, middle) & np.isfinite(pressure))
    along = pressure[own[np.argsort(mesh.nodes[node[own], d])]]
    return float(np.sqrt(np.mean(alternation(along) ** 2))) if len(along) >= LEAST else float("nan")


LINE = Column("line", "alternation of the pressure along midlines over its mean, the larger; nan if short", line)
