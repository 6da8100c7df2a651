r"""Friction that contact in means leaves out, because slips of different directions cancel within a mean.

A mean p (:mod:`bipot.contact.sampling`) rubs against its mean slip. Where the tool turns about its normal, or the body
parts beneath it, slips in a mean have several directions, and the pressure p_p psi_p would do more work against them:

    l_p = s_p (int psi_p |u_t| dA - |P_p int psi_p u_t dA|) / int psi_p dA,    s_p = min(mu r_n, cap),

with the slips u_t = sum_k N_k u_k of the facets, those of their nodes u_k being what they move along the tool, and P_p
what symmetry leaves of a mean. It is never negative, as psi_p is not, and zero where the slips of each mean go one way.
The law is met at the means, so that no certificate shows it. The part is that of the work in the increment,

    sum_p l_p / (|W| + sum_p l_p),

for a rigid lid that turns on a face all of which slides the part of the moment that is left out, and zero at nodes.
Slips are those of the whole increment, also in the air. In an increment in which tools and supports rest there is no
work, and what nodes creep within their means may be all of it: there it is one.
"""

from __future__ import annotations

import numpy as np

from bipot.contact.sampling import hats
from bipot.fem.elements import facet
from bipot.fem.surface import facet_weights
from bipot.iterate import Iterate
from bipot.tensors import norm
from bipot.typing import Floats, einsum

ROUND_OFF = 64 * float(np.finfo(float).eps)
"""Of a slip over the size of the body."""


def cancelled(iterate: Iterate, r: Floats) -> float:
    """The part of the increment's work by which friction under contact forces r (c, d) is too small, in [0, 1]."""
    contacts = iterate.increment.system.candidates
    if not any(own.weighted for own in contacts.points):
        return 0.0
    limit = np.where(iterate.rows.tied, 0.0, iterate.rows.limit(r))
    lost = float(limit @ _parted(iterate))
    if lost <= ROUND_OFF * contacts.scene.mesh.size * float(limit.sum()):
        return 0.0
    return lost / (abs(iterate.work(r)) + lost)


def _parted(iterate: Iterate) -> Floats:
    """By how much the mean length of the slips of candidates (c,) is more than the length of their mean."""
    contacts = iterate.increment.system.candidates
    scene, d = contacts.scene, contacts.scene.mesh.dimension
    lengths, slips = np.zeros(len(contacts.node)), np.zeros((len(contacts.node), d))
    for nodal, own, number in zip(_slips(iterate), contacts.points, contacts.number, strict=True):
        if not own.weighted:
            continue
        table = facet(own.lines.shape[1], d)
        psi = table.values @ hats(own.lines.shape[1], d).T
        weight = einsum("fq,qk->fqk", facet_weights(scene.mesh.nodes, own.lines, scene.geometry), psi)
        area = np.bincount(own.edges.ravel(), weight.sum(axis=1).ravel())
        slip = table.values @ nodal[own.lines]
        length, mean = np.zeros(len(area)), np.zeros((len(area), d))
        np.add.at(length, own.edges, einsum("fqk,fq->fk", weight, norm(slip)))
        np.add.at(mean, own.edges, einsum("fqk,fqd->fkd", weight, slip))
        mine = number >= 0
        lengths[number[mine]] = length[mine] / area[mine]
        slips[number[mine]] = mean[mine] / area[mine, None]
    # In a plane a mean that continues beyond an axis or a plane of symmetry does not slip, nor do supports move it.
    still = ~(contacts.tangent_free | contacts.tangent_held)
    return np.maximum(lengths - np.where(still, 0.0, norm(contacts.means.kept(slips))), 0.0)


def _slips(iterate: Iterate) -> Floats:
    """What nodes (tools, a, d) move along each tool, zero for those that are in no mean at it.

    In a plane that is an arc, of which a curved tool turns the direction from node to node: its first component.
    """
    increment, contacts, du = iterate.increment, iterate.increment.system.candidates, iterate.response.du
    owner, apart = contacts.means.owner, contacts.means.apart()
    gone, frames = iterate.tool_travel[contacts.tool[owner]], iterate.frames
    if contacts.curved:
        gone = gone + increment.tools.carried(du, iterate.advance)
    else:
        frames = frames[owner]
    slip = apart.motion(du) - gone
    slip = slip - np.vecdot(slip, frames[:, 0])[:, None] * frames[:, 0]
    if slip.shape[1] == 2:
        slip = np.vecdot(slip, frames[:, 1])[:, None] * (1.0, 0.0)
    out = np.zeros((len(contacts.scene.tools), *du.shape))
    out[contacts.tool[owner], contacts.means.weights.indices] = slip
    return out
