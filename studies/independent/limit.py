r"""Whether a motion proves that a load is above the limit load, recomputed from plain arrays: nothing of the library.

A motion v of the nodes and w of the driven tools gains F . v + P . w from the loads. Where no volume changes and
contacts open by at least mu times their slip (those that are welded move along), no stress within the yield surface and
no forces within Coulomb's cone do more work than sum_q w sqrt(2/3) sigma_Y |dev D(v)|, sigma_Y the one that hardening
ends with. A load that gains more is carried by none of them. A motion that costs nothing until an open contact lands
proves nothing: the load may be carried from there on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.data import Bools, Contacts, Floats, Led, Setting
from studies.independent.element import displacement_gradient, place
from studies.independent.volume import fitted

HARDENED = 1e9
"""A plastic strain after which a yield stress that has an end has come to it."""

FEW = 8 * float(np.finfo(np.float64).eps)
"""Round-off of what a strain is summed of, over the motion."""

FREE = 1e-12
"""A component of a unit vector below this is none."""


@dataclass(frozen=True)
class Collapse:
    """What is claimed: ``motion`` (a, 2) of the nodes ``placed`` (a, 2) under nodal ``loads`` (a, 2), forces on tools.

    ``contacts`` are all candidates, ``touching`` (c,) says which of them touch. Driven tools that touch nothing rest,
    or follow the body where they are ``following``: they go as far as they can without coming nearer to it.
    """

    placed: Floats
    motion: Floats
    loads: Floats
    led: Led
    contacts: Contacts
    touching: Bools
    following: bool = False


@dataclass(frozen=True)
class Proof:
    """Over the ``gain`` of the load: change of volume as work of the yield stress, and dissipation, ``carried``.

    Over the largest motion of a node or tool: how far contacts that touch are ``overtaken``, open ones come ``nearer``,
    and held nodes move, ``held``.
    """

    gain: float
    volume: float
    carried: float
    overtaken: float
    nearer: float
    held: float


def judged(s: Setting, c: Collapse, ways: Floats | None = None) -> Proof:
    """The inequalities of a claim; the driven tools go by ``ways`` (m,), or as far as their contacts let them."""
    if ways is None:
        ways = np.array([_farthest(c, k) for k in range(len(c.led.tool))])
    gain = float(np.vdot(c.loads, c.motion) + c.led.force @ ways)
    largest = float(max(np.abs(c.motion).max(), np.abs(ways).max(initial=0.0)))
    if not (gain > 0 and largest > 0):
        return Proof(gain, *[np.inf] * 5)
    volume, carried = _spent(s, c)
    overtaken, nearer = _closing(c, ways)
    held = float(np.abs(s.along(c.motion)[s.held]).max(initial=0.0))
    return Proof(gain, volume / gain, carried / gain, overtaken / largest, nearer / largest, held / largest)


def rigid_part(s: Setting, placed: Floats, motion: Floats) -> Floats:
    """The rigid motion (a, 2) nearest to ``motion`` (a, 2) of nodes at ``placed`` (a, 2): along the axis of a ring.

    What a search leaves of strain beside it dissipates nothing by itself, but times a stress that hardens for ever.
    """
    along, across = np.zeros_like(placed), np.zeros_like(placed)
    along[:, 1], across[:, 0] = 1.0, 1.0
    x = placed - placed.mean(axis=0)
    turn = np.column_stack([-x[:, 1], x[:, 0]]) / s.size
    basis = np.stack([along] if s.axisymmetric else [along, across, turn]).reshape(-1, placed.size).T
    return (basis @ np.linalg.lstsq(basis, motion.ravel())[0]).reshape(placed.shape)


def _spent(s: Setting, c: Collapse) -> tuple[float, float]:
    """Largest change of volume as work of the yield stress, and dissipation, beyond the round-off of the motion."""
    at = place(c.placed, s.elements, s.quadrature, s.axisymmetric)
    # A translation strains nothing, and what is added to it has its round-off; across an axis there is none.
    moved = c.motion - c.motion.mean(axis=0) * ((0.0, 1.0) if s.axisymmetric else (1.0, 1.0))
    G = displacement_gradient(at, moved[s.elements])
    strain = (G + G.swapaxes(-1, -2)) / 2
    change = np.trace(strain, axis1=-2, axis2=-1)
    deviator = strain - change[..., None, None] / 3 * np.eye(3)
    change = fitted(s, change, at.volume)
    blur = FEW * np.abs(c.motion).max() * (np.abs(at.slopes).sum(axis=(-2, -1)) + at.hoop.sum(axis=-1))
    size = np.sqrt(np.einsum("eqij,eqij->eq", deviator, deviator))
    change, size = (np.maximum(value - blur, 0.0) for value in (np.abs(change), size))
    sigma_y = s.yield_stress(np.full(at.volume.shape, HARDENED))
    # Volume is asked as the library asks it, by what work it may take: that of the yield stress.
    worst = float(change.max() * at.volume.sum() * sigma_y.max())
    return worst, float(np.sqrt(2 / 3) * (at.volume * sigma_y * size).sum())


def _farthest(c: Collapse, k: int) -> float:
    """The longest way of a driven tool along its force on which no contact is overtaken.

    Each contact asks (n . v - w n . d) >= mu |t . v - w t . d|, two inequalities of the way w, a weld for w = d . v.
    Where none ends it the tool rests, or follows, if it would land on the body, and else makes the whole gain one at
    least.
    """
    contacts, direction = c.contacts, c.led.direction[k]
    own, v, parts = contacts.tool == c.led.tool[k], contacts.weights @ c.motion, contacts.parts
    mine = own & c.touching
    welded = mine & contacts.welded
    mu = np.where(contacts.welded | ~contacts.rubs, 0.0, contacts.mu)[parts.owner, None]
    ways = [v[welded] @ direction]
    for sign in (-1.0, 1.0):
        leaning = contacts.normal + sign * mu * contacts.tangent
        resists = parts.mean(leaning @ direction)
        ends = mine & ~welded & (resists > FREE)
        ways.append(parts.mean(np.vecdot(leaning, c.motion[parts.node]))[ends] / resists[ends])
    if sum(map(len, ways)):
        return float(np.concatenate(ways).min())
    lands = c.led.normal[k] @ direction
    if lands > FREE and c.following:
        return float((v[own] @ c.led.normal[k]).min() / lands)
    return 0.0 if lands > FREE else (1 + abs(float(np.vdot(c.loads, c.motion)))) / float(c.led.force[k])


def _closing(c: Collapse, ways: Floats) -> tuple[float, float]:
    """How far (a length) contacts close or open by less than mu times their slip, and how far open ones come nearer.

    That by more than contacts open by as they slip: the body itself slips without opening.
    """
    contacts, parts = c.contacts, c.contacts.parts
    x, v = c.placed[parts.node], c.motion[parts.node]
    for k, (number, gone) in enumerate(zip(c.led.tool, ways, strict=True)):
        own = contacts.met == number
        v[own] -= gone * c.led.ways(k, x[own])
    stretch = 1.0 if contacts.curved is None else contacts.curved.stretch[1]
    opened = parts.mean(np.vecdot(contacts.normal, v))
    slip = np.where(contacts.rubs, np.abs(parts.mean(stretch * np.vecdot(contacts.tangent, v))), 0.0)
    welded = contacts.welded
    dilated = np.where(welded, 0.0, contacts.mu) * slip
    short = np.where(welded, np.abs(opened) + slip, dilated - opened)[c.touching].max(initial=0.0)
    nearer = -opened[~c.touching].min(initial=0.0) - 2 * dilated[c.touching].max(initial=0.0)
    return float(short), max(float(nearer), 0.0)
