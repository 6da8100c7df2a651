"""Which points of a tool's boundaries can move, along its normal and its tangent, and which symmetry holds at rest."""

from __future__ import annotations

import numpy as np

from bipot.reflection import across
from bipot.sampling import Points, creased
from bipot.scene import Scene
from bipot.supports import Symmetry
from bipot.surfaces import ACROSS, frames
from bipot.tensors import norm
from bipot.typing import Bools, Floats, Ints


def moving(scene: Scene, number: int, own: Points) -> Bools:
    """Whether of the means that points are a node, or the tool of that ``number``, can move as in :func:`movable`."""
    owner = np.repeat(np.arange(len(own.node)), np.diff(own.weights.indptr))
    out = np.zeros((len(own.node), scene.mesh.dimension), dtype=bool)
    np.logical_or.at(out, owner, movable(scene, number, np.asarray(own.weights.indices, np.intp)))
    return out


def mirrored(scene: Scene, number: int, own: Points) -> Bools:
    """Whether slip and shear are zero at points (p,), of whose mean a half is beyond a plane of symmetry, or an axis.

    There the body slips the other way. A point whose mean stops at the plane has a mirror image of its own.
    """
    left, d = _at_rest(scene, number, own.node)[:, 1:], scene.mesh.dimension
    if scene.ring:
        left[scene.on_axis[own.node], :, 0] = 0.0
    for support in scene.supports:
        if isinstance(support, Symmetry):
            there = np.isin(own.node, scene.mesh.boundary_nodes(support.boundary))
            there &= ~creased(scene.mesh, own, support.along(d))
            left[there] = across(left[there], support.along(d))
    return np.asarray((np.abs(left) <= ACROSS).all(axis=(1, 2)))


def movable(scene: Scene, number: int, nodes: Ints) -> Bools:
    """Whether nodes (a,) or the tool of that ``number`` can move along its normal and its tangents (a, d).

    A normal that turns is any direction, and so is a tangent but where neither the tool nor a support ever goes along
    what is held.
    """
    tool, holding = scene.tools[number], scene.holding
    led, along = directions(scene)[number], _at_rest(scene, number, nodes).swapaxes(0, 1)
    moves = np.stack([holding.free_along(nodes, axis) | (np.abs(axis @ led) > ACROSS) for axis in along], axis=1)
    if not tool.flat:
        goes = holding.axes.at(nodes, np.tile(tool.travel, (len(nodes), 1))) != 0
        free = ~holding.held[nodes]
        turns = ~free & (holding.shifted[nodes] | goes | (tool.turn is not None))
        first = np.arange(scene.mesh.dimension) == 0
        moves = free.any(axis=1, keepdims=True) & (moves | turns.any(axis=1, keepdims=True) | first)
    return moves


def _at_rest(scene: Scene, number: int, nodes: Ints) -> Floats:
    """Normal and tangents (a, d, d) at rest of nodes (a,) at the tool of that ``number``.

    In a plane of symmetry that cuts the tool, its normal is: to the last bit, as the tool may be off by round-off.
    """
    tool, x = scene.tools[number], scene.mesh.nodes[nodes]
    normal = np.array(tool.face.distance(x).normal)
    for plane in scene.planes:
        if not tool.flat and plane.cuts(tool):
            cut = plane.holds(x)
            normal[cut] = across(normal[cut], plane.normal)
    return frames(normal / norm(normal)[:, None])


def directions(scene: Scene) -> Floats:
    """Directions (k, d) along which forces drive the tools; zero where none does."""
    return scene.led(np.ones(len(scene.pushed)))
