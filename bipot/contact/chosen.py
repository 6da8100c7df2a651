"""Which points of the tools' boundaries are candidates: those where a node or the tool can move along the normal."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bipot.contact.candidates import Candidates
from bipot.contact.means import Means
from bipot.contact.mobility import mirrored, moving
from bipot.contact.sampling import points
from bipot.fem.assembly import Space
from bipot.programs.data import rows_of
from bipot.scene.scene import Scene
from bipot.typing import Floats, Ints


def candidates(scene: Scene, space: Space) -> Candidates:
    """Points of every tool that can move along its normal, or it against them; none where there is no tool."""
    found = tuple(points(scene.mesh, scene.geometry, tool) for tool in scene.tools)
    ways = [moving(scene, k, own) for k, own in enumerate(found)]
    chosen = [moves[:, 0] for moves in ways]
    rests = [mirrored(scene, k, own) for k, own in enumerate(found)]
    none, mu, shear = np.empty(0, dtype=bool), [np.empty(0)], [np.empty(0)]
    for tool, own, moves in zip(scene.tools, found, chosen, strict=True):
        mu.append(_by_node(tool.mu_at, tool.mu, own.node[moves]))
        shear.append(_by_node(tool.shear_at, tool.shear, own.node[moves]))
    counts = np.array([moves.sum() for moves in chosen], np.intp)
    first = np.cumsum(counts) - counts
    weights = [rows_of(own.weights, moves) for own, moves in zip(found, chosen, strict=True)]
    within = [rest.within[own] for rest, own in zip(rests, chosen, strict=True)]
    slides = np.concatenate([none, *(moves[own, 1:].any(axis=1) for moves, own in zip(ways, chosen, strict=True))])
    still = np.concatenate([none, *(rest.still[own] for rest, own in zip(rests, chosen, strict=True))])
    return Candidates(
        scene=scene,
        space=space,
        points=found,
        number=tuple(np.where(m, np.cumsum(m) - 1 + at, -1) for m, at in zip(chosen, first.tolist(), strict=True)),
        means=Means.of(len(scene.mesh.nodes), weights, within),
        node=np.concatenate([np.empty(0, np.intp), *(own.node[m] for own, m in zip(found, chosen, strict=True))]),
        tool=np.repeat(np.arange(len(found)), counts),
        tangent_free=slides & ~still,
        tangent_held=~slides,
        mu=np.concatenate(mu),
        shear=np.concatenate(shear),
    )


def _by_node(given: Mapping[int, float], other: float, node: Ints) -> Floats:
    """The values ``given`` by node (c,), and the ``other`` value elsewhere."""
    return np.array([given.get(a, other) for a in node.tolist()], dtype=np.float64)
