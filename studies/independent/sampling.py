r"""Where contact is posed, written a second time for the fuzz study's recomputation: nothing of the library.

A point is a mean of nodes, by weights (p, a). At the nodes it is the node. Around the end of a quadratic edge it is

    sum_e int_e psi N_k dA / sum_e int_e psi dA,    psi = (1 + s)/2 from 0 at the other end to 1 at this one,

over the one edge, or the two that go on from each other, with the shape functions N_k and the area dA of rest, on a
ring 2 pi r ds, by Gauss' rule of three points: exact on straight edges with the middle node in the middle.
Two edges go on from each other where the one turns by no more than 60 degrees from the other; else each has a point.

At a tool the point's gap is the mean of its nodes' gaps, and its slip that of theirs; of a force on it each node takes
its share, in the node's own frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.element import Bools, Floats, Ints
from studies.independent.shapes import line

THREE_POINTS = np.polynomial.legendre.leggauss(3)

TURN = np.deg2rad(60.0)
"""The largest angle by which an edge may turn from its neighbour and share a point with it."""

NONE = 1e-12
"""A weight that is round-off: of a straight edge the far end is no part of the mean."""


@dataclass(frozen=True)
class Means:
    """Points by the node where they are (p,), and the weights (p, a) of all nodes.

    ``ends`` (f, m) are those of each edge, or face: at its nodes, or around its ends, or corners.
    """

    node: Ints
    weights: Floats
    ends: Ints


@dataclass(frozen=True)
class Parts:
    """The nodes of ``count`` c means one by one: ``node``, the mean that is its ``owner``, and its ``share`` (w,).

    They are in the order of their owners.
    """

    count: int
    owner: Ints
    node: Ints
    share: Floats

    @staticmethod
    def of(weights: Floats) -> Parts:
        """Those of means of ``weights`` (c, a)."""
        owner, node = np.nonzero(weights)
        return Parts(len(weights), owner, node, weights[owner, node])

    def sums(self, values: Floats) -> Floats:
        """Sums (c, ...) of values (w, ...)."""
        out = np.zeros((self.count, *values.shape[1:]))
        np.add.at(out, self.owner, values)
        return out

    def mean(self, values: Floats) -> Floats:
        """Means (c,) of values (w,)."""
        return self.sums(self.share * values)

    def most(self, sizes: Floats) -> Floats:
        """What means (c,) of values of these ``sizes`` (w,) are summed of."""
        return self.sums(np.abs(self.share) * sizes)

    def any(self, of: Bools) -> Bools:
        """Means (c,) of which any node (w,) is one ``of`` these."""
        return self.sums(of.astype(float)) > 0


def at_nodes(edges: Ints, count: int) -> Means:
    """The nodes of ``edges`` (f, m) themselves, of ``count`` of the mesh."""
    node, ends = np.unique(edges, return_inverse=True)
    return Means(node, np.eye(count)[node], ends.reshape(edges.shape))


def around_ends(rest: Floats, edges: Ints, axisymmetric: bool) -> Means:
    """Means around the ends of ``edges`` (f, 3), as end, middle, end, of nodes at ``rest`` (a, 2).

    By their nodes; where a node has two of them, that of the edge which comes first does.
    """
    count = len(edges)
    leaving = np.concatenate([edges, edges[:, ::-1]])
    order = np.argsort(np.tile(np.arange(count), 2), kind="stable")
    node, weights, point = list[int](), list[Floats](), np.empty(2 * count, dtype=np.intp)
    for a in np.unique(leaving[:, 0]):
        mine = order[leaving[order, 0] == a]
        together = len(mine) == 2 and _turns(rest[leaving[mine]]) <= TURN
        for part in [mine] if together else mine[:, None]:
            share = np.zeros(len(rest))
            for edge in leaving[part]:
                np.add.at(share, edge, _shares(rest[edge], axisymmetric))
            share /= share.sum()
            point[part] = len(node)
            node.append(int(a))
            weights.append(np.where(np.abs(share) > NONE, share, 0.0))
    shape = -1, len(rest)
    return Means(np.array(node, dtype=np.intp), np.array(weights).reshape(shape), point.reshape(2, count).T)


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
