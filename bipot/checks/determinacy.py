r"""What an accepted increment does not determine: forces of contacts that share nodes, rigid motions that remain.

Contact *forces* are not determined where the closed contacts of a node have more unknowns (one where it slides, d
where it does not) than independent directions on the node's free unknowns. The *position* is not determined where a
rigid motion that the supports allow leaves every closed contact closed, every sticking one at rest, and the slip of
every sliding one in its direction (in space friction would otherwise turn with the slip). Both are rank tests. Tools
that forces drive couple the contacts of all nodes, and so do means: the first test is then made for all contacts
together.

Among all positions that obey the law equally well, :mod:`bipot.checks.settling` takes that of least motion.

A third test, :func:`branches`, costs a factorisation and is optional. Where the symmetric part of the tangent, geometry
included, is positive definite on the motions that the closed contacts allow, no other solution is near (Hill's
condition). Where it is not, other solutions may branch off, as for perfect plasticity in free compression.

Contacts that touch without a force prevent a rigid motion in one direction only: :func:`may_leave` decides by a linear
program whether the body could equally be farther from them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import null_space

from bipot.basics.definite import definite
from bipot.contact.closeness import carries, touches
from bipot.iterate import Iterate
from bipot.programs.condensation import touched
from bipot.programs.data import ContactRows
from bipot.tensors import norm, unit
from bipot.typing import Bools, Floats, Ints, einsum, max_abs

STICKS = 1e-8
"""A contact sticks if it is this far inside its cone, over the largest force."""

STILL = 1e-9
"""Slip below this fraction of the largest counts as none."""

RANK = 1e-9
"""Singular values below this fraction of the largest count as zero."""

FEW, CLEARLY = 30, 1e-10
"""More rows than these few are first tested, without singular values, for whether their squares are this part of the
largest, far above that of :data:`RANK`."""

ROUND_OFF = 1e-9
"""The effect of a motion on a row below this fraction of the largest entry of the motions counts as none."""

STIFF = 1e4
"""Stiffness that prevents a motion, over the largest on the diagonal."""

PIVOTS = 1000
"""Steps of a linear program per row and column; a program that takes more is cycling."""


@dataclass(frozen=True)
class Active:
    """Which contacts (c,) are closed, which stick inside their cone, and which do not slip, even at its edge.

    Of those that slide, ``drag`` (c,) is the growth of friction with the normal force and ``along`` (c, d - 1) the unit
    vector of friction, zero for others.
    """

    closed: Bools
    sticking: Bools
    still: Bools
    drag: Floats
    along: Floats

    @staticmethod
    def of(iterate: Iterate, r: Floats, noise: float = 0.0) -> Active:
        """Which are active by force, gap and slip; forces r (c, d) up to ``noise`` count as none."""
        rows, motion, size = iterate.rows, iterate.motion, iterate.increment.system.body.scene.size
        largest = max_abs(r)
        closed = rows.tied | carries(r, noise) | touches(motion[:, 0], size)
        sticking = closed & rows.rubs & (norm(r[:, 1:]) < rows.limit(r) - max(STICKS * largest, noise))
        slip = norm(motion[:, 1:])
        still = closed & rows.rubs & (sticking | (slip <= STILL * slip.max(initial=0.0)))
        slides = closed & rows.rubs & ~sticking & carries(r, noise)
        along = np.where(slides[:, None], unit(r[:, 1:]), 0.0)
        return Active(closed, sticking, still, rows.limit_slope(r), along)

    def only(self, chosen: Bools) -> Active:
        """The same for the ``chosen`` contacts (c,) only, as if all others were open."""
        along = np.where(chosen[:, None], self.along, 0.0)
        closed, sticking, still = (which & chosen for which in (self.closed, self.sticking, self.still))
        return Active(closed, sticking, still, self.drag, along)

    def stopped(self, rows: ContactRows, motions: Floats) -> Floats:
        """Effect of ``motions`` (n, m) on closed gaps, slips of sticking contacts and directions of sliding ones."""
        kept, count = rows.frictional, motions.shape[1]
        slips = np.asarray(rows.G_t @ motions).reshape(len(kept), rows.tangents, count)
        along, slides = self.along[kept], self.along[kept].any(axis=1)
        across = slips - along[:, :, None] * einsum("fi,fim->fm", along, slips)[:, None]
        tangential = slips[self.sticking[kept]].reshape(-1, count), across[slides].reshape(-1, count)
        return cleaned(np.vstack([(rows.G_n @ motions)[self.closed], *tangential]), motions)


def shared_forces(iterate: Iterate, r: Floats) -> tuple[int, ...]:
    """Nodes whose contact forces are not determined (module docstring)."""
    system, rows = iterate.increment.system, iterate.rows
    if not system.shares:
        return ()
    active = Active.of(iterate, r)
    node, (count, d) = system.candidates.node, system.body.scene.mesh.nodes.shape
    if iterate.translated.size or system.candidates.weighted or system.candidates.deformable:
        # Tools that forces drive couple the contacts of all nodes, and so do nodes that several means share.
        return tuple(np.unique(node[_undetermined(iterate, active, active.closed)]).tolist())
    contacts = np.bincount(node[active.closed], minlength=count)
    # There is no force along a tangent along which nothing can move.
    along = np.zeros(rows.count)
    along[rows.frictional] = (np.diff(rows.G_t.indptr).reshape(-1, rows.tangents) > 0).sum(axis=1)
    unknowns = contacts + np.bincount(node[active.still], along[active.still], minlength=count)
    free = (system.body.space.position.reshape(count, d) >= 0).sum(axis=1)
    # A single contact on a node that is free to move has independent directions, whatever else moves.
    suspect = (contacts > 1) | (unknowns > free)
    return tuple(int(a) for a in np.flatnonzero(suspect) if _undetermined(iterate, active, node == a).size)


def loose_motions(iterate: Iterate, r: Floats, noise: float) -> Floats:
    """Motions N (n, m) without strain, orthonormal, that neither supports nor closed contacts prevent.

    Contacts that carry no more than ``noise`` hold nothing tangentially.
    """
    return _unstopped(iterate, lambda: Active.of(iterate, r, noise))


def pressed_motions(iterate: Iterate, r: Floats, noise: float) -> Floats:
    """Motions N (n, m) without strain that only supports and contacts that carry more than ``noise`` do not prevent."""
    return _unstopped(iterate, lambda: Active.of(iterate, r).only(iterate.rows.tied | carries(r, noise)))


def may_leave(iterate: Iterate, r: Floats, noise: float) -> bool:
    """Whether a rigid motion opens closed contacts that carry no more than ``noise``.

    It must keep contacts that carry more closed, and at rest where they stick.
    """
    rows, N = iterate.rows, pressed_motions(iterate, r, noise)
    idle = Active.of(iterate, r).closed & ~(rows.tied | carries(r, noise))
    if not (N.size and idle.any()):
        return False
    opened = openable(cleaned((rows.G_n @ N)[idle], N))
    # If the linear program does not decide, the motion counts as possible.
    return opened is None or bool(opened[0].any())


def openable(normal: Floats) -> tuple[Bools, Floats] | None:
    """Which contacts (c,) a motion v (m,) with ``normal`` (c, m) v >= 0 opens, and v, which opens as many as possible.

    It maximises sum_c t_c over 0 <= t_c <= 1, t_c <= normal_c v / |normal_c|: scaled up, v opens every contact that any
    such motion opens. None if the solver does not decide.
    """
    count, free = normal.shape
    if not free:
        return np.zeros(count, dtype=bool), np.zeros(0)
    # scipy.optimize takes long to import, and most runs never come here.
    from scipy.optimize import linprog

    found = linprog(
        np.concatenate([np.zeros(free), -np.ones(count)]),
        A_ub=np.hstack([-unit(normal), np.eye(count)]),
        b_ub=np.zeros(count),
        bounds=[(None, None)] * free + [(0, 1)] * count,
        options={"maxiter": PIVOTS * (count + free)},
    )
    return None if found.x is None else (found.x[free:] > 0.5, found.x[:free])


def branches(iterate: Iterate, r: Floats) -> bool:
    """Whether other solutions may branch off: the tangent's symmetric part has a negative pivot (module docstring)."""
    rows, active = iterate.rows, Active.of(iterate, r)
    stopped = sp.vstack([rows.take(active.closed).G_n, rows.take(active.sticking).G_t])
    K = iterate.increment.system.body.space.matrix(iterate.tangent(r))
    stiff = STIFF * max_abs(K.diagonal())
    return not definite(sp.csc_matrix(K + stiff * (stopped.T @ stopped)))


def _unstopped(iterate: Iterate, active: Callable[[], Active]) -> Floats:
    """Motions (n, m) without strain, orthonormal, where unknowns are counted from, that ``active`` contacts allow."""
    system = iterate.increment.system
    rigid = system.strainless_at(system.body.scene.origin(iterate.increment.start.nodes))
    return rigid @ null_space(active().stopped(iterate.rows, rigid), rcond=RANK) if rigid.size else rigid


def _undetermined(iterate: Iterate, active: Active, here: Bools) -> Ints:
    """Closed contacts ``here`` whose forces are not determined.

    A change of these forces pushes nothing, or others forbid the same motion already, as where two normals are one.
    """
    chosen = np.flatnonzero(active.closed & here)
    rows, slip = iterate.rows.take(active.closed & here), iterate.motion[chosen, 1:]
    rows = rows.columns(touched(rows, rows.size))
    normal, tangents = rows.G_n.toarray(), np.zeros((len(chosen), rows.tangents, rows.size))
    tangents[rows.frictional] = rows.G_t.toarray().reshape(len(rows.frictional), *tangents.shape[1:])
    still = active.still[chosen]
    drag = np.where(still, 0.0, active.drag[chosen])[:, None] * unit(slip)
    pushes = normal - einsum("ct,ctn->cn", drag, tangents)
    holds = still[:, None] & tangents.any(axis=2)
    of = np.concatenate([chosen, chosen[np.nonzero(holds)[0]]])
    found = [_dependent(np.vstack([along, tangents[holds]]), of) for along in (pushes, normal)]
    return np.unique(np.concatenate(found))


def _dependent(A: Floats, of: Ints) -> Ints:
    """Contacts whose rows depend linearly on others, of rows (m, n) that belong to the contacts ``of`` (m,)."""
    moved = A[:, np.abs(A).any(axis=0)]
    if len(A) > FEW and _independent(moved):
        return of[:0]
    left = null_space(moved.T, rcond=RANK) if moved.size else np.eye(len(A))
    return of[np.abs(left).max(axis=1, initial=0.0) > RANK]


def _independent(A: Floats) -> bool:
    """Whether all rows (m, n) are clearly independent: A Aᵀ, less a part of its largest entry, is positive definite."""
    rows = sp.csr_array(A)
    product = rows @ rows.T
    return definite(sp.csc_matrix(product - CLEARLY * max_abs(product.data) * sp.eye_array(len(A))))


def cleaned(moved: Floats, motions: Floats) -> Floats:
    """The effect ``moved`` of ``motions`` (n, m) on rows, with zero for round-off of the largest entry of the motions.

    >>> cleaned(np.array([[1e-17, 0.3]]), np.array([[0.6, 0.8]])).tolist()
    [[0.0, 0.3]]
    """
    return np.where(np.abs(moved) < ROUND_OFF * max_abs(motions), 0.0, moved)
