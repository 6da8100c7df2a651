r"""Friction that contact in means leaves out, because slips of different directions cancel within a mean.

Friction of a mean p (:mod:`bipot.contact.sampling`) opposes its mean slip. Where the tool turns about its normal, or
the body under it spreads from a line or a point, slips within a mean differ in direction, and friction at the pressure
p_p psi_p would do more work against them than against their mean, by

    l_p = s_p (int psi_p |u_t| dA - |P_p int psi_p u_t dA|) / int psi_p dA,    s_p = min(mu r_n, cap),

with the slips u_t = sum_k N_k u_k of the facets, where nodes move by u_k along the tool, and P_p the projection of a
mean by planes of symmetry. At deformable tools (:mod:`bipot.tools.facing`) the integrals are those over what faces the
tool, and slips those of both sides, u_t = sum_k N_k u_k - sum_l N_l u_l. It is never negative, because psi_p is not,
and zero where the slips in each mean have one direction. The law is met at the means, so that no certificate shows it.
What is returned is the part

    sum_p l_p / (|W| + sum_p l_p)

of the work W in the increment: zero for contact at nodes, and for a rigid lid that turns on a face, all of which
slides, the part of the moment that is left out. Slips in the air are included. Where tools and supports rest there may
be no work other than that of nodes that creep within their means; the part is then one.
"""

from __future__ import annotations

import numpy as np

from bipot.contact.sampling import Points, hats
from bipot.fem.elements import facet
from bipot.fem.surface import facet_weights
from bipot.iterate import Iterate
from bipot.scene.scene import Scene
from bipot.tensors import norm
from bipot.tools.deformable import DeformableTool
from bipot.tools.facing import Integrands
from bipot.typing import Floats, Ints, einsum

ROUND_OFF = 64 * float(np.finfo(float).eps)
"""Mean slip over the size of the body below which friction lost is round-off."""


def cancelled(iterate: Iterate, r: Floats) -> float:
    """The part of the increment's work by which friction under contact forces r (c, d) is too small, in [0, 1]."""
    contacts = iterate.increment.system.candidates
    if not (contacts.weighted or contacts.deformable):
        return 0.0
    # Round-off leaves forces below zero where tools rest or lift off.
    limit = np.where(iterate.rows.tied, 0.0, np.maximum(iterate.rows.limit(r), 0.0))
    lost = float(limit @ _parted(iterate))
    if lost <= ROUND_OFF * contacts.scene.mesh.size * float(limit.sum()):
        return 0.0
    return lost / (abs(iterate.work(r)) + lost)


def _parted(iterate: Iterate) -> Floats:
    """Mean length of the slips within each candidate's mean (c,), less the length of their mean."""
    contacts, d = iterate.increment.system.candidates, iterate.increment.system.body.scene.mesh.dimension
    moved = _slips(iterate) if contacts.weighted else np.empty(0)
    found = list[tuple[Floats, Floats]]()
    for k, (tool, points) in enumerate(zip(contacts.scene.tools, contacts.points, strict=True)):
        if isinstance(tool, DeformableTool) and points.faced is not None:
            found.append(_between(iterate, tool, points.faced.normals))
        elif points.weighted:
            found.append(_within(contacts.scene, points, moved[k]))
        else:
            found.append((np.zeros(len(points.node)), np.zeros((len(points.node), d))))
    lengths, slips = (contacts.of_points(*of) for of in zip(*found, strict=True))
    # In a plane a mean that continues beyond an axis or a plane of symmetry does not slip, nor do supports move it.
    still = ~(contacts.tangent_free | contacts.tangent_held)
    return np.maximum(lengths - np.where(still, 0.0, norm(contacts.means.kept(slips))), 0.0)


def _within(scene: Scene, points: Points, moved: Floats) -> tuple[Floats, Floats]:
    """:func:`_means` around ``points`` at a rigid tool, where nodes have ``moved`` (a, d) along it."""
    facets, d = points.facets, moved.shape[1]
    table = facet(facets.shape[1], d)
    psi = table.values @ hats(facets.shape[1], d).T
    weight = einsum("fq,qk->fqk", facet_weights(scene.mesh.nodes, facets, scene.geometry), psi)
    return _means(points.point, weight, (table.values @ moved[facets])[:, :, None], len(points.node))


def _between(iterate: Iterate, tool: DeformableTool, normals: Floats) -> tuple[Floats, Floats]:
    """:func:`_means` around the points of a ``tool``, which have ``normals`` (p, d)."""
    sides, ring = tool.sides, iterate.increment.system.body.scene.ring
    met, du = Integrands.of(iterate.nodes, sides, ring, tool.near), iterate.response.du
    moved = einsum("sgk,skd->sgd", met.mine, du[met.own]) - einsum("sgk,skd->sgd", met.its, du[met.others])
    point, weight = sides.point[met.flat], met.weight[..., None] * met.psi
    n = normals[point][:, None]
    slip = moved[:, :, None] - np.vecdot(moved[:, :, None], n)[..., None] * n
    return _means(point, weight, slip, len(normals))


def _means(point: Ints, weight: Floats, slip: Floats, count: int) -> tuple[Floats, Floats]:
    """Mean lengths (p,) of slips, and means (p, d), around p = ``count`` points, zero where nothing has a weight.

    Each ``point`` (s, k) has the ``weight`` (s, q, k) at places with the ``slip`` (s, q, k, d), or (s, q, 1, d).
    """
    area, length, mean = np.zeros(count), np.zeros(count), np.zeros((count, slip.shape[-1]))
    np.add.at(area, point, weight.sum(axis=1))
    np.add.at(length, point, (weight * norm(slip)).sum(axis=1))
    np.add.at(mean, point, (weight[..., None] * slip).sum(axis=1))
    area = np.where(area > 0, area, np.inf)
    return length / area, mean / area[:, None]


def _slips(iterate: Iterate) -> Floats:
    """Motions (tools, a, d) of nodes along each tool, zero for nodes that are in none of its means.

    In a plane the first component is the slip along the tool's line, whose direction may turn from node to node.
    """
    increment, contacts, du = iterate.increment, iterate.increment.system.candidates, iterate.response.du
    owner, nodes = contacts.means.owner, contacts.means.apart()
    gone, frames = iterate.tool_travel[contacts.tool[owner]], iterate.frames
    if contacts.curved:
        gone = gone + increment.tools.carried(du, iterate.advance)
    else:
        frames = frames[owner]
    slip = nodes.motion(du) - gone
    slip = slip - np.vecdot(slip, frames[:, 0])[:, None] * frames[:, 0]
    if slip.shape[1] == 2:
        slip = np.vecdot(slip, frames[:, 1])[:, None] * (1.0, 0.0)
    out = np.zeros((len(contacts.scene.tools), *du.shape))
    out[contacts.tool[owner], contacts.means.weights.indices] = slip
    return out
