r"""How far an accepted increment is from the law, recomputed from plain arrays: nothing of the library is imported.

Each measure has what double precision cannot tell from zero taken off first: ``EPS`` times the sizes of the terms that
cancel, and strains of one unit of round-off, gaps of one unit of the size. A body without force, or a travel far below
the size of the body, is then judged as any other.

* equilibrium: largest |nodal residual| where free over the largest nodal sum of |element forces|, at start or end;
* yielding: (sigma_eq - sigma_Y(p))+ / sigma_Y(p);
* elastic: sigma - R sigma_n R' - 2 G dev (de - de_p) - K tr de 1, over the largest stress of the body;
* flow: what is left of (de_p, dp) by a (carried flow, its dp) + gamma n, 0 <= a <= 1, gamma >= 0, n the unit deviator
  of the stress, times 2 G over sigma_Y; and gamma > 0 only on the yield surface;
* penetration: (-gap)+ over the size of the body, at every candidate, which is the mean of nodes that the study makes
  itself (:mod:`studies.independent.sampling`), as are slips and what nodes take of contact forces;
* inside: the same at the nodes of the tools' boundaries that supports hold along the normal, where no force pushes;
* past: contact forces past an open end of a tool, over the largest;
* between: how deep convex tools are in the body, and it in them, anywhere on their surfaces, over what they may be
  (:mod:`studies.independent.between`);
* driven: |sum_c r . d - F| over F, of each tool that a force F drives along d, F and contacts of the modelled part; of
  one that a moment M turns |sum_c r . (z x a) - M| over M, or over sum_c |r| |a| where that is more, a from its centre;
* placed: how far held nodes are from where supports ask for them, and tools from where they were plus their advance,
  over the size of the body; the same of the increment's displacements of held nodes over its largest motion;
* law: |r - P_K(r - rho (u + mu |u_t| n))| over the largest contact force, u = (gap, slip), rho the elastic stiffness of
  the point (:func:`studies.independent.contact.point_stiffness`); with friction that is capped as in
  :mod:`studies.independent.contact`;
* orientation: smallest Jacobian over its element's mean, sampled densely, at the end and at the middle;
* plastic, friction: what the increment dissipates over the largest energy of an increment so far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.between import between
from studies.independent.contact import contact_measures
from studies.independent.data import EPS, Floats, Setting, Step, beyond
from studies.independent.driven import driven, placed, work_of_supports
from studies.independent.element import (
    Placed,
    displacement_gradient,
    element_forces,
    nodal,
    orientation,
    place,
    rotation,
    turned,
)
from studies.independent.volume import with_fitted_trace


@dataclass(frozen=True)
class Measures:
    """The module docstring's numbers, then the increment's work and its elastic, plastic and frictional parts.

    ``resolution`` is the contact force that round-off of the gaps can make, ``terms`` the size of those of the work.
    """

    equilibrium: float
    yielding: float
    elastic: float
    flow: float
    penetration: float
    inside: float
    past: float
    between: float
    driven: float
    placed: float
    law: float
    orientation: float
    plastic: float
    friction: float
    energies: tuple[float, float, float, float]
    resolution: float
    terms: float


def _size(t: Floats) -> Floats:
    """Frobenius norm of (..., 3, 3)."""
    return np.sqrt(np.einsum("...ij,...ij->...", t, t))


def _deviator(t: Floats) -> Floats:
    return t - np.trace(t, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)


def measure(setting: Setting, step: Step) -> Measures:
    """All measures of an increment."""
    s, u = setting, step.displacement[setting.elements]
    start, nodes = s.rest if s.small else step.start.nodes, step.start.nodes + step.displacement
    strained = place(start + step.displacement / 2 if s.midpoint else start, s.elements, s.quadrature, s.axisymmetric)
    ended = place(nodes if s.midpoint else start, s.elements, s.quadrature, s.axisymmetric)
    G = displacement_gradient(strained, u)
    spin = (G[..., 1, 0] - G[..., 0, 1]) / 2 if s.midpoint else np.zeros(G.shape[:2])
    angle = 2 * np.arctan(spin / 2)
    # The volume where the strain is taken, as the displacement gradient G has it.
    midway = ended.volume * (np.exp(-np.trace(G, axis1=-2, axis2=-1) / 2) if s.midpoint else 1.0)
    strain = turned(with_fitted_trace(s, (G + G.swapaxes(-1, -2)) / 2, midway), rotation(angle / 2))
    Q = rotation(angle)
    blur = _blur(s, step, strained, u)
    contact = contact_measures(s, step, ended)
    elastic, flow, yielding = _material(s, step, strain, Q, blur)
    stored, spent, plastic = _energies(s, step, G, Q, ended)
    unsure = float((ended.volume * _size(step.end.stress) * blur / (2 * s.shear)).sum())
    begun, ended_by, _ = step.loads
    applied = float(np.vdot((begun + ended_by) / 2, step.displacement))
    supports, terms = work_of_supports(s, step, ended)
    energies = contact.work + applied + supports, stored, spent, contact.spent
    middles = [start + step.displacement / 2] if s.midpoint else []
    return Measures(
        equilibrium=_equilibrium(s, step, ended, blur),
        yielding=yielding,
        elastic=elastic,
        flow=flow,
        penetration=contact.penetration,
        inside=contact.inside,
        past=contact.past,
        between=between(s, step.tools, step.end.nodes),
        driven=driven(step),
        placed=placed(s, step),
        law=contact.law,
        orientation=min(orientation(x, s.elements, s.axisymmetric, straight=True) for x in [step.end.nodes, *middles]),
        plastic=_share(plastic, unsure, (*energies, step.energy)),
        friction=_share(contact.lost, contact.unsure, (*energies, step.energy)),
        energies=energies,
        resolution=contact.resolution,
        terms=contact.moved + terms + float(np.vdot(np.abs(begun + ended_by) / 2, np.abs(step.displacement))),
    )


def _blur(s: Setting, step: Step, placed: Placed, u: Floats) -> Floats:
    """Stress (e, q) that round-off of the displacements can make."""
    last = np.abs(u) + (np.abs(step.end.nodes[s.elements]) if step.by_difference else 0.0)
    strain = np.einsum("eai,eqaj->eq", last, np.abs(placed.slopes)) + np.einsum("ea,eqa->eq", last[..., 0], placed.hoop)
    none = float(np.finfo(np.float64).eps)
    plastic = _size(step.end.plastic_strain) + _size(step.start.plastic_strain)
    cancelled = (3 * s.bulk + 2 * s.shear) * strain + 2 * s.shear * plastic + _size(step.end.stress)
    return EPS * cancelled + 2 * s.shear * none


def _equilibrium(s: Setting, step: Step, placed: Placed, blur: Floats) -> float:
    c, count = step.contacts, len(step.end.nodes)
    element = element_forces(placed, with_fitted_trace(s, step.end.stress, placed.volume))
    forces = c.vectors(step.end.forces)
    residual = nodal(s.elements, element, count) - step.loads[1] - c.on_nodes(forces)
    residual = s.freed(residual)
    # What the body carried at the start counts: unloading ends where forces are what solving has left of them.
    carried = [element, element_forces(placed, step.start.stress)]
    acting = np.linalg.norm(s.freed(step.loads[1]), axis=1)
    scale = max(float((nodal(s.elements, np.linalg.norm(f, axis=-1), count) + acting).max()) for f in carried)
    lever = np.abs(placed.slopes).sum(axis=-1) + placed.hoop
    round_off = nodal(s.elements, np.einsum("eq,eqa,eq->ea", blur, lever, placed.volume), count)
    round_off += EPS * (c.on_nodes(np.linalg.norm(forces, axis=1)) + step.loads[2])
    return beyond(np.linalg.norm(residual, axis=1), round_off, scale)


def _material(s: Setting, step: Step, strain: Floats, Q: Floats, blur: Floats) -> tuple[float, float, float]:
    """Elastic law, flow rule and yield."""
    start, end = step.start, step.end
    before = turned(start.stress, Q)
    flowed = end.plastic_strain - turned(start.plastic_strain, Q)
    # Volume changes elastically: what round-off of the plastic strains makes of their trace is no strain, however large
    # the bulk modulus. A trace beyond that is left over by the flow rule.
    volume = (s.bulk * np.trace(strain, axis1=-2, axis2=-1))[..., None, None] * np.eye(3)
    stress = before + 2 * s.shear[..., None, None] * _deviator(strain - flowed) + volume
    largest = max(float(_size(end.stress).max()), float(_size(start.stress).max()))
    elastic = beyond(_size(end.stress - stress), blur, largest)
    sigma_y = s.yield_stress(end.peeq)
    deviator = _deviator(end.stress)
    equivalent = np.sqrt(1.5) * _size(deviator)
    direction = deviator / np.maximum(_size(deviator), np.finfo(float).tiny)[..., None, None]
    left, gamma = _flow_left(step, flowed, direction, Q)
    off = np.minimum(2 * s.shear * gamma, np.maximum(sigma_y - equivalent, 0.0))
    # A flow below the round-off of the plastic strain it is the difference of has no direction, nor has a deviator
    # below that of the pressure it stands beside.
    turned_by = EPS * _size(end.stress) / np.maximum(_size(deviator), np.finfo(float).tiny)
    unsure = 4 * blur + 2 * s.shear * (EPS + turned_by) * _size(flowed)
    # What never yields does not flow at all.
    scale = np.where(np.isfinite(sigma_y), sigma_y, 2 * s.shear)
    flow = beyond(np.maximum(2 * s.shear * left, off) / scale, unsure / scale, 1.0)
    return elastic, flow, beyond(equivalent / sigma_y - 1, EPS * (1 + _size(end.stress) / sigma_y), 1.0)


def _energies(s: Setting, step: Step, G: Floats, Q: Floats, placed: Placed) -> tuple[float, float, float]:
    """Energy stored and plastic dissipation by the mean of start and end, and the dissipation by the end's stress."""
    before, end = turned(step.start.stress, Q), step.end.stress
    flowed = step.end.plastic_strain - turned(step.start.plastic_strain, Q)
    # The volume at the start, as the displacement gradient G has it.
    begun = np.exp(-np.trace(G, axis1=-2, axis2=-1)) if s.midpoint else np.ones(placed.volume.shape)
    S = (begun[..., None, None] * before + end) / 2

    def over_volume(a: Floats, b: Floats) -> float:
        return float(np.einsum("eq,eqij,eqij->", placed.volume, a, b))

    return over_volume(S, _compliance(s, end - before)), over_volume(S, flowed), over_volume(end, flowed)


def _share(lost: float, unsure: float, energies: tuple[float, ...]) -> float:
    """What is dissipated, or at least what round-off leaves of a loss, over the largest of ``energies``."""
    if lost >= -unsure:
        return max(lost, 0.0) / (max(map(abs, energies)) or 1.0)
    return (lost + unsure) / max(map(abs, energies))


def _flow_left(step: Step, flowed: Floats, direction: Floats, Q: Floats) -> tuple[Floats, Floats]:
    """What (e, q) of (de_p, sqrt(3/2) dp) :func:`flow_left` leaves with the flow before and (n, 1), and gamma."""
    points = flowed.shape[:2]
    root = np.sqrt(1.5)

    def column(tensor: Floats, peeq: Floats) -> Floats:
        return np.concatenate([tensor.reshape(*points, 9), root * peeq[..., None]], axis=-1)

    none = np.zeros((*points, 3, 3)), np.zeros(points)
    strain, peeq = step.flow if step.flow is not None else none
    want = column(flowed, step.end.peeq - step.start.peeq)
    return flow_left(want, column(turned(strain, Q), peeq), column(direction, np.full(points, 1 / root)))


def flow_left(want: Floats, f: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Least |want - a f - gamma n| (...) of vectors (..., k) over a in [0, 1], gamma >= 0, and the gamma."""
    nn, nf, ff = np.vecdot(n, n), np.vecdot(n, f), np.vecdot(f, f)

    def across(v: Floats) -> Floats:
        return v - (np.vecdot(v, n) / nn)[..., None] * n

    # Flow that goes on straight is nearly along n: what is across it must not be a difference of products, nor meet
    # what is along it in `want`, which round-off leaves not quite at right angles.
    beside = across(f)
    apart = np.vecdot(beside, beside)
    both = np.divide(np.vecdot(across(want), beside), apart, out=np.zeros(nn.shape), where=apart > 0)
    alone = np.divide(np.vecdot(want, f), ff, out=np.zeros(nn.shape), where=ff > 0)
    least, best = np.full(nn.shape, np.inf), np.zeros(nn.shape)
    for a in (0.0 * nn, 0.0 * nn + 1.0, np.clip(both, 0, 1), np.clip(alone, 0, 1)):
        gamma = np.maximum((np.vecdot(want, n) - a * nf) / nn, 0.0)
        left = np.linalg.norm(want - a[..., None] * f - gamma[..., None] * n, axis=-1)
        better = left < least
        least, best = np.where(better, left, least), np.where(better, gamma, best)
    return least, best


def _compliance(s: Setting, stress: Floats) -> Floats:
    mean = np.trace(stress, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
    return (stress - mean) / (2 * s.shear[..., None, None]) + mean / (3 * s.bulk[..., None, None])
