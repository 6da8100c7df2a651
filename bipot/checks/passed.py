"""Refusal of increments in which the sides of a deformable tool go through each other, or end deep in each other.

The law is posed in means (:mod:`bipot.tools.facing`), beside which single places may overlap.
"""

from __future__ import annotations

import numpy as np

from bipot.errors import Refused
from bipot.iterate import Iterate
from bipot.meshes.mesh import Mesh
from bipot.tools.deformable import DeformableTool
from bipot.tools.facing import crossed, deep
from bipot.tools.passing import faces_crossed
from bipot.tools.plane import area_of
from bipot.typing import Floats

FINER = "Refine the mesh there, or make the finer side the candidates."


def refuse_passed(iterate: Iterate) -> None:
    """Refuse what passes through a side of a deformable tool, and sides that are deep in each other at the end."""
    scene = iterate.increment.system.body.scene
    before, after, volumes = iterate.increment.start.nodes, iterate.nodes, _volumes(iterate)
    for k, tool in enumerate(scene.tools):
        if not isinstance(tool, DeformableTool):
            continue
        for mine, its in ((tool.candidates, tool.surface), (tool.surface, tool.candidates)):
            behind = volumes[scene.mesh.owners(*its)]
            through = _passed(scene.mesh, before, after, (mine, its), behind)
            if through is not None:
                advice = "Use more increments: they are too long for what they press."
                raise Refused(f"{through} at tools[{k}]", advice, too_far=True)
            depth = deep(after, scene.mesh.around(*mine), scene.mesh.around(*its), scene.ring)
            if depth > 0:
                raise Refused(f"the sides of tools[{k}] overlap by {depth:.2g}, much beside their edges", FINER)


def _passed(
    mesh: Mesh, before: Floats, after: Floats, sides: tuple[tuple[str, ...], tuple[str, ...]], behind: Floats
) -> str | None:
    """What goes through a facet of the other of two ``sides``, with volumes ``behind`` (f,), in words; None if nothing.

    Nodes go straight from ``before`` to ``after`` (a, d).
    """
    mine, its = sides
    facets = mesh.around(*its)
    node = crossed(before, after, mesh.boundary_nodes(*mine), facets, behind)
    if node is not None:
        return f"node {node[0]} goes through the {'edge' if mesh.dimension == 2 else 'face'} of nodes {node[1]}"
    face = faces_crossed(before, after, mesh.around(*mine), facets, behind) if mesh.dimension == 3 else None
    return None if face is None else f"the face of nodes {face[0]} goes through that of nodes {face[1]}"


def _volumes(iterate: Iterate) -> Floats:
    """Volumes (e,) of elements, in a plane the areas between their corners."""
    mesh = iterate.increment.system.body.scene.mesh
    if mesh.dimension == 3:
        return np.asarray(iterate.response.kinematics.volume.sum(axis=1))
    return area_of(iterate.nodes[mesh.elements[:, : mesh.element.corners]])
