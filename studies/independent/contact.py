"""Contact in the fuzz study's recomputation: gap, slip, the law of friction in force units, friction's work.

Rows are (n, t) with n from the tool into the body and t = (n_2, -n_1); r_n >= 0 pushes, r_t opposes the slip. Where the
shear yield stress caps friction, |r_t| <= min(mu r_n, cap), the law is that of the gap, r_n = (r_n - rho gap)+, and
that of the slip: r_t is the part of r_t - rho slip within what friction may be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.candidates import CARRIES, Contacts
from studies.independent.data import Bools, Floats, Setting, Step, beyond
from studies.independent.element import Placed, nodal_stiffness

EPS = 8 * float(np.finfo(np.float64).eps)
"""Round-off of a gap or slip over the coordinates it is the difference of."""

TOUCHING = 1e-9
"""Below this gap over the size of the whole body a point touches, and a welded one is tied."""

HOLDS = 1e-6
"""Of the largest force: friction this far within its limit holds its point."""

FREE = 1e-12
"""A direction with less than this on free components cannot move."""


@dataclass(frozen=True)
class ContactMeasures:
    """Penetration over size, of candidates and ``inside`` of held nodes, law over the largest force, energies.

    ``past`` is the force of candidates past an open end of their tool, over the largest.
    ``work`` and ``spent`` (on friction) by the mean of the forces at start and end, with the friction of the start that
    slides (:func:`_not_yet`) but not in the air (:func:`_not_in_air`), summed of terms of the size ``moved``; ``lost``
    to friction by those at the end, known to ``unsure``.
    ``resolution`` is the force that round-off of the gaps and slips of loaded contacts can make.
    """

    penetration: float
    inside: float
    past: float
    law: float
    work: float
    moved: float
    spent: float
    lost: float
    unsure: float
    resolution: float


def contact_measures(s: Setting, step: Step, placed: Placed) -> ContactMeasures:
    """Measure the candidates of an increment whose end is ``placed``."""
    c, du = step.contacts, step.displacement
    before = c.start_gap(step.start.nodes)
    gap, blur = _gap(step, before)
    slip, opened = c.slip(du), c.opened(du)
    if c.bodies:
        # Means of what stays in touch change along it: across a gap that stays closed nothing does work.
        touched = (before <= TOUCHING * s.whole) | (step.start.forces[:, 0] > 0)
        opened = np.where(touched, gap - before, opened)
    tied = c.welded & (before <= TOUCHING * s.whole)
    mu = np.where(np.isinf(c.mu) | ~c.rubs, 0.0, c.mu)
    rho = point_stiffness(c, nodal_stiffness(placed, s.elements, s.bulk, s.shear, len(step.end.nodes)), ~s.held, s.axes)
    r = step.end.forces
    cone, cut = _projected(r, gap, slip, mu, rho), _cut(r, gap, slip, np.where(c.rubs, c.most(r), 0.0), rho)
    law = np.where(np.broadcast_to(np.isinf(c.cap), mu.shape)[:, None], cone, cut)
    off = np.where(tied, _tied(rho, gap, slip), np.linalg.norm(r - law, axis=1))
    mean, pushed = (step.start.forces + r) / 2, (c.start_vectors(step.start.forces) + c.vectors(r)) / 2
    went = du[c.parts.node]
    work = c.parts.sums(np.vecdot(pushed, c.motion)) + mean[:, 0] * opened
    moved = c.parts.most(np.linalg.norm(went, axis=1) + np.linalg.norm(c.motion, axis=1))
    if c.bodies:
        moved = moved + c.sizes(step.end.nodes)
    if c.curved is not None:
        # Who comes from afar does not come along its force: the tool's work is what body and friction take.
        taken = c.parts.sums(np.vecdot(pushed, went)) - mean[:, 1] * slip
        work, blurred = np.where(c.curved.apart, taken, work), c.parts.most(c.curved.blurred)
        moved, blur = moved + blurred, blur + EPS * blurred
    slid = np.where(np.isnan(c.gone), slip, c.gone)
    rubs, against = _not_in_air(c, before, gap, went, s.whole), mean[:, 1] * slid
    begins = np.where(tied, 0.0, rubs * _not_yet(c, step.start.forces, r, slid)) / 2 + (1 - rubs) * against
    blur = blur + np.finfo(np.float64).eps * s.size
    force = rho * blur
    sunk, unsure = _distance(step.held, step.end.nodes)
    # What is held past an open end is in no tool.
    sunk = np.where(step.held.past, 0.0, sunk)
    return ContactMeasures(
        penetration=beyond(np.where(tied, np.abs(gap), -gap), blur, s.size),
        inside=beyond(-sunk, unsure + np.finfo(np.float64).eps * s.size, s.size),
        past=beyond(np.where(c.past, np.abs(r).max(axis=1), 0.0), CARRIES * step.largest, step.largest),
        law=beyond(off, (1 + mu) * force, step.largest),
        work=float((work + begins).sum()),
        moved=float(np.linalg.norm(mean, axis=1) @ moved),
        spent=float((begins - against).sum()),
        lost=-float(np.vdot(r[:, 1], slip)),
        unsure=float(np.vdot(np.abs(r[:, 1]), blur) + np.vdot(np.abs(slip), force)),
        resolution=float(force[np.abs(r).max(axis=1) > 0].max(initial=0.0)),
    )


def point_stiffness(c: Contacts, nodal: Floats, free: Bools, axes: Floats | None = None) -> Floats:
    r"""rho = sum_a w_a^2 k_a / (sum_a w_a^2)^2 (c,) of the nodes a that give way, k_a = n . K_aa n, n their normals.

    In k_a it is the normal's components that are ``free`` (a, 2), along ``axes`` (a, 2, 2) of the nodes if there are
    any. A force r on the mean loads node a by w_a r. Where nodes give way in that proportion, v_a = w_a n / sum w^2,
    the mean opens by one, and with neighbours at rest that costs rho: so much force is a gap or slip of the mean. Of
    one node it is k_a. The law is met for every rho or for none: it is but the scale by which lengths are compared with
    forces, and of means it is larger than that of their nodes.
    Of held nodes that a tool is driven against it is the stiffness that they would have. Of means of two bodies it is
    1 / sum_a w_a^2 / k_a, what one force on all of them makes them give way.
    """
    node, owner = c.parts.node, c.parts.owner
    along = np.broadcast_to(np.eye(2), (len(node), 2, 2)) if axes is None else axes[node]
    components = np.einsum("wij,wj->wi", along, c.normal)
    gives = moves(free[node], np.zeros(2), components)
    stuck = ~c.parts.any(gives)[owner]
    n = np.einsum("wij,wi->wj", along, components * (free[node] | stuck[:, None]))
    share = np.where(gives | stuck, c.parts.share, 0.0) ** 2
    stiff = np.einsum("wi,wij,wj->w", n, nodal[node], n)
    if c.bodies:
        return 1 / c.parts.sums(np.divide(share, stiff, out=np.zeros_like(share), where=share > 0))
    return c.parts.sums(share * stiff) / c.parts.sums(share) ** 2


def moves(free: Bools, led: Floats, direction: Floats) -> Bools:
    """Whether node, of which components (..., 2) are ``free``, or tool, by a force along ``led``, goes ``direction``.

    All (..., 2) but the answer (...).
    """
    return (free & (np.abs(direction) > FREE)).any(axis=-1) | (np.abs(np.vecdot(led, direction)) > FREE)


def _distance(c: Contacts, nodes: Floats) -> tuple[Floats, Floats]:
    """Of the candidates at the end from the planes (c,), by positions of nodes, and its round-off."""
    places = np.abs(c.offset_end) if c.curved is None else c.curved.places + np.abs(c.offset_end)
    return c.gap(nodes), EPS * (c.sizes(nodes) + c.parts.most(places))


def _gap(step: Step, before: Floats) -> tuple[Floats, Floats]:
    """Gap at the end (c,) and its round-off: the stored one where it agrees with the positions, else theirs."""
    c = step.contacts
    gap, blur = _distance(c, step.end.nodes)
    if step.gap is None:
        return gap, blur
    agrees: Bools = np.abs(step.gap - gap) <= 2 * blur
    moved = c.sizes(step.displacement) + c.parts.most(np.abs(c.motion).max(axis=1)) + np.abs(before)
    return np.where(agrees, step.gap, gap), np.where(agrees, np.minimum(EPS * moved, blur), 0.0)


def _not_yet(c: Contacts, before: Floats, after: Floats, slip: Floats) -> Floats:
    """Work (c,) on the ``slip`` (c,) that the friction of forces ``before`` (c, 2) does not do but would if it slid.

    It slides at its limit against the slip. What friction ``after`` (c, 2) holds, well within the limit, does not.
    """
    slides = np.abs(after[:, 1]) >= c.most(after) - HOLDS * float(np.linalg.norm(after, axis=1).max(initial=0.0))
    return np.where(slides, c.most_before(before) * np.abs(slip) + before[:, 1] * slip, 0.0)


def touching_part(left: Floats, before: Floats, after: Floats, goes: Floats, size: float) -> Floats:
    """The part (c,) of slips along which points touch that go ``goes`` (c,) with their tool along its normal.

    From gaps ``before`` to ``after`` (c,), with gaps ``left`` (c,) where slips begin.
    """
    lands = np.where(np.minimum(left, before) > TOUCHING * size, left, 0.0)
    away = lands + np.where(after > TOUCHING * size, after, 0.0)
    follows = np.abs(goes - np.minimum(after, 0.0) + np.minimum(before, 0.0))
    return np.where(away > 0, follows / np.where(away > 0, follows + away, 1.0), 1.0)


def _not_in_air(c: Contacts, before: Floats, after: Floats, went: Floats, size: float) -> Floats:
    """The part (c,) of slips along which points touch, with gaps ``before`` and ``after`` (c,), nodes ``went`` (w, 2).

    The tool's way along the normal is what points go with it, beyond how they are carried, and what it is away from
    them; of slips of shaped tools what is before they come to points is left out already.
    """
    left = before if c.curved is None else np.minimum(c.curved.left, before)
    goes = c.parts.mean(np.vecdot(c.start_normal, went - c.taken))
    return np.maximum(touching_part(left, before, after, goes, size), c.passing)


def _tied(rho: Floats, gap: Floats, slip: Floats) -> Floats:
    return rho * np.hypot(gap, slip)


def _cut(r: Floats, gap: Floats, slip: Floats, most: Floats, rho: Floats) -> Floats:
    """((r_n - rho gap)+, the part of r_t - rho slip within ``most``)."""
    return np.column_stack([np.maximum(r[:, 0] - rho * gap, 0.0), np.clip(r[:, 1] - rho * slip, -most, most)])


def _projected(r: Floats, gap: Floats, slip: Floats, mu: Floats, rho: Floats) -> Floats:
    """P_K(r - rho (gap + mu |slip|, slip)), K = {|p_t| <= mu p_n}, found by its three cases."""
    p = r - rho[:, None] * np.column_stack([gap + mu * np.abs(slip), slip])
    length, way = np.abs(p[:, 1]), np.sign(p[:, 1])
    edge = np.maximum((p[:, 0] + mu * length) / (1 + mu**2), 0.0)
    inside = (length <= mu * p[:, 0]) & (p[:, 0] >= 0)
    return np.where(inside[:, None], p, np.column_stack([edge, way * mu * edge]))
