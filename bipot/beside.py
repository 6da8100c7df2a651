"""A changed scene that goes along with the march of another: its increments from the accepted ones, by few steps.

Steps are those of Newton's method with the matrix of the accepted increment (:mod:`bipot.sensitivity`). It leaves out
that deformable tools and their candidates face each other otherwise as nodes move. With the step h(x) from an iterate
x, the way w from there solves h(x) + h'(x) w = 0, by GMRES with differences of steps. Where two ends are right before
each other, what is faced has a kink: it changes otherwise on the way back (:meth:`Beside.kinked`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from bipot.control.accepted import Accepted
from bipot.control.facing import faced, refaced
from bipot.errors import ProgramError, require
from bipot.forms import Cache
from bipot.forms.memory import Setup
from bipot.forms.newton import factorised
from bipot.forms.point import Law, Point
from bipot.iterate import Increment, Iterate
from bipot.programs.factors import DEFAULT
from bipot.programs.frames import Frames
from bipot.programs.newton import Linearised
from bipot.programs.pieces import Pieces
from bipot.state import State
from bipot.system import System
from bipot.typing import Floats, max_abs

STEPS, ENOUGH = 12, 1e-6
"""Most steps to a changed answer, and the part of the first step at which they end. Each step leaves a part of what the
matrix leaves out: changes of caps of friction, and of ways through the air to tools that forces drive."""

AHEAD, KRYLOV = 1e-7, 30
"""Way, over the body's size, along which it is seen how steps change, and most ways of which a whole one is made."""

RESOLVED, KINK = 1e-10, 1e-3
"""Change of the forces over themselves, or of places over the body's size, that round-off alters by a thousandth; part
of a change, or of as much as that, by which what sides face changes otherwise on the way back where it has a kink."""


class Tangent(NamedTuple):
    """An accepted increment: its answer ``here``, its matrix, and the ``fraction`` (e, q) of the flow carried on."""

    law: Law
    here: Point
    linearised: Linearised[Pieces]
    fraction: Floats
    setup: Setup

    @staticmethod
    def of(accepted: Accepted, cache: Cache) -> Tangent:
        """That of an ``accepted`` increment; raises ProgramError where nothing determines its changes."""
        allowed = "one whose answers obey Coulomb's law itself, and not a penalised one"
        require(accepted.solved.posed is None, "control.form", accepted.form.value, allowed)
        if accepted.solved.undetermined:
            raise ProgramError(f"nothing determines how the answer changes: {accepted.solved.undetermined[0]}")
        iterate, r = accepted.solved.iterate, accepted.solved.r
        setup, frames = cache.setup(iterate), cache.frames(iterate.increment.rows, iterate)
        law = Law(frames, setup.scale(frames), max_abs(iterate.increment.start.forces))
        here = law.point(iterate, r, None)
        element = iterate.tangent(r, setup.scratch)
        linearised = factorised(here, element, law.frames_at(iterate), setup, DEFAULT)
        fraction = _carried(iterate, accepted.start)
        return Tangent(law, here, linearised, fraction, setup)

    def at(self, other: Iterate) -> tuple[Tangent, bool]:
        """That of an ``other`` scene's iterate, and whether its contacts act on unknowns by the same rows.

        Where these are on other unknowns, as at a lid that is tilted out of an axis, the matrix is made anew.
        """
        (row, unknown, _), (its, there, _) = self.here.iterate.rows.entries, other.rows.entries
        if np.array_equal(row, its) and np.array_equal(unknown, there):
            return self, True
        frames = Frames.of(other.rows, self.setup.pattern)
        law = replace(self.law, frames=frames)
        here = law.at(other, self.here.r, self.here.pieces)
        matrix = factorised(here, other.tangent(self.here.r, self.setup.scratch), frames, self.setup, DEFAULT)
        return self._replace(law=law, linearised=matrix), set(row.tolist()) == set(its.tolist())


def _carried(iterate: Iterate, start: State) -> Floats:
    """The fraction (e, q) of the flow of the ``start`` that was carried on into an increment."""
    if start.flow is None:
        return np.zeros_like(start.peeq)
    last, begun = start.flow.strain, iterate.increment.start.plastic_strain
    square = np.vecdot(last, last)
    return np.vecdot(begun - start.plastic_strain, last) / np.where(square > 0, square, 1.0)


class Around(NamedTuple):
    """Steps of Newton's method in an increment of a changed scene, with the matrix of the accepted one."""

    increment: Increment
    tangent: Tangent

    def at(self, x: Floats) -> Iterate:
        """The iterate of the unknowns x (n,)."""
        return refaced(self.increment.at(x))

    def step(self, end: Iterate, r: Floats) -> tuple[Floats, Floats, bool]:
        """The step dx (n,) from an iterate with forces r (c, d), the next forces, and whether contacts stay alike."""
        tangent, alike = self.tangent.at(end)
        point = tangent.law.point(end, r, tangent.here.pieces)
        linearised = replace(tangent.linearised, frames=tangent.law.frames.turned(end.rows), pieces=point.pieces)
        dx, new = linearised.step(end.residual, point.miss, r)
        forces = np.where(point.pieces.none, 0.0, new)
        return dx, forces, alike and _same(point.pieces, tangent.here.pieces)

    def at_caps(self, end: Iterate, r: Floats) -> Floats:
        """Forces r (c, d) that are those of the caps and directions of slip at an iterate where caps hold friction.

        Within steps they are not: directions of slip would follow them one step late.
        """
        return self.tangent.law.point(end, r, self.tangent.here.pieces).pieces.at_caps(r)

    def way(self, end: Iterate, r: Floats, dx: Floats) -> Floats:
        """The way (n,) from an iterate with the step dx (n,): dx itself, but at deformable tools (module docstring)."""
        if not self.increment.system.candidates.deformable or not dx.any():
            return dx
        # Imported here because few slopes need it.
        from scipy.sparse.linalg import LinearOperator, gmres

        ahead = AHEAD * self.increment.system.body.scene.size

        def falls(way: Floats) -> Floats:
            part = ahead / (max_abs(way) or 1.0)
            return (dx - self.step(self.at(end.x + part * way), r)[0]) / part

        operator = LinearOperator((len(dx), len(dx)), falls, dtype=np.float64)
        return np.asarray(gmres(operator, dx, rtol=ENOUGH, restart=KRYLOV, maxiter=1)[0])


@dataclass
class Beside:
    """A scene that goes along with the march, at its ``state``; what its tools bear and whether it is ``smooth``.

    The last step to its answer, at the ``end`` of the increment, ``left`` as much.
    """

    system: System
    state: State
    tool_forces: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    smooth: bool = True
    left: float = 0.0
    end: Iterate | None = None

    @staticmethod
    def of(system: System) -> Beside:
        """At rest."""
        return Beside(system, system.rest())

    def follow(self, tangent: Tangent) -> None:
        """Make the increment, by steps of Newton's method from the accepted answer, with its matrix."""
        start, body, answer = self.state, self.system.body, tangent.here
        tau = answer.iterate.increment.tau
        begun = start if start.flow is None else body.carried_on(start, start.flow.times(tangent.fraction))
        around = Around(Increment(self.system, begun, tau, accepted=start), tangent)
        end, forces, moves, smooth = around.at(answer.iterate.x), answer.r, list[float](), True
        # Until steps are small, or no longer fall: what is left is round-off.
        while len(moves) < 2 or (len(moves) < STEPS and ENOUGH * moves[0] < moves[-1] < moves[-2] / 2):
            dx, new, stays = around.step(end, forces)
            end, forces, smooth = around.at(end.x + around.way(end, forces, dx)), new, smooth and stays
            moves.append(max_abs(dx))
        forces = around.at_caps(end, forces)
        self.tool_forces, self.smooth, self.left, self.end = end.tool_forces(forces), smooth, moves[-1], end
        self.state = body.advance(start, end.response, tau, forces, end.motion[:, 0])

    def kinked(self, other: Beside) -> bool:
        """Whether forces at nodes, or gaps and slips, have a kink on the way to an ``other`` scene beside this one.

        Contacts that carry forces here are taken with what sides face where nodes are here, there and as far back.
        """
        if self.end is None or other.end is None or not self.system.candidates.deformable:
            return False
        end, r, now, then = self.end, self.state.forces, self.state.nodes, other.state.nodes
        each = [end.rows, *(faced(end, nodes).rows for nodes in (then, 2 * now - then))]
        here, there, back = (rows.forces(r) for rows in each)
        change = max(max_abs(other.end.rows.forces(other.state.forces) - here), RESOLVED * max_abs(here))
        if max_abs(there + back - 2 * here) > KINK * change:
            return True
        here, there, back = (rows.motion(end.x)[r.any(axis=1)] for rows in each)
        moved = max(max_abs(then - now), RESOLVED * self.system.body.scene.size)
        return max_abs(there + back - 2 * here) > KINK * moved


def _same(one: Pieces, other: Pieces) -> bool:
    """Whether contacts are on the same pieces: touching or not, and of those that touch stuck or sliding."""
    closed = one.closed
    slides = np.array_equal(one.disc.slides[closed], other.disc.slides[closed])
    return slides and np.array_equal(closed, other.closed)
