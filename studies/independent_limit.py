r"""Whether a motion proves that a load is above the limit load, recomputed from plain arrays: nothing of the library.

A motion v of the nodes and w of the driven tools gains F . v + P . w from the loads. Where no volume changes and contacts
open by at least mu times their slip (those that are welded move along), no stress within the yield surface and no forces
within Coulomb's cone do more work than sum_q w sqrt(2/3) sigma_Y |dev D(v)|, sigma_Y the one that hardening ends with.
A load that gains more is carried by none of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent_data import Contacts, Floats, Led, Setting
from studies.independent_element import displacement_gradient, place

HARDENED = 1e9
"""A plastic strain after which a yield stress that has an end has come to it."""

FREE = 1e-12
"""A component of a unit vector below this is none."""


@dataclass(frozen=True)
class Collapse:
    """What is claimed: ``motion`` (a, 2) of the nodes ``placed`` (a, 2) under nodal ``loads`` (a, 2), forces on tools.

    ``contacts`` are those that touch, ``tied`` (c,) among them those that are welded.
    """

    placed: Floats
    motion: Floats
    loads: Floats
    led: Led
    contacts: Contacts


@dataclass(frozen=True)
class Proof:
    """Over the gain: change of volume as work of the yield stress, dissipation; how far contacts are overtaken.

    The last over the largest motion of a node or tool, and ``held`` the largest of a held node over that. ``gain`` is
    what the load gains; ``translations`` (m,) are those of the driven tools.
    """

    gain: float
    volume: float
    carried: float
    overtaken: float
    held: float
    translations: Floats


def judged(s: Setting, c: Collapse) -> Proof:
    """The inequalities of a claim; the tools that forces drive go as far as their contacts let them."""
    tools = np.array([_farthest(c, k) for k in range(len(c.led.tool))])
    at = place(c.placed, s.elements, s.quadrature, s.axisymmetric)
    G = displacement_gradient(at, c.motion[s.elements])
    strain = (G + G.swapaxes(-1, -2)) / 2
    change = np.trace(strain, axis1=-2, axis2=-1)
    deviator = strain - change[..., None, None] / 3 * np.eye(3)
    sigma_y = s.yield_stress(np.full(at.volume.shape, HARDENED))
    flow = np.sqrt(2 / 3) * np.sqrt(np.einsum("eqij,eqij->eq", deviator, deviator))
    gain = float(np.vdot(c.loads, c.motion) + c.led.force @ tools)
    largest = float(max(np.abs(c.motion).max(), np.abs(tools).max(initial=0.0)))
    if not (gain > 0 and largest > 0):
        return Proof(gain, np.inf, np.inf, np.inf, np.inf, tools)
    return Proof(
        gain=gain,
        volume=float(np.abs(change).max() * at.volume.sum() * sigma_y.max()) / gain,
        carried=float((at.volume * sigma_y * flow).sum()) / gain,
        overtaken=_overtaken(c, tools) / largest,
        held=float(np.abs(c.motion[s.held]).max(initial=0.0)) / largest,
        translations=tools,
    )


def _farthest(c: Collapse, k: int) -> float:
    """The longest way of a driven tool along its force on which no contact is overtaken.

    Each contact asks (n . v - w n . d) >= mu |t . v - w t . d|, two inequalities of the way w; a weld asks for w = d . v.
    Where none ends it the tool rests if it would come upon other nodes of the body, which nothing here tells of, and
    else goes as far as makes its gain one.
    """
    contacts, direction, mine = c.contacts, c.led.direction[k], c.contacts.tool == c.led.tool[k]
    welded, v = mine & np.isinf(contacts.mu), c.motion[contacts.node]
    ways = [v[welded] @ direction]
    for sign in (-1.0, 1.0):
        leaning = contacts.normal + sign * np.where(np.isinf(contacts.mu), 0.0, contacts.mu)[:, None] * contacts.tangent
        resists = leaning @ direction
        ends = mine & ~welded & (resists > FREE)
        ways.append(np.vecdot(leaning, v)[ends] / resists[ends])
    if sum(map(len, ways)):
        return float(np.concatenate(ways).min())
    return 0.0 if c.led.normal[k] @ direction > FREE else 1 / float(c.led.force[k])


def _overtaken(c: Collapse, tools: Floats) -> float:
    """How far (a length over time) contacts close, or open by less than mu times their slip."""
    contacts, way = c.contacts, np.zeros((len(c.contacts.node), 2))
    for number, direction, gone in zip(c.led.tool, c.led.direction, tools, strict=True):
        way[contacts.tool == number] = gone * direction
    v = c.motion[contacts.node] - way
    opened, slip = np.vecdot(contacts.normal, v), np.abs(np.vecdot(contacts.tangent, v))
    welded = np.isinf(contacts.mu)
    short = np.where(welded, np.abs(opened) + slip, np.where(welded, 0.0, contacts.mu) * slip - opened)
    return float(np.maximum(short, 0.0).max(initial=0.0))
