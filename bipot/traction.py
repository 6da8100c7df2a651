r"""Tractions of contact forces on the contact line, and the status of its points.

Where contact is posed in the mean around the ends of edges (:mod:`bipot.contact.sampling`), the forces are those of a
traction, t = sum_p t_p psi_p with t_p = r_p / int psi_p dA, which obeys the law at the points and, because the cone is
convex, sign and cone between them; it falls to zero at the first open point. :func:`tractions` gives it. So it is at
deformable tools (:mod:`bipot.tools.facing`), with the area that faces the tool. Beyond the end of a tool a point may
have a force and hardly an area. With less than :data:`LEAST_SHARE` of its own that faces the tool, area and force are
added to those of the points beside it, in proportion to their areas, and its traction is the mean of theirs.

Where contact is posed at nodes, the law is posed on forces; a traction is recovered, not solved for. The contact line
of a tool consists of those current edges of its candidate boundaries that have at least two closed nodes, with
dA = 2 pi r ds (axisymmetric) or ds (plane strain), in space of the faces that have three, and

    A_ei = int_e N_i dA,    A_i = sum_e A_ei,    A_e = sum_i A_ei.

A node has t_i = r_i/A_i. Weights are >= 0 and Coulomb's cone is convex, so tractions obey sign and cone because the
forces do. They are exact where the traction is linear on equal straight edges, else of order two. Their quotient is
that of the forces, so a slipping node is on the envelope. At the axis of a ring A_i vanishes, and with it the force: a
node with A_i less than :data:`LEAST_SHARE` of the edges around has the mean of these, of order one. Other recoveries
are in ``studies.recovered``.

Where a support or symmetry holds the tangent, the shear is zero if the tool does not move along it. If it does, the
shear is the friction between tool and support, which no unknown contains. The tangent of a mean is held where those of
all its nodes are; where only some are, the mean rubs by the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import carries
from bipot.fem.reduction import Geometry
from bipot.fem.surface import facet_mass
from bipot.iterate import Iterate
from bipot.laws.coulomb import Status, force_threshold, status
from bipot.laws.projections import project_disc
from bipot.programs.data import ContactRows
from bipot.tensors import norm
from bipot.typing import Bools, Floats, Ints, einsum

SLIP_TOLERANCE = 1e-6
"""Slip and gap count as zero below this fraction of the increment's :attr:`~bipot.iterate.Iterate.length`."""

LEAST_SHARE = 0.05
"""A node with less than this fraction of the area of the edges around it has no traction of its own."""

ROUNDED = 1e-12
"""Relative difference of two sums of limits that is round-off."""


@dataclass(frozen=True)
class ContactTraction:
    """Tractions and status of the candidates: pressure (c,) and shear (c,) along t, status (c,), thresholds.

    The tractions (force per area) are nodal, obey p >= 0 and |tau| <= mu p, and are NaN off the contact line. In space,
    where there are two tangents, the shear is the length of its vector. ``status`` holds
    :class:`bipot.laws.coulomb.Status` values, decided with ``force_tol`` (force) and ``slip_tol`` (length); a weld
    sticks, also where it pulls.
    """

    recovered_pressure: Floats
    recovered_shear: Floats
    status: NDArray[np.int8]
    force_tol: float
    slip_tol: float


def traction(iterate: Iterate, r: Floats) -> ContactTraction:
    """Traction and status for contact forces r (c, d) of all candidates, where the iterate is in equilibrium."""
    force_tol, slip_tol = force_threshold(r), SLIP_TOLERANCE * iterate.length
    rows, known = iterate.rows, (iterate.increment.dragged != 0).any(axis=1)
    acting, motion = iterate.rubbed(r), np.column_stack([iterate.motion[:, 0], iterate.slipped])
    candidates = iterate.increment.system.candidates
    pressure, shear = tractions(candidates, iterate.balanced, acting, carries(r), rows, known)
    state = status(acting, motion, 0.0, rows.mu, force_tol, slip_tol, rows.cap)
    # Welds that pull are open by the law of contact.
    glued = rows.tied & (norm(motion) <= slip_tol) & (norm(acting) > force_tol)
    state[glued] = Status.STICK
    return ContactTraction(pressure, shear, state, force_tol, slip_tol)


def tractions(
    candidates: Candidates,
    nodes: Floats,
    r: Floats,
    closed: Bools,
    rows: ContactRows | None = None,
    known: Bools | None = None,
) -> tuple[Floats, Floats]:
    """Pressure and shear (c,) of forces r (c, d) on the line through ``closed`` candidates, NaN elsewhere.

    Where supports hold the tangent there is a shear only if the slip is ``known`` (c,) nevertheless.

    They are projected, so sign and cone (or its part below a cap of ``rows``) hold to the last digit for any forces.
    Where Coulomb's law holds, the projection only removes the round-off of an accepted increment. A weld may also pull:
    on an edge of the line its tension is then reported as pressure 0 and its shear is unchanged, so pressures do not
    have the forces' resultant; r contains the tension.
    """
    mu = candidates.mu.copy()
    if rows is not None:
        # Where a cap acts, its quotient with the pressure.
        np.divide(rows.limit(r), r[:, 0], out=mu, where=np.isfinite(rows.cap) & (r[:, 0] > 0))
    rubbed = np.where(np.isfinite(mu), mu, 0.0) * np.maximum(r[:, 0], 0.0)
    rubbing = candidates.tangent_free if known is None else candidates.tangent_free | known
    pressure, shear = np.full(len(r), np.nan), np.full(len(r), np.nan)
    for number in range(len(candidates.scene.tools)):
        edges = contact_edges(candidates, number, closed)
        line = np.unique(edges)
        if not line.size:
            continue
        if candidates.points[number].in_means:
            both = multipliers(candidates, number, nodes, np.column_stack([r, rubbed]))
            found, most = both[:, :-1], both[:, -1]
        else:
            found = nodal_tractions(nodes[candidates.node], edges, candidates.scene.geometry, r)
            most = None
        pressure[line] = np.maximum(found[line, 0], 0.0)
        limit = np.multiply(mu, pressure, out=np.full(len(r), np.inf), where=np.isfinite(mu))
        if most is not None:
            # That of forces that are added up, where coefficients differ or a cap acts.
            limit = np.where(np.isinf(limit) | np.isclose(most, limit, rtol=ROUNDED, atol=0.0), limit, most)
        limit[~rubbing] = 0.0
        along = project_disc(found[line, 1:], limit[line])
        shear[line] = component(along)
    return pressure, shear


def nodal_tractions(nodes: Floats, edges: Ints, geometry: Geometry, forces: Floats) -> Floats:
    """t_i = r_i/A_i (a, k) of ``forces`` (a, k); for a node with little area the mean of its edges; 0 off the edges."""
    areas = facet_mass(nodes, edges, geometry).sum(axis=2)
    pooled = shared(areas, len(nodes), edges, forces)
    area, around = np.zeros(len(nodes)), np.zeros(len(nodes))
    whole = np.zeros(forces.shape)
    np.add.at(area, edges, areas)
    np.add.at(around, edges, areas.sum(axis=1)[:, None])
    np.add.at(whole, edges, pooled[:, None])
    enough = (area >= LEAST_SHARE * around) & (area > 0)
    weight = np.where(enough, area, around)[:, None]
    return np.divide(np.where(enough[:, None], forces, whole), weight, out=np.zeros(forces.shape), where=weight > 0)


def shared(areas: Floats, count: int, edges: Ints, forces: Floats) -> Floats:
    """Shares (f, k) of nodal ``forces`` (``count``, k) on the edges (f, n), by the ``areas`` A_ei (f, n) of nodes."""
    # A strongly distorted ring edge at the axis may have a small negative area.
    part, total, number = np.maximum(areas, 0.0), np.zeros(count), np.zeros(count)
    np.add.at(total, edges, part)
    np.add.at(number, edges, 1.0)
    part = np.where(total[edges] > 0, part / np.where(total > 0, total, 1.0)[edges], 1 / number[edges])
    return einsum("fi,fik->fk", part, forces[edges])


def contact_edges(candidates: Candidates, number: int, closed: Bools) -> Ints:
    """Edges (f, n) on the contact line of the tool of that ``number``, as candidate numbers."""
    return candidates.number[number][candidates.points[number].point[on_line(candidates, number, closed)]]


def on_line(candidates: Candidates, number: int, closed: Bools) -> Bools:
    """Which edges (f,) of the boundaries of the tool of that ``number`` are on its contact line.

    At least two nodes of an edge, three of a face, are closed, or one weighted point: its traction goes on to the next.
    An edge with a node that is no candidate is left out, because a support carries part of its force.
    """
    points = candidates.points[number]
    edges = candidates.number[number][points.point]
    many = np.where(edges >= 0, closed[edges], False).sum(axis=1) if len(closed) else np.zeros(len(edges))
    least = 1 if points.in_means else candidates.scene.mesh.dimension
    return (edges >= 0).all(axis=1) & (many >= least)


def multipliers(candidates: Candidates, number: int, nodes: Floats, r: Floats) -> Floats:
    """t_p = r_p / int psi_p dA (c, k) of forces r (c, k) at the means of a tool by its ``number``; zero at others."""
    points, numbers = candidates.points[number], candidates.number[number]
    area = np.zeros(len(numbers))
    np.add.at(area, points.point, points.areas(nodes, candidates.scene.geometry))
    if points.faced is not None:
        area *= points.faced.part
    out = np.zeros(r.shape)
    known = (numbers >= 0) & (area > 0)
    if points.faced is None:
        out[numbers[known]] = r[numbers[known]] / area[known, None]
        return out
    forces = np.zeros((len(area), r.shape[1]))
    forces[known] = r[numbers[known]]
    enough = points.faced.part >= LEAST_SHARE
    shares = _shares(points.point, area, known & enough, forces.any(axis=1) & ~enough)
    whole, forces = shares.T @ np.where(known, area, 0.0), shares.T @ forces
    found = shares @ np.divide(forces, whole[:, None], out=np.zeros_like(forces), where=whole[:, None] > 0)
    out[numbers[known]] = found[known]
    return out


def _shares(edges: Ints, area: Floats, enough: Bools, few: Bools) -> sp.csr_array:
    """Shares (p, p) of points in place of each point: of ``few`` (p,) those beside it that have ``enough`` (p,) area.

    They are on common facets ``edges`` (f, n), and share in proportion to their ``area`` (p,). In place of any other
    point, or where none is beside, there is itself.
    """
    n, count = edges.shape[1], len(area)
    one, other = np.repeat(edges, n, axis=1).ravel(), np.tile(edges, n).ravel()
    beside = np.unique(np.stack([one, other])[:, few[one] & enough[other]], axis=1)
    total = np.bincount(beside[0], area[beside[1]], count)
    alone = np.flatnonzero(total == 0)
    share = np.concatenate([area[beside[1]] / total[beside[0]], np.ones(len(alone))])
    place = np.concatenate([beside, np.stack([alone, alone])], axis=1)
    return sp.csr_array((share, (place[0], place[1])), shape=(count, count))


def component(shear: Floats) -> Floats:
    """The component (a,) of shear vectors (a, d - 1), in space their length."""
    return shear[:, 0] if shear.shape[1] == 1 else norm(shear)
