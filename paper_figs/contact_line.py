"""The contact line of a run after an increment: tractions of points and of edges, and what the points do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.contact.closeness import carries, touches
from bipot.contact.sampling import hat_areas, points
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.coulomb import Status
from bipot.results import History
from bipot.results.fields import NO_CANDIDATE
from bipot.tools.surfaces import frames
from bipot.tools.tool import FlatTool, Sampling
from bipot.typing import Floats, Ints
from studies.recovered import edge_tractions


@dataclass(frozen=True)
class Line:
    """The contact line of one increment, mm and MPa.

    ``radius``, ``pressure``, ``shear``, ``status`` (m,) are of its points; ``ends`` (f, 2) radii of the ends of its
    edges, ``edge_pressure`` and ``edge_shear`` (f, 2) what is drawn there: the mean of the edge at both ends, or where
    contact is ``weighted`` the tractions of the points, between which they are linear. ``corner`` is the radius of the
    top corner.
    """

    radius: Floats
    pressure: Floats
    shear: Floats
    status: Ints
    ends: Floats
    edge_pressure: Floats
    edge_shear: Floats
    corner: float
    weighted: bool


def contact_line(run: History, row: int) -> Line:
    """Read the contact line after the increment of ``row``."""
    state, mesh, (tool,) = run.state(row), run.mesh, run.scene["tools"]
    at_start = run.scene["configuration"] == Configuration.PAPER.value
    nodes = state.nodes - state.du if at_start else state.nodes
    corner = float(nodes[mesh.boundary_nodes("top"), 0].max())
    if tool["sampling"] == Sampling.WEIGHTED.value and mesh.element.quadratic:
        return _weighted(run, row, nodes, corner)
    pressure, shear, status = (run.nodal(name, row) for name in ("contact_pressure", "contact_shear", "status"))
    edges = mesh.edges(*tool["candidates"])
    edges = edges[~np.isnan(pressure[edges]).any(axis=1)]
    line = np.unique(edges)
    along = run.nodal("contact_force", row)[:, :2] @ frames(np.array(tool["normal"])).T
    means = edge_tractions(nodes, edges, Geometry(run.scene["geometry"]), along)
    p, s = np.repeat(means.T[:, :, None], 2, axis=2)
    ends = nodes[edges[:, [0, -1]], 0]
    return Line(nodes[line, 0], pressure[line], shear[line], status[line], ends, p, s, corner, weighted=False)


def _weighted(run: History, row: int, nodes: Floats, corner: float) -> Line:
    """That of weighted points: fields of nodes hold one of the two points of a crease, so forces and gaps are asked.

    Where both points of a crease carry, the status of the one that pushes harder is that of both.
    """
    mesh, (tool,) = run.mesh, run.scene["tools"]
    geometry, state = Geometry(run.scene["geometry"]), run.state(row)
    vectors = tuple(tool["point"]), tuple(tool["normal"]), tuple(tool["travel"])
    flat = FlatTool(*vectors, tuple(tool["candidates"]), tool["mu"], sampling=Sampling.WEIGHTED)
    posed = points(mesh, geometry, flat)
    status = run.nodal("status", row)[posed.node]
    candidates = status != NO_CANDIDATE
    area, gap, r = np.zeros(len(posed.node)), np.zeros(len(posed.node)), np.zeros((len(posed.node), 2))
    np.add.at(area, posed.point, hat_areas(nodes, posed.facets, geometry))
    r[candidates], gap[candidates] = state.forces, state.gap
    t = r / area[:, None]
    paired = np.bincount(posed.node)[posed.node] > 1
    status[paired & ~carries(r) & ~touches(gap, mesh.size)] = Status.OPEN
    edges = posed.point[candidates[posed.point].all(axis=1) & carries(r)[posed.point].any(axis=1)]
    line, radius = np.unique(edges), nodes[posed.node, 0]
    found = radius[line], t[line, 0], t[line, 1], status[line]
    return Line(*found, radius[edges], t[edges, 0], t[edges, 1], corner, weighted=True)
