"""Refusal of increments in which the sides of a deformable tool go through each other, or end deep in each other.

The law is posed in means (:mod:`bipot.tools.facing`), beside which single places may overlap.
"""

from __future__ import annotations

import numpy as np

from bipot.errors import Refused
from bipot.iterate import Iterate
from bipot.tools.deformable import DeformableTool
from bipot.tools.passing import crossed, deep, faces_crossed
from bipot.tools.plane import area_of
from bipot.typing import Floats, Ints

FINER = "Refine the mesh there, or make the finer side the candidates."


def refuse_passed(iterate: Iterate) -> None:
    """Refuse what passes through a side of a deformable tool, and sides that are deep in each other at the end."""
    scene = iterate.increment.system.body.scene
    before, after, volumes = iterate.increment.start.nodes, iterate.nodes, _volumes(iterate)
    for k, tool in enumerate(scene.tools):
        if not isinstance(tool, DeformableTool):
            continue
        one, other = tool.sides.one, tool.sides.other
        for mine, its, names in ((one, other, tool.surface), (other, one, tool.candidates)):
            through = _passed(before, after, mine, its, volumes[scene.mesh.owners(*names)])
            if through is not None:
                advice = "Use more increments: they are too long for what they press."
                raise Refused(f"{through} at tools[{k}]", advice, too_far=True)
            depth = deep(after, mine, its, scene.ring)
            if depth > 0:
                raise Refused(f"the sides of tools[{k}] overlap by {depth:.2g}, much beside their edges", FINER)


def _passed(before: Floats, after: Floats, mine: Ints, its: Ints, behind: Floats) -> str | None:
    """What of the facets ``mine`` (f, n) goes through ``its`` (g, n), in words; None if nothing.

    Nodes go straight from ``before`` to ``after`` (a, d). Elements at the latter have the volumes ``behind`` (g,).
    """
    space = before.shape[1] == 3
    node = crossed(before, after, np.unique(mine), its, behind)
    if node is not None:
        return f"node {node[0]} goes through the {'face' if space else 'edge'} of nodes {node[1]}"
    face = faces_crossed(before, after, mine, its, behind) if space else None
    return None if face is None else f"the face of nodes {face[0]} goes through that of nodes {face[1]}"


def _volumes(iterate: Iterate) -> Floats:
    """Volumes (e,) of elements, in a plane the areas between their corners."""
    mesh = iterate.increment.system.body.scene.mesh
    if mesh.dimension == 3:
        return np.asarray(iterate.response.kinematics.volume.sum(axis=1))
    return area_of(iterate.nodes[mesh.elements[:, : mesh.element.corners]])
