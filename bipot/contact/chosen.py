"""The choice of candidates: points of the tools' boundaries where a node or the tool can move along the normal."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp

from bipot.contact import faced
from bipot.contact.candidates import Candidates
from bipot.contact.means import Means
from bipot.contact.mobility import mirrored, moving
from bipot.contact.sampling import points
from bipot.fem.assembly import Space
from bipot.programs.data import rows_of
from bipot.scene.scene import Scene
from bipot.tools.deformable import DeformableTool
from bipot.typing import Floats, Ints, read_only


def candidates(scene: Scene, space: Space, nodes: Floats | None = None) -> Candidates:
    """Points of every tool that can move along its normal, or against which it can; none where there is no tool.

    What points at deformable tools face is that of the configuration ``nodes`` (a, d), by default at rest.
    """
    x = scene.mesh.nodes if nodes is None else nodes
    found = tuple(
        faced.points(scene, tool, x) if isinstance(tool, DeformableTool) else points(scene.mesh, scene.geometry, tool)
        for tool in scene.tools
    )
    number, weights, within, first = list[Ints](), list[sp.csr_matrix](), list[Floats](), 0
    node, owner, mu, shear = [np.empty(0, np.intp)], [np.empty(0, np.intp)], [np.empty(0)], [np.empty(0)]
    slides, still = [np.empty(0, dtype=bool)], [np.empty(0, dtype=bool)]
    for k, (tool, at) in enumerate(zip(scene.tools, found, strict=True)):
        moves, (stays, projection) = moving(scene, k, at), mirrored(scene, k, at)
        chosen = moves[:, 0]
        number.append(np.where(chosen, np.cumsum(chosen) - 1 + first, -1))
        first += int(chosen.sum())
        weights.append(rows_of(at.weights, chosen))
        within.append(projection[chosen])
        node.append(at.node[chosen])
        owner.append(np.full(len(node[-1]), k))
        mu.append(_by_node(tool.mu_at, tool.mu, node[-1]))
        shear.append(_by_node(tool.shear_at, tool.shear, node[-1]))
        slides.append(np.asarray(moves[chosen, 1:].any(axis=1)))
        still.append(stays[chosen])
    return Candidates(
        scene=scene,
        space=space,
        points=found,
        number=tuple(number),
        means=Means.of(len(scene.mesh.nodes), weights, within),
        node=read_only(np.concatenate(node), np.intp),
        tool=read_only(np.concatenate(owner), np.intp),
        tangent_free=read_only(np.concatenate(slides) & ~np.concatenate(still), np.bool_),
        tangent_held=read_only(~np.concatenate(slides), np.bool_),
        mu=read_only(np.concatenate(mu), np.float64),
        shear=read_only(np.concatenate(shear), np.float64),
    )


def _by_node(given: Mapping[int, float], other: float, node: Ints) -> Floats:
    """The values ``given`` by node (c,), and the ``other`` value elsewhere."""
    return np.array([given.get(a, other) for a in node.tolist()], dtype=np.float64)
