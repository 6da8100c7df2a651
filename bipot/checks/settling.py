r"""The least motion among answers that obey the law equally well, where a body may move without strain.

Of all x + N t, with the rigid motions N t that neither supports nor closed contacts prevent, it is the one of least
norm that keeps gaps, and the directions of slips that cost friction: numbering, units and solver do not choose then. A
rigid motion N t is linear in t, and where it turns the body it strains it: the body follows it on as a rigid body does,
and settles again where that has led. Each such way is about as long as the square of the last one, and a few lead to
where none is left; so do they around curved tools, whose gaps are those along a tangent. Contacts that touch without a
force prevent motions in one direction only: from where the first way led, they may open.

A rate v = b + W (x - c) with a skew W moves a point in unit time along

    dy/dt = b + W (y - c),    to the end exp(W) y + ...,

a turn and a translation that strain nothing, however long they are. Points that v leaves at rest stay, and so do planes
and axes along which it moves nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.linalg import expm

from bipot.certificate import EPS
from bipot.checks.determinacy import STICKS, cleaned, loose_motions, may_leave, pressed_motions, shared_forces
from bipot.checks.examined import Examined
from bipot.conic.clarabel import solve_once
from bipot.conic.problem import Cone, ConicProgram, Rows
from bipot.conic.solver import Accuracy
from bipot.contact.closeness import carries
from bipot.errors import NotConverged, ProgramError
from bipot.iterate import Iterate
from bipot.programs.data import Block, Term
from bipot.tensors import norm
from bipot.typing import Floats, einsum, max_abs

SETTLED = 1e-12
"""A free rigid motion below this fraction of the increment's displacement is round-off."""

ENOUGH, WAYS = 1e-9, 10
"""A way this short, over the motion, need not be gone if all gaps are open; most ways that lead to the least motion."""

TURNLESS = 1e-12
"""A turn by less than this part of the way of a body is none."""

RESTS = 16.0
"""A motion below this many times the round-off of places is none."""

BOUNDLESS = 1e6
"""Forces that contacts exchange at a node, over all else that the body carries, of which the law tells no limit."""

TIGHT = Accuracy(1e-12)

OPENED = 10.0
"""Way to open a gap, over the least that one contact alone asks for, within which other gaps may bound it."""

CLOSED = 1e-5
"""Gap, over the motion, that a program's answer may leave where the least motion leaves none."""

LEFT = 4e-12
"""Gap left where a body comes to rest, over its displacement: a contact without a force may not close by the round-off
of :data:`TIGHT`, but it may be open."""


def least_moved(examined: Examined) -> tuple[Examined, tuple[str, ...]]:
    """The answer with the least free rigid motion, and what is not determined, in words.

    Raises:
        NotConverged: contacts press a node between them by more than :data:`BOUNDLESS`.
    """
    iterate, r, noise = examined.iterate, examined.r, _noise(examined)
    shared = shared_forces(iterate, r)
    _refuse_boundless(iterate, r, shared, noise)
    words = [f"forces at node {node}" for node in shared]
    loose = loose_motions(iterate, r, noise)
    if loose.shape[1]:
        words.append(f"position in {loose.shape[1]} rigid motion" + "s" * (loose.shape[1] > 1))
    elif may_leave(iterate, r, noise):
        words.append("position: nothing keeps the body at contacts that carry nothing")
    else:
        return examined, tuple(words)
    least = at_least(iterate, r, loose, noise)
    return examined if least is iterate else replace(examined, iterate=least), tuple(words)


def _refuse_boundless(iterate: Iterate, r: Floats, shared: Sequence[int], noise: float) -> None:
    """Refuse forces at ``shared`` nodes beside which all that the body carries, if more than ``noise``, is nothing."""
    here = np.isin(iterate.increment.system.candidates.node, shared)
    carried = max(max_abs(iterate.response.element_forces), max_abs(iterate.load), max_abs(r[~here]), noise)
    if max_abs(r[here]) > BOUNDLESS * carried:
        largest = int(iterate.increment.system.candidates.node[here][norm(r[here]).argmax()])
        raise NotConverged(
            f"contacts press node {largest} between them, and nothing says how much",
            advice=f"Take newton for the first form, or leave node {largest} to one tool.",
        )


def unloaded(examined: Examined) -> Examined:
    """The answer without contact forces that are all round-off, which would tell the next increment who carries."""
    present = max_abs(examined.r)
    if not 0 < present <= _round_off(examined):
        return examined
    freed = replace(examined, r=np.zeros_like(examined.r))
    return freed if max(freed.ratios().values()) <= 1 else examined


def _round_off(examined: Examined) -> float:
    """That of contact forces."""
    present = max(max_abs(forces) for forces in (examined.r, examined.increment.start.forces))
    return examined.certificate.resolution.law * present


def _noise(examined: Examined) -> float:
    """Contact forces up to this count as none: the round-off of the law, or STICKS times the largest of the run.

    Where contacts have opened, forms may leave a remainder of this size on them, which holds nothing.
    """
    return max(_round_off(examined), STICKS * examined.largest)


def at_least(iterate: Iterate, r: Floats, N: Floats, noise: float) -> Iterate:
    """The iterate of least motion, reached from that given by a way in N (n, m).

    Others follow until there is none. They open contacts that carry no force and that a turn has closed, or the pass
    that was solved.
    """
    if not iterate.x.any():
        return iterate
    blur, sunk = EPS * max_abs(iterate.increment.start.nodes), np.minimum(iterate.motion[:, 0], 0.0)
    least = _followed_on(iterate, settled(iterate, r, N, noise)) if N.size else iterate
    for _ in range(WAYS):
        try:
            x = settled(least, r, pressed_motions(least, r, noise), noise, sunk)
        except ProgramError:
            break
        near = norm(x - least.x) <= max(ENOUGH * norm(x), blur)
        if near and (least.motion[:, 0] >= sunk).all():
            break
        least = _followed_on(least, x)
    # A motion below the round-off of places is none, and strains nothing: what strain it had came of the way here.
    return least if max_abs(least.x) > RESTS * blur else least.increment.at(np.zeros_like(least.x))


def _followed_on(iterate: Iterate, x: Floats) -> Iterate:
    """The iterate after the rigid motion that begins along the way to x (n,).

    Where its bend is round-off, or there is no way at all, the iterate is that at x, or the one given.
    """
    increment, way = iterate.increment, x - iterate.x
    if norm(way) <= SETTLED * norm(x):
        return iterate
    if not iterate.response.kinematics.moves:
        return increment.at(x)
    space, part = increment.system.body.space, increment.system.body.scene.mesh.part
    rate, moved = space.spread(way), np.empty_like(iterate.nodes)
    for own in (part == k for k in range(int(part.max()) + 1)):
        moved[own] = moved_on(iterate.nodes[own], rate[own])
    followed = iterate.x + space.gather(np.append(moved, space.beside(way)))
    bend = max_abs(followed - x) / max_abs(way)
    return increment.at(x if bend <= EPS else followed)


def settled(iterate: Iterate, r: Floats, N: Floats, noise: float, sunk: Floats | None = None) -> Floats:
    """The displacement of least norm among x + N t that keeps gaps, and the directions of slips that cost friction.

    Gaps that a turn has closed are opened, where it is known how far they were ``sunk`` (c,) before, none above zero.
    Slips of contacts that carry no more than ``noise`` cost none.
    """
    rows, motion, x = iterate.rows, iterate.motion, iterate.x
    if sunk is None and norm(N.T @ x) <= SETTLED * norm(x):
        return x
    slip = motion[rows.frictional, 1:]
    length = norm(slip)
    rubs = carries(r, noise)[rows.frictional]
    # At the edge of the cone without a slip, the only slip allowed is against the friction.
    pull, still = r[rows.frictional, 1:], length == 0
    ahead = np.where(still[:, None], -pull, slip)
    size = norm(ahead)
    along = ahead * (rubs / np.where(size > 0, size, 1.0))[:, None]
    forward = einsum("fi,fim->fm", along, (rows.G_t @ N).reshape(*slip.shape, N.shape[1]))
    unit = float(norm(x)) or 1.0
    opens, room = rows.G_n @ N, np.maximum(motion[:, 0], 0.0)
    if sunk is not None:
        opens, gap = cleaned(opens, N), motion[:, 0] - sunk
        # A gap that nothing opens, or that is closed, stays as it is.
        kept = ~opens.any(axis=1) | ((gap >= 0) & (gap <= LEFT * unit))
        room = np.where(kept, np.maximum(gap, 0.0), gap - LEFT * unit)
    bounded, least = np.vstack([opens, forward]), np.append(room, length)
    # The way is no longer than twice that to the origin, but for gaps to be opened. Where the motion is round-off, what
    # is farther off than that is farther than the program has numbers for.
    sizes = norm(bounded)
    opened = np.divide(-least, sizes, out=np.zeros_like(least), where=sizes > 0).max(initial=0.0)
    near = least <= sizes * (2 * norm(N.T @ x) + OPENED * opened)
    bounded, least = bounded[near], least[near]
    program = ConicProgram(
        P=sp.csc_matrix(np.eye(N.shape[1])),
        q=N.T @ x / unit,
        rows=(Rows(Term.GAP, Cone.NONNEGATIVE, sp.csr_matrix(bounded), least / unit),),
        blocks={Block.DISPLACEMENT: slice(0, N.shape[1])},
    )
    # By a cone program: in degenerate cases scipy's nnls ends far from the least distance and says nothing.
    return x + N @ (unit * _exactly(bounded, least / unit, N.T @ x / unit, solve_once(program, TIGHT).x))


def _exactly(opens: Floats, room: Floats, gone: Floats, way: Floats) -> Floats:
    """The ``way`` t (m,) of least |gone + t| with opens t + room >= 0, of which a program knows some digits.

    Where a gap just closes and nothing presses it, these are half of the digits. The gaps that the way all but closes
    are closed, if this keeps the others and goes no farther.
    """
    closed = opens @ way + room <= CLOSED * norm(opens)
    exact = np.linalg.pinv(opens[closed], rcond=CLOSED) @ (opens[closed] @ gone - room[closed]) - gone
    keeps = (opens @ exact + room >= np.minimum(opens @ way + room, 0.0) - EPS).all()
    return exact if keeps and norm(gone + exact) <= norm(gone + way) + ENOUGH else way


def moved_on(places: Floats, rate: Floats) -> Floats:
    """The displacement (a, d) of ``places`` (a, d) by the rigid motion that begins at the ``rate`` (a, d).

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> quarter = np.pi / 2 * np.array([[0.0, 0.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0]])
    >>> (square + moved_on(square, quarter))[1:3].round(12).tolist()
    [[0.0, 1.0], [-1.0, 1.0]]
    """
    d, centre, along = places.shape[1], places.mean(axis=0), rate.mean(axis=0)
    slope: Floats = np.linalg.lstsq(places - centre, rate - along)[0].T
    turn = (slope - slope.T) / 2
    # A translation has the round-off of one.
    turn[np.abs(turn) * np.ptp(places) <= TURNLESS * max_abs(rate)] = 0.0
    motion = np.zeros((d + 1, d + 1))
    motion[:d, :d], motion[:d, d] = turn, along
    whole = np.asarray(expm(motion)) - np.eye(d + 1)
    return (places - centre) @ whole[:d, :d].T + whole[:d, d]
