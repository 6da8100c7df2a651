"""Nodes at sharp corners of tools, where the law has no one normal: the body may have no equilibrium there."""

from __future__ import annotations

import numpy as np

from bipot.contact.closeness import carries
from bipot.iterate import Increment
from bipot.tensors import norm
from bipot.typing import Bools, Floats

SHARP = 0.5
"""Angle (radians) of normals around a node within the increment's lengths, above which it is at a corner."""


def cornered(increment: Increment) -> str | None:
    """The sentence on a node that pushes against a tool next to a sharp corner of it, None where there is none.

    Next to it is who comes there by the lengths of the increment, which has failed. In a plane of symmetry, or on an
    axis, a corner and its mirror image push along that together.
    """
    start, contacts = increment.start, increment.system.candidates
    if not contacts.curved:
        return None
    drift = increment.quicker * float(norm(start.velocity).max()) * (increment.tau - start.tau)
    turned = _turned(increment, increment.reach + drift) * (carries(start.forces) & _alone(increment))
    worst = int(np.argmax(turned))
    if turned[worst] < SHARP:
        return None
    return (
        f"Node {contacts.node[worst]} is at a sharp corner of tools[{contacts.tool[worst]}], which pushes along one "
        "normal alone there: give the corner a fillet, or make its sides tools of their own."
    )


def _alone(increment: Increment) -> Bools:
    """Which candidates (c,) are not in a plane that mirrors the body."""
    scene, node = increment.system.body.scene, increment.system.candidates.node
    return ~np.any([np.zeros(len(node), dtype=bool), *(p.holds(scene.mesh.nodes[node]) for p in scene.mirrors)], axis=0)


def _turned(increment: Increment, length: float) -> Floats:
    """The largest angle (c,) between a candidate's normal and those of places so far off along the axes; 0 if flat."""
    contacts, scene = increment.system.candidates, increment.system.body.scene
    places, out = contacts.means.places(increment.start.nodes), np.zeros(len(contacts.tool))
    around = length * np.vstack([np.eye(scene.mesh.dimension), -np.eye(scene.mesh.dimension)])
    for k, (tool, pose) in enumerate(zip(scene.tools, increment.tools.placed, strict=True)):
        own = contacts.tool == k
        if tool.flat or not own.any():
            continue
        x = tool.own(places[own], pose)
        cosines = np.vecdot(tool.face.distance(x[:, None] + around).normal, tool.face.distance(x).normal[:, None])
        out[own] = np.arccos(np.clip(cosines.min(axis=1), -1.0, 1.0))
    return out
