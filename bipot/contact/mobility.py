r"""Which points of a tool's boundaries can move along its normal and tangent, and where symmetry forbids slip.

In space the two tangents may be rotated about the normal. Where supports or planes of symmetry hold a single direction
z of a point's motion in the tangent plane, friction along z acts on no unknown, and its distribution between tool and
support is not determined. With one tangent along z and the other across it, the first has no row, whatever the axes of
the supports are, and carries nothing.

This applies to flat tools. Slips on curved tools follow the motion of points relative to them and are zero along z only
to round-off.

With P_a the projections on the free motions of the nodes, and S the projection of their mean by planes of symmetry, z
is the direction of the tangent plane in which S (sum_a P_a) S is zero (:func:`along_what_is_held`).
"""

from __future__ import annotations

import numpy as np

from bipot.contact.means import Means
from bipot.contact.sampling import Points, beyond
from bipot.scene.holding import Holding
from bipot.scene.scene import Scene
from bipot.scene.supports import Symmetry
from bipot.tensors import norm
from bipot.tools.deformable import DeformableTool
from bipot.tools.poses import pose_size
from bipot.tools.surfaces import ACROSS, across, frames
from bipot.typing import Bools, Floats, Ints, Vector, einsum

RADIAL: Vector = (1.0, 0.0)

ANGLES = (0.0, 0.4, 1.1, 2.3, 3.8, 5.3)
"""Angles of turn (radians): only a surface of revolution about the turn's axis is mapped to itself by all of them."""

HELD = 1e-12
"""Eigenvalues below this part of the largest entry are zero; tangents that are turned needlessly do no harm."""


def moving(scene: Scene, number: int, own: Points) -> Bools:
    """Whether a node of each point (p, d), or the tool of that ``number``, can move, as in :func:`movable`."""
    means = Means(own.weights)
    out = np.zeros((len(own.node), scene.mesh.dimension), dtype=bool)
    np.logical_or.at(out, means.owner, movable(scene, number, means.nodes))
    return out


def mirrored(scene: Scene, number: int, own: Points) -> tuple[Bools, Floats]:
    """Where symmetry forbids points (p,) of the tool of that ``number`` to slip, and how their means may still move.

    The latter is a projection (p, d, d), the identity for nodes, which supports hold, and in a plane, where slip is
    either free or zero.

    Symmetry does so where half of a mean is beyond a plane of symmetry or an axis, where the body slips in the opposite
    direction. A point whose mean stops at the plane has a mirror image instead, and so has every mean at a tool that is
    not its own mirror image.
    """
    at_rest = _at_rest(scene, number, own.node) if own.faced is None else frames(own.faced.normals)
    left, d = at_rest[:, 1:].copy(), scene.mesh.dimension
    within = np.tile(np.eye(d), (len(own.node), 1, 1))
    if scene.ring and _stays(scene, number, own, RADIAL):
        left[scene.on_axis[own.node], :, 0] = 0.0
    for support in scene.supports:
        if isinstance(support, Symmetry) and _stays(scene, number, own, support.along(d)):
            there = np.isin(own.node, scene.mesh.boundary_nodes(support.boundary))
            there &= _goes_on(scene, own, there, support.along(d))
            left[there] = across(left[there], support.along(d))
            if own.in_means and d == 3:
                within[there] = across(within[there], support.along(d))
    return np.asarray((np.abs(left) <= ACROSS).all(axis=(1, 2))), within


def shares(scene: Scene, number: int, own: Points) -> Floats:
    """The part (p,) that each point is of a point of the whole body, at the tool of that ``number``.

    It is halved by each plane of symmetry through the point that cuts the tool, unless its mean stops there and its
    mirror image is another point. In a plane that does not cut the tool, the mirror image of the tool touches the point
    from beyond, and the tool itself acts on the modelled part alone.
    """
    out, x = np.ones(len(own.node)), scene.mesh.nodes[own.node]
    for plane in scene.planes:
        if plane.cuts(scene.tools[number]):
            there = plane.holds(x)
            out[there & _goes_on(scene, own, there, plane.normal)] /= 2
    return out


def _goes_on(scene: Scene, own: Points, there: Bools, normal: Vector) -> Bools:
    """Whether the mean of points (p,), of which those ``there`` are on a plane of symmetry, continues beyond it.

    It does where one of its facets does. A node by itself is its own mirror image.
    """
    if not own.weighted:
        return there
    inside, out = np.zeros(len(scene.mesh.nodes), dtype=bool), np.zeros_like(there)
    inside[own.node[there]] = True
    np.logical_or.at(out, own.point, beyond(scene.mesh.nodes, own.facets, inside, normal))
    return out


def _stays(scene: Scene, number: int, own: Points, normal: Vector) -> bool:
    """Whether points at the tool of that ``number``, in the plane of that normal or on the axis, move along it only.

    Nodes do at a flat tool; a mean does if the tool is its own mirror image, because another tool meets only one half.
    """
    tool = scene.tools[number]
    return (tool.flat and not own.weighted) or any(
        plane.cuts(tool) for plane in scene.mirrors if not plane.contains(normal)
    )


def movable(scene: Scene, number: int, nodes: Ints) -> Bools:
    """Whether nodes (a,) or the tool of that ``number`` can move along its normal and its tangents (a, d).

    At a curved tool the normal may turn to any direction, and so may a tangent, unless neither the tool nor a support
    ever moves along what is held. A driven curved tool moves along normal and tangent against fully held nodes if its
    drive ever changes its gap to them: at rest it may be apart from them, or move along their tangent.
    """
    tool, holding = scene.tools[number], scene.holding
    if isinstance(tool, DeformableTool):
        return np.ones((len(nodes), scene.mesh.dimension), dtype=bool)
    along, arm = _at_rest(scene, number, nodes), tool.arm(scene.mesh.nodes[nodes], scene.at_rest[number])
    led = scene.drives.along(number, arm)
    driven = (np.abs(einsum("aij,maj->mai", along, led)) > ACROSS).any(axis=0)
    moves = np.stack([holding.free_along(nodes, axis) for axis in along.swapaxes(0, 1)], axis=1) | driven
    if not tool.flat:
        ways = *(np.tile(way, (len(nodes), 1)) for way in tool.stretches), *led
        goes = np.any([holding.axes.at(nodes, way) != 0 for way in ways], axis=0)
        free = ~holding.held[nodes]
        turns = ~free & (holding.shifted[nodes] | goes | (tool.turn is not None))
        first = np.arange(scene.mesh.dimension) == 0
        driven |= _comes(scene, number, nodes)[:, None]
        moves = free.any(axis=1, keepdims=True) & (moves | turns.any(axis=1, keepdims=True) | first) | driven
    return moves


def _comes(scene: Scene, number: int, nodes: Ints) -> Bools:
    """Whether the drive of the curved tool of that ``number`` ever changes its gap to nodes (a,).

    A force does; so does a moment unless the surface is centred on the turn.
    """
    tool, x = scene.tools[number], scene.mesh.nodes[nodes]
    if tool.driven_by is not None or tool.turn is None or tool.turned_by is None:
        return np.full(len(nodes), tool.driven_by is not None)
    poses = np.zeros((len(ANGLES), pose_size(x.shape[1])))
    poses[:, x.shape[1] :] = np.outer(ANGLES, tool.turn.about)
    gaps = np.array([tool.distance(x, pose) for pose in poses])
    return np.ptp(gaps, axis=0) > ACROSS * np.max([tool.places(x, pose) for pose in poses], axis=0)


def _at_rest(scene: Scene, number: int, nodes: Ints) -> Floats:
    """Normal and tangents (a, d, d) at rest of nodes (a,) at the tool of that ``number``.

    In a plane of symmetry that cuts a curved tool the normal is made to lie in the plane exactly: the tool's place is
    only good to round-off.
    """
    tool, x = scene.tools[number], scene.mesh.nodes[nodes]
    normal = np.array(tool.face.distance(x).normal)
    for plane in scene.planes:
        if not tool.flat and plane.cuts(tool):
            cut = plane.holds(x)
            normal[cut] = across(normal[cut], plane.normal)
    return frames(normal / norm(normal)[:, None])


def along_what_is_held(frames: Floats, means: Means, holding: Holding) -> Floats:
    """The ``frames`` (c, 3, 3), turned so that a tangent is along a single direction that is held, if there is one."""
    tangents = frames[:, 1:]
    left = einsum("cij,cjk,clk->cil", tangents, _left(means, holding), tangents)
    size, ways = np.linalg.eigh(left)
    least = HELD * np.abs(left).max(axis=(1, 2))
    turns = (size[:, 0] <= least) & (size[:, 1] > least) & (np.abs(left[:, 0, 1]) > least)
    out, held = frames.copy(), ways[turns, :, 0]
    # The nearest of the four: frames of scenes next to each other stay so.
    held = np.where(np.abs(held[:, :1]) < np.abs(held[:, 1:]), held[:, ::-1] * (1.0, -1.0), held)
    held = held * np.where(held[:, :1] < 0, -1.0, 1.0)
    out[turns, 1] = einsum("ci,cij->cj", held, tangents[turns])
    out[turns, 2] = np.cross(frames[turns, 0], out[turns, 1])
    return out


def _left(means: Means, holding: Holding) -> Floats:
    """S (sum_a P_a) S (c, 3, 3) of the candidates (module docstring)."""
    axes = holding.axes.frames(len(holding.held), 3)
    nodal = einsum("aij,ai,aik->ajk", axes, ~holding.held, axes)
    pattern = means.weights.copy()
    pattern.data[:] = 1.0
    summed = np.asarray(pattern @ nodal.reshape(-1, 9)).reshape(-1, 3, 3)
    S = means.within
    return summed if S is None else S @ summed @ S
