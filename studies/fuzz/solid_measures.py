r"""Increments of bodies in space under tools, judged from their stored arrays by the study's own mechanics.

Each measure is over the largest number of its kind, with what double precision cannot tell from zero taken off first:

* equilibrium: nodal residual where free, over the largest nodal sum of |element forces| and |loads|;
* yielding: (sigma_eq - sigma_Y(p))+ / sigma_Y(p);
* elastic: sigma - R sigma_n R' - 2 G dev (de - de_p) - K tr de 1, over the largest stress;
* penetration: (-gap)+ of every point of the tools' boundaries, and of their nodes that are held along the normal, over
  the size of the body; points are nodes, or the study's own means of nodes (:mod:`studies.independent.fans`);
* past: the force of who is past an open end of a tool, over the largest of the run;
* between: how deep the faces that a tool may touch are in it, anywhere, over what is allowed
  (:mod:`studies.fuzz.solid_between`);
* disc: |r - P_K(r - rho (u + mu |u_t| n))| over the largest contact force of the run, u = (gap, slip), K the cone of
  both tangents; what is tied rests. Where supports or planes of symmetry hold both, no friction is of an unknown;
* orientation: least det J over its element's mean, sampled densely, at the end and at the middle;
* plastic, friction: what the increment dissipates over the largest energy so far;
* placed: how far held nodes are from where supports ask for them, and coordinates of driven tools from where increments
  take them, over the size;
* balance: resultant and moment of the forces of tools, loads and supports as the library states them, over their sizes;
* stated: forces and moments of whole tools that are not the sums of nodal ones, over their sizes, nor what drives
  them, and tools that are elsewhere;
* energies: the increment's work and its three parts, off what the library states beyond the round-off of work, over the
  largest energy so far; where supports are driven their work is not made a second time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.control.accepted import Accepted
from bipot.fem.strain import Configuration
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed
from bipot.tools.deformable import DeformableTool
from bipot.typing import Floats, einsum, vdot
from studies.fuzz.metals import bulk_and_shear, yield_stress_of
from studies.fuzz.record import carried
from studies.fuzz.solid_between import between
from studies.fuzz.solid_contacts import touching
from studies.fuzz.solid_held import freed, misplaced, planes_of, whole_size
from studies.fuzz.solid_loads import loads_at
from studies.fuzz.solid_movable import FREE
from studies.fuzz.solid_stated import balance, jumped, over, past, stated
from studies.fuzz.solid_surfaces import bent
from studies.fuzz.solid_touching import Touching
from studies.independent.solid import (
    displacement_gradient,
    element_forces,
    fitted,
    nodal,
    nodal_stiffness,
    orientation,
    place,
    rotation,
    turned,
)

EPS = 256 * float(np.finfo(np.float64).eps)
"""Round-off over the terms that cancel: sums of up to some hundreds of products."""

MANDEL = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


@dataclass(frozen=True)
class SolidMeasures:
    """The module docstring's numbers.

    ``largest_energy`` is that of the modelled part so far, ``resolution`` the contact force that round-off of the
    places of bodies and tools can make.
    """

    equilibrium: float
    yielding: float
    elastic: float
    penetration: float
    past: float
    between: float
    disc: float
    orientation: float
    plastic: float
    friction: float
    placed: float
    balance: float
    stated: float
    energies: float
    largest_energy: float
    resolution: float


def full(mandel: Floats) -> Floats:
    """Tensors (..., 3, 3) of Mandel vectors (..., 6)."""
    out = np.zeros((*mandel.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(MANDEL):
        out[..., i, j] = out[..., j, i] = mandel[..., k] / (1.0 if i == j else np.sqrt(2.0))
    return out


def _size(t: Floats) -> Floats:
    return np.sqrt(einsum("...ij,...ij->...", t, t))


def _deviator(t: Floats) -> Floats:
    return t - np.trace(t, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)


def images(scene: Scene) -> int:
    """How many images make the whole body."""
    return 2 ** len(planes_of(scene))


@dataclass(frozen=True)
class _Strained:
    """Strain increment and rotation (e, q, 3, 3), volumes of start and end (e, q), the blur of stresses (e, q)."""

    strain: Floats
    Q: Floats
    begun: Floats
    forces: Floats
    volume: Floats
    stiffness: Floats
    lever: Floats
    blur: Floats


def _strained(scene: Scene, accepted: Accepted) -> _Strained:
    start, end, elements = accepted.start, accepted.state, scene.mesh.elements
    midpoint, small = scene.configuration is Configuration.MIDPOINT, scene.configuration is Configuration.SMALL
    begin = scene.mesh.nodes if small else start.nodes
    rule, (bulk, shear) = scene.rule.value, bulk_and_shear(scene)
    strained = place(begin + end.du / 2 if midpoint else begin, elements, rule)
    ended = place(begin + end.du if midpoint else begin, elements, rule)
    G = displacement_gradient(strained, end.du[elements])
    spin = np.stack([G[..., 2, 1] - G[..., 1, 2], G[..., 0, 2] - G[..., 2, 0], G[..., 1, 0] - G[..., 0, 1]], axis=-1)
    spin = spin / 2 * midpoint
    strain = turned((G + G.swapaxes(-1, -2)) / 2, rotation(spin, 0.5))
    trace = np.trace(strain, axis1=-2, axis2=-1)
    # The volume where the strain is taken, as the displacement gradient G has it.
    midway = ended.volume * (np.exp(-trace / 2) if midpoint else 1.0)
    held_trace = fitted(trace, midway, scene.mesh.nodes[elements], rule, scene.volume_change.value)
    strain = strain + (held_trace - trace)[..., None, None] / 3 * np.eye(3)
    stiff = 3 * bulk + 2 * shear
    last = einsum("eai,eqaj->eq", np.abs(end.du[elements]), np.abs(strained.slopes))
    plastic = _size(full(end.plastic_strain)) + _size(full(start.plastic_strain))
    blur = EPS * (stiff * last + 2 * shear * plastic + _size(full(end.stress)) + _size(full(start.stress)))
    return _Strained(
        strain=strain,
        Q=rotation(spin, 1.0),
        begun=np.exp(-np.trace(G, axis1=-2, axis2=-1)) if midpoint else np.ones(G.shape[:2]),
        forces=element_forces(ended, full(end.stress)),
        volume=ended.volume,
        stiffness=nodal_stiffness(ended, elements, bulk, shear, len(begin)),
        lever=einsum("eq,eqa->ea", blur * ended.volume, np.abs(ended.slopes).sum(axis=-1)),
        blur=blur,
    )


@dataclass(frozen=True)
class Known:
    """What contact of parts adds: its points, the ``work`` of supports, and what rules of integration leave open.

    That are forces on nodes, ``unsure`` (a,), and the work of these, ``unsure_work``.
    """

    contact: Touching
    work: float
    unsure: Floats
    unsure_work: float


def measure(
    scene: Scene, accepted: Accepted, largest: float, energy: float, before: Floats, known: Known | None = None
) -> SolidMeasures:
    """All measures of an increment of a run of which ``largest`` is the largest contact force so far.

    ``energy`` is the largest energy so far, ``before`` (4,) what the library stated of energies before the increment.
    """
    start, end, elements = accepted.start, accepted.state, scene.mesh.elements
    s, contact = _strained(scene, accepted), touching(scene, accepted) if known is None else known.contact
    count, pushes = len(scene.mesh.nodes), contact.vectors(end.forces)
    begun, ended = carried(start, loads_at(scene, accepted, 0)), loads_at(scene, accepted, 1)
    residual = nodal(elements, s.forces, count) - ended - contact.on_nodes(pushes, count)
    residual = einsum("aij,aj->ai", freed(scene), residual)
    sizes = nodal(elements, np.linalg.norm(s.forces, axis=-1), count) + np.linalg.norm(ended, axis=1)
    acting = contact.on_nodes(np.linalg.norm(pushes, axis=1), count) + np.linalg.norm(ended, axis=1)
    noise = nodal(elements, s.lever, count) + EPS * acting + (0.0 if known is None else known.unsure)
    elastic, yielding = _material(scene, accepted, s)
    off, gap_off = _law(scene, contact, accepted, s.stiffness, largest)
    parts = _energies(scene, accepted, s, contact, (begun + ended) / 2)
    parts[0] += 0.0 if known is None else known.work
    said = accepted.energies
    after = np.array([said.work, said.elastic, said.plastic, said.friction])
    own, most = parts * images(scene), max(energy, float(np.abs(parts).max()))
    middle = [start.nodes + end.du / 2] if scene.configuration is Configuration.MIDPOINT else []
    lost = _lost(scene, accepted, s, contact)
    driven = known is None and any(isinstance(support, Prescribed) for support in scene.supports)
    unsure = _unsure_work(accepted, contact) + (0.0 if known is None else known.unsure_work)
    apart = np.maximum(np.abs(after - before - own) - images(scene) * unsure, 0.0)
    return SolidMeasures(
        equilibrium=over(np.maximum(np.linalg.norm(residual, axis=1) - noise, 0).max(), sizes.max()),
        yielding=yielding,
        elastic=elastic,
        penetration=gap_off,
        past=past(accepted, contact, largest),
        between=between(scene, accepted),
        disc=off,
        orientation=min(orientation(x, elements) for x in [end.nodes, *middle]),
        plastic=over(lost[0], most),
        friction=over(lost[1], most),
        placed=over(max(misplaced(scene, end.nodes - scene.mesh.nodes, end.tau), jumped(accepted)), scene.mesh.size),
        balance=balance(accepted, scene, contact, ended, sizes.sum()),
        stated=stated(scene, accepted, contact),
        energies=0.0 if driven else over(apart.max(), images(scene) * most),
        largest_energy=most,
        resolution=float((_stiff(scene, contact, s.stiffness) * contact.places).max(initial=0.0)),
    )


def _material(scene: Scene, accepted: Accepted, s: _Strained) -> tuple[float, float]:
    """Elastic law and yield."""
    (bulk, shear), start, end = bulk_and_shear(scene), accepted.start, accepted.state
    flowed = full(end.plastic_strain) - turned(full(start.plastic_strain), s.Q)
    volume = (bulk * np.trace(s.strain, axis1=-2, axis2=-1))[..., None, None] * np.eye(3)
    stress = turned(full(start.stress), s.Q) + 2 * shear[..., None, None] * _deviator(s.strain - flowed) + volume
    largest = max(float(_size(full(end.stress)).max()), float(_size(full(start.stress)).max()))
    off = np.maximum(_size(full(end.stress) - stress) - s.blur, 0.0).max()
    sigma_y = yield_stress_of(scene)(end.peeq)
    excess = np.sqrt(1.5) * _size(_deviator(full(end.stress))) / sigma_y - 1
    excess -= EPS * (1 + _size(full(end.stress)) / sigma_y)
    return over(off, largest), float(np.maximum(excess, 0.0).max())


def _law(scene: Scene, c: Touching, accepted: Accepted, stiffness: Floats, largest: float) -> tuple[float, float]:
    """Distance to the law over the largest force, and penetration over the size."""
    rho = _stiff(scene, c, stiffness)
    unsure = (1 + np.where(np.isinf(c.mu), 0.0, c.mu)) * rho * c.blur
    off = np.maximum(c.off(accepted.state.forces, rho) - unsure, 0.0).max(initial=0.0)
    # Who is past an open end is in no tool.
    sunk = np.where(c.past, 0.0, np.maximum(np.where(c.tied, np.abs(c.gap), -c.gap) - c.blur, 0.0)).max(initial=0.0)
    inside = max(0.0, c.inside - EPS * float(np.abs(accepted.state.nodes).max()))
    return over(off, largest), over(max(sunk, inside), scene.mesh.size)


def _stiff(scene: Scene, c: Touching, stiffness: Floats) -> Floats:
    """Of candidates (c,), what a gap costs as their nodes give way as they are loaded, w_a n / sum w^2, others at rest.

    The scale by which lengths are compared with forces; of nodes that cannot give way what they would have.
    """
    normal = c.frames[:, 0]
    gives = np.linalg.norm(einsum("wij,wj->wi", freed(scene)[c.part], normal), axis=-1) > FREE
    share = np.where(gives | ~(c.sums(gives) > 0)[c.owner], c.share, 0.0) ** 2
    along = einsum("wi,wij,wj->w", normal, stiffness[c.part], normal)
    if any(isinstance(tool, DeformableTool) for tool in scene.tools):
        # Of two parts one may be far softer: what one force on both makes them give way.
        return 1 / c.sums(np.divide(share, along, out=np.zeros_like(share), where=share > 0))
    return c.sums(share * along) / c.sums(share) ** 2


def _energies(scene: Scene, accepted: Accepted, s: _Strained, c: Touching, load: Floats) -> Floats:
    """Work, elastic, plastic, friction (4,) of the increment, each by the mean of start and end."""
    start, end = accepted.start, accepted.state
    bulk, shear = (modulus[..., None, None] for modulus in bulk_and_shear(scene))
    before, now = turned(full(start.stress), s.Q), full(end.stress)
    flowed = full(end.plastic_strain) - turned(full(start.plastic_strain), s.Q)
    S = (s.begun[..., None, None] * before + now) / 2
    change = now - before
    mean = np.trace(change, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
    stored = (change - mean) / (2 * shear) + mean / (3 * bulk)
    begun, ended = c.start_rubbed(start.forces), c.rubbed(end.forces)
    r, rubs = (begun + ended) / 2, c.not_in_air(whole_size(scene))
    pushed = c.vectors(r)
    if any(bent(tool) for tool in scene.tools):
        pushed = (c.start_vectors(begun) + c.vectors(ended)) / 2
    spent = np.vecdot(r[:, 1:], c.slip + c.dragged)
    begins = float(rubs @ c.not_yet(start.forces, end.forces)) / 2 + float((1 - rubs) @ spent)
    done = c.sums(np.vecdot(pushed, c.motion)) + r[:, 0] * c.opened
    # Who comes from afar does not come along its force: the tool's work is what body and friction take.
    taken = c.sums(np.vecdot(pushed, end.du[c.part])) - spent
    work = vdot(load, end.du) + np.where(c.apart, taken, done).sum() + begins
    rubbed = begins - float(spent.sum())
    parts = [einsum("eq,eqij,eqij->", s.volume, S, b) for b in (stored, flowed)]
    return np.array([work, *parts, rubbed], dtype=np.float64)


def _unsure_work(accepted: Accepted, c: Touching) -> float:
    """Round-off of work: of a tool that comes a long way to a body that gives little, a difference of large terms."""
    r = np.linalg.norm(accepted.start.forces, axis=1) + np.linalg.norm(accepted.state.forces, axis=1)
    return EPS * float(r @ (np.abs(c.opened) + c.at_most(np.linalg.norm(c.motion, axis=1)))) / 2


def _lost(scene: Scene, accepted: Accepted, s: _Strained, c: Touching) -> tuple[float, float]:
    """What the increment dissipates by the stress and the forces at its end, less what round-off makes of it."""
    start, end = accepted.start, accepted.state
    flowed = full(end.plastic_strain) - turned(full(start.plastic_strain), s.Q)
    unsure = float((s.volume * _size(full(end.stress)) * s.blur / (2 * bulk_and_shear(scene)[1])).sum())
    plastic = float(einsum("eq,eqij,eqij->", s.volume, full(end.stress), flowed)) + unsure
    lengths = c.at_most(np.linalg.norm(end.du[c.part], axis=1) + np.linalg.norm(c.motion, axis=1)) + c.unsure
    rubbed = -vdot(end.forces[:, 1:], c.slip) + EPS * float(np.linalg.norm(end.forces, axis=1) @ lengths)
    return plastic, rubbed
