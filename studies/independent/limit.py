"""Whether a motion proves that a load in the plane is above the limit load: see :mod:`studies.independent.collapse`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from studies.independent.candidates import Contacts
from studies.independent.collapse import FEW, HARDENED, Pressed, Proof, Worked, closing, rigid, spent, ways_of
from studies.independent.data import Bools, Floats, Led, Setting
from studies.independent.element import displacement_gradient, place
from studies.independent.volume import fitted


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


def judged(s: Setting, c: Collapse, ways: Floats | None = None) -> Proof:
    """The inequalities of a claim; the driven tools go by ``ways`` (m,), or as far as their contacts let them."""
    if ways is None:
        farthest = [_pressed(c, k).farthest(c.following) for k in range(len(c.led.tool))]
        ways = ways_of(farthest, c.led.force, c.loads, c.motion)
    held = float(np.abs(s.along(c.motion)[s.held]).max(initial=0.0))
    return Worked(c.motion, ways, c.loads, c.led.force, _spent(s, c), _closing(c, ways), held).proof()


def rigid_part(s: Setting, placed: Floats, motion: Floats) -> Floats:
    """The rigid motion (a, 2) nearest to ``motion`` (a, 2) of nodes at ``placed`` (a, 2): along the axis of a ring."""
    along, across = np.zeros_like(placed), np.zeros_like(placed)
    along[:, 1], across[:, 0] = 1.0, 1.0
    x = placed - placed.mean(axis=0)
    turn = np.column_stack([-x[:, 1], x[:, 0]]) / s.size
    every = np.stack([along] if s.axisymmetric else [along, across, turn])
    return rigid(motion, every, s.along(every)[:, s.held])


def _spent(s: Setting, c: Collapse) -> tuple[float, float]:
    """Largest change of volume as work of the yield stress, and dissipation, beyond the round-off of the motion."""
    at = place(c.placed, s.elements, s.quadrature, s.axisymmetric)
    # A translation strains nothing, and what is added to it has its round-off; across an axis there is none.
    moved = c.motion - c.motion.mean(axis=0) * ((0.0, 1.0) if s.axisymmetric else (1.0, 1.0))
    blur = FEW * np.abs(c.motion).max() * (np.abs(at.slopes).sum(axis=(-2, -1)) + at.hoop.sum(axis=-1))
    sigma_y = s.yield_stress(np.full(at.volume.shape, HARDENED))
    fit = partial(fitted, s, weight=at.volume)
    return spent(displacement_gradient(at, moved[s.elements]), blur, at.volume, sigma_y, fit)


def _pressed(c: Collapse, k: int) -> Pressed:
    """The points of a flat driven tool; where a body beyond a plane slips the other way none has friction."""
    contacts, own = c.contacts, c.contacts.tool == c.led.tool[k]
    return Pressed(
        v=(contacts.weights @ c.motion)[own],
        mu=np.where(contacts.welded | ~contacts.rubs, 0.0, contacts.mu)[own],
        touching=c.touching[own],
        welded=contacts.welded[own],
        normal=c.led.normal[k],
        direction=c.led.direction[k],
    )


def _closing(c: Collapse, ways: Floats) -> tuple[float, float]:
    """What contacts do as driven tools go their ways."""
    contacts, parts = c.contacts, c.contacts.parts
    x, v = c.placed[parts.node], c.motion[parts.node]
    for k, (number, gone) in enumerate(zip(c.led.tool, ways, strict=True)):
        own = contacts.met == number
        v[own] -= gone * c.led.ways(k, x[own])
    stretch = 1.0 if contacts.curved is None else contacts.curved.stretch[1]
    opened = parts.mean(np.vecdot(contacts.normal, v))
    slip = np.where(contacts.rubs, np.abs(parts.mean(stretch * np.vecdot(contacts.tangent, v))), 0.0)
    return closing(opened, slip, contacts.mu, contacts.welded, c.touching)
