r"""Where contact is posed, written a second time for the fuzz study's recomputation: nothing of the library.

A point is a mean of nodes, by weights (p, a). At the nodes it is the node. Around the end of a quadratic edge it is

    sum_e int_e psi N_k dA / sum_e int_e psi dA,    psi = (1 + s)/2 from 0 at the other end to 1 at this one,

over the one edge, or the two that go on from each other, with the shape functions N_k and the area dA of rest, on a
ring 2 pi r ds, by Gauss' rule of three points: exact on straight edges with the middle node in the middle.
Two edges go on from each other where the one turns by no more than 60 degrees from the other; else each has a point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.data import Floats, Ints
from studies.independent.shapes import line

THREE_POINTS = np.polynomial.legendre.leggauss(3)

TURN = np.deg2rad(60.0)
"""The largest angle by which an edge may turn from its neighbour and share a point with it."""


@dataclass(frozen=True)
class Means:
    """Points by the node where they are (p,), and the weights (p, a) of all nodes."""

    node: Ints
    weights: Floats


def at_nodes(node: Ints, count: int) -> Means:
    """The nodes (p,) themselves, of ``count``."""
    return Means(node, np.eye(count)[node])


def around_ends(rest: Floats, edges: Ints, axisymmetric: bool) -> Means:
    """Means around the ends of ``edges`` (f, 3), as end, middle, end, of nodes at ``rest`` (a, 2).

    By their nodes; where a node has two of them, that of the edge which comes first does.
    """
    leaving = np.concatenate([edges, edges[:, ::-1]])
    order = np.argsort(np.tile(np.arange(len(edges)), 2), kind="stable")
    node, weights = list[int](), list[Floats]()
    for a in np.unique(leaving[:, 0]):
        mine = leaving[order][leaving[order, 0] == a]
        parts = [mine] if len(mine) == 2 and _turns(rest[mine]) <= TURN else [edge[None] for edge in mine]
        for part in parts:
            share = np.zeros(len(rest))
            for edge in part:
                np.add.at(share, edge, _shares(rest[edge], axisymmetric))
            node.append(int(a))
            weights.append(share / share.sum())
    return Means(np.array(node, dtype=np.intp), np.array(weights).reshape(-1, len(rest)))


def _turns(x: Floats) -> float:
    """Angle by which one of two edges x (2, 3, 2), which leave the same node, turns from the other."""
    # Along these the parabolas start; of an edge that goes straight on they are opposite.
    one, other = 4 * x[:, 1] - 3 * x[:, 0] - x[:, 2]
    return float(np.arctan2(abs(one[0] * other[1] - one[1] * other[0]), -(one @ other)))


def _shares(x: Floats, axisymmetric: bool) -> Floats:
    """int psi N_k dA (3,) of an edge x (3, 2) that leaves the node where psi is one."""
    s, weight = THREE_POINTS
    N, slopes = line(s, 3)
    length = np.linalg.norm(slopes.T @ x, axis=1)
    around = 2 * np.pi * (N.T @ x[:, 0]) if axisymmetric else 1.0
    return N @ (weight * length * around * (1 - s) / 2)
