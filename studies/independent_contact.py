"""Contact in the fuzz study's recomputation: gap, slip, Coulomb's law in force units, friction's work.

Rows are (n, t) with n from the tool into the body and t = (n_2, -n_1); r_n >= 0 pushes, r_t opposes the slip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent_data import Bools, Contacts, Floats, Setting, Step, beyond
from studies.independent_element import Placed, nodal_stiffness

EPS = 8 * float(np.finfo(np.float64).eps)
"""Round-off of a gap or slip over the coordinates it is the difference of."""

TOUCHING = 1e-9
"""A welded point is tied below this gap over the size."""

FREE = 1e-12
"""A direction with less than this on free components cannot move."""


@dataclass(frozen=True)
class ContactMeasures:
    """Penetration over size, of candidates and ``inside`` of held nodes, law over the largest force, energies.

    ``work`` and ``spent`` (on friction) by the mean of the forces at start and end, summed of terms of the size
    ``moved``; ``lost`` to friction by those at the end, known to ``unsure``.
    ``resolution`` is the force that round-off of the gaps and slips of loaded contacts can make.
    """

    penetration: float
    inside: float
    law: float
    work: float
    moved: float
    spent: float
    lost: float
    unsure: float
    resolution: float


def contact_measures(s: Setting, step: Step, placed: Placed) -> ContactMeasures:
    """Measure the candidates of an increment whose end is ``placed``."""
    c, du = step.contacts, step.contacts.mean(step.displacement)
    before = np.vecdot(c.normal, c.mean(step.start.nodes)) - c.offset
    gap, blur = _gap(step, before)
    slip = np.where(c.rubs, np.vecdot(c.tangent, du - c.motion), 0.0)
    tied = np.isinf(c.mu) & (before <= TOUCHING * s.size)
    mu = np.where(np.isinf(c.mu) | ~c.rubs, 0.0, c.mu)
    rho = point_stiffness(c, nodal_stiffness(placed, s.elements, s.bulk, s.shear, len(step.end.nodes)), ~s.held)
    r = step.end.forces
    off = np.where(tied, _tied(rho, gap, slip), np.linalg.norm(r - _projected(r, gap, slip, mu, rho), axis=1))
    mean = (step.start.forces + r) / 2
    work = mean[:, 0] * np.vecdot(c.normal, du) + mean[:, 1] * np.vecdot(c.tangent, c.motion)
    blur = blur + np.finfo(np.float64).eps * s.size
    force = rho * blur
    sunk, unsure = _distance(step.held, step.end.nodes)
    return ContactMeasures(
        penetration=beyond(np.where(tied, np.abs(gap), -gap), blur, s.size),
        inside=beyond(-sunk, unsure + np.finfo(np.float64).eps * s.size, s.size),
        law=beyond(off, (1 + mu) * force, step.largest),
        work=float(work.sum()),
        moved=float(np.linalg.norm(mean, axis=1) @ (np.linalg.norm(du, axis=1) + np.linalg.norm(c.motion, axis=1))),
        spent=-float(np.vdot(mean[:, 1], slip)),
        lost=-float(np.vdot(r[:, 1], slip)),
        unsure=float(np.vdot(np.abs(r[:, 1]), blur) + np.vdot(np.abs(slip), force)),
        resolution=float(force[np.abs(r).max(axis=1) > 0].max(initial=0.0)),
    )


def point_stiffness(c: Contacts, nodal: Floats, free: Bools) -> Floats:
    r"""rho = sum_a w_a^2 k_a / (sum_a w_a^2)^2 (c,) of the nodes a that give way, k_a = n . K_aa n, n the normal.

    In k_a it is the normal's components that are ``free`` (a, 2). A force r on the mean loads node a by w_a r. Where
    nodes give way in that proportion, v_a = w_a n / sum w^2, the mean does by n, and with neighbours at rest that costs
    rho: so much force is a gap or slip of the mean. Of one node it is k_a. The law is met for every rho or for none: it
    is but the scale by which lengths are compared with forces, and of means it is larger than that of their nodes.
    Of held nodes that a tool is driven against it is the stiffness that they would have.
    """
    gives = (c.weights != 0) & moves(free, np.zeros((1, 1, 2)), c.normal[:, None])
    stuck = ~gives.any(axis=1)
    n = c.normal[:, None] * (free | stuck[:, None, None])
    share = np.where(gives | stuck[:, None], c.weights, 0.0) ** 2
    return (share * np.einsum("cai,aij,caj->ca", n, nodal, n)).sum(axis=1) / share.sum(axis=1) ** 2


def moves(free: Bools, led: Floats, direction: Floats) -> Bools:
    """Whether node, of which components (..., 2) are ``free``, or tool, by a force along ``led``, goes ``direction``.

    All (..., 2) but the answer (...).
    """
    return (free & (np.abs(direction) > FREE)).any(axis=-1) | (np.abs(np.vecdot(led, direction)) > FREE)


def _distance(c: Contacts, nodes: Floats) -> tuple[Floats, Floats]:
    """Of the candidates at the end from the planes (c,), by positions of nodes, and its round-off."""
    return np.vecdot(c.normal, c.mean(nodes)) - c.offset_end, EPS * (c.sizes(nodes) + np.abs(c.offset_end))


def _gap(step: Step, before: Floats) -> tuple[Floats, Floats]:
    """Gap at the end (c,) and its round-off: the stored one where it agrees with the positions, else theirs."""
    c = step.contacts
    gap, blur = _distance(c, step.end.nodes)
    if step.gap is None:
        return gap, blur
    agrees: Bools = np.abs(step.gap - gap) <= 2 * blur
    moved = c.sizes(step.displacement) + np.abs(c.motion).max(axis=1) + np.abs(before)
    return np.where(agrees, step.gap, gap), np.where(agrees, np.minimum(EPS * moved, blur), 0.0)


def _tied(rho: Floats, gap: Floats, slip: Floats) -> Floats:
    return rho * np.hypot(gap, slip)


def _projected(r: Floats, gap: Floats, slip: Floats, mu: Floats, rho: Floats) -> Floats:
    """P_K(r - rho (gap + mu |slip|, slip)), K = {|p_t| <= mu p_n}, found by its three cases."""
    p = r - rho[:, None] * np.column_stack([gap + mu * np.abs(slip), slip])
    length, way = np.abs(p[:, 1]), np.sign(p[:, 1])
    edge = np.maximum((p[:, 0] + mu * length) / (1 + mu**2), 0.0)
    inside = (length <= mu * p[:, 0]) & (p[:, 0] >= 0)
    return np.where(inside[:, None], p, np.column_stack([edge, way * mu * edge]))
