r"""How much the contact pressure of a block alternates from node to node, along each midline of its upper face.

``line`` and ``corner`` are measured as :mod:`studies.corner` does: from the centre to the edge, the root mean square of
the amplitudes A_i of what alternates in the pressure of the consistent mass, over the mean pressure of the contact, and
the amplitude next to the edge alone.

The pressure at the edge is that of slip lines around a corner, in plane strain 2k (1 + theta - pi/2), theta being the
angle between the platen and the side beside it: it grows from 2k to (2 + pi) k as the side turns onto the platen, and
begins anew when a node of the side has landed. That is a peak one element wide, on any mesh. Where the nodal pressure
on the edge, ``edge``, is t and all others are one, the consistent mass makes (t - 1) sqrt(3) (-q)^k of what it has too
much, k elements from the edge, q = 2 - sqrt(3): A_i next to the edge is sqrt(3) (1 + q)^4/16 (t - 1) = 0.28 (t - 1),
falling by q from node to node, and with m elements to the edge

    line = 0.29 (t - 1)/sqrt(m - 3),

though nothing alternates. ``inner`` does not feel that peak: nodal pressures are r_i/A_i, node by node, and without the
edge's own they hold nothing of it. Of consistent pressures that alternate by a they show a/3,

    inner = 3 sqrt(mean_i A_i^2) / p_mean,      2 <= i <= m - 3,

where contact is posed at nodes; where in means, pressures are multipliers, of which the factor is 1.

``written`` is measured as ``line`` in the pressures r_i/A_i that results write, the edge's included.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import carries
from bipot.control.accepted import Accepted
from bipot.fem.surface import facet_mass
from bipot.results.columns import Column
from bipot.system import System
from bipot.traction import on_line, tractions
from bipot.typing import Bools, Floats
from studies.corner import alternation
from studies.recovered import consistent_tractions

LEAST = 5
"""Nodes of which an alternation is told from a cubic."""

LUMPED = 3.0
"""Amplitude of an alternating pressure of bilinear faces over that of r_i/A_i."""

Recovery = Callable[[Candidates, Floats, Floats, Bools], tuple[Floats, Floats]]


def line(system: System, accepted: Accepted) -> float:
    """The larger ``line`` of the two midlines; NaN where one has fewer than five nodes that carry."""
    return max(_rms(alternation_of(along)) for along in profiles(system, accepted, consistent_tractions))


def corner(system: System, accepted: Accepted) -> float:
    """The larger amplitude next to the edge; NaN as :func:`line`."""
    along = [alternation_of(pressure) for pressure in profiles(system, accepted, consistent_tractions)]
    return max(float(of[-1]) if of.size else np.nan for of in along)


def inner(system: System, accepted: Accepted) -> float:
    """The larger ``inner`` of the two midlines; NaN where one has fewer than six nodes that carry."""
    factor = 1.0 if system.candidates.points[0].weighted else LUMPED
    return max(factor * _rms(alternation_of(along[:-1])) for along in profiles(system, accepted, tractions))


def written(system: System, accepted: Accepted) -> float:
    """The larger ``written`` of the two midlines; NaN as :func:`line`."""
    return max(_rms(alternation_of(along)) for along in profiles(system, accepted, tractions))


def edge(system: System, accepted: Accepted) -> float:
    """The larger nodal pressure at the edge, over the mean; NaN where nothing carries."""
    return max(float(along[-1]) if along.size else np.nan for along in profiles(system, accepted, tractions))


def profiles(system: System, accepted: Accepted, recovered: Recovery) -> tuple[Floats, Floats]:
    """Pressures of nodes that carry, from the centre to the edge, over the mean of the contact, of both midlines."""
    r, nodes, points, scene = accepted.solved.r, accepted.solved.iterate.balanced, system.candidates, system.body.scene
    closed = carries(r)
    pressure, _ = recovered(points, nodes, r, closed)
    faces = points.points[0].facets[on_line(points, 0, closed)]
    area = facet_mass(nodes, faces, scene.geometry).sum()
    mean = -accepted.tool_forces[0, -1] / area if area > 0 else np.nan
    first, second = (_along(system, pressure, d) / mean for d in (0, 1))
    return first, second


def alternation_of(pressure: Floats) -> Floats:
    """Amplitudes of what alternates in it; none of fewer than five."""
    return alternation(pressure) if len(pressure) >= LEAST else np.empty(0)


def _rms(amplitudes: Floats) -> float:
    return float(np.sqrt(np.mean(amplitudes**2))) if amplitudes.size else np.nan


def _along(system: System, pressure: Floats, d: int) -> Floats:
    """The pressure (MPa) along axis ``d`` of the upper face."""
    mesh, node = system.body.scene.mesh, system.candidates.node
    # Where contact is posed in means the side has points of its own on the edge.
    upper = system.candidates.number[0][system.candidates.points[0].point[: len(mesh.boundary("top"))]]
    middle = np.isin(node, mesh.boundary_nodes(("front", "left")[d])) & np.isfinite(pressure)
    own = np.intersect1d(upper, np.flatnonzero(middle))
    return pressure[own[np.argsort(mesh.nodes[node[own], d])]]


LINE = Column("line", "alternation of the pressure along midlines over its mean, the larger; nan if short", line)
CORNER = Column("corner", "that of the pressure next to the edge alone, the larger; nan if short", corner)
INNER = Column("inner", "alternation of nodal pressures without the edge's over their mean, the larger", inner)
EDGE = Column("edge", "nodal pressure at the edge over the mean, the larger of the midlines", edge)
WRITTEN = Column("written", "as line, of the pressure that results write, the larger; nan if short", written)
COLUMNS = (LINE, CORNER, INNER, EDGE, WRITTEN)
