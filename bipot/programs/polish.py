r"""Semismooth Newton on a tangent program, from an interior-point answer or from any other.

Interior points stall where strict complementarity fails (the axis node of a quadratic mesh carries no force and no
gap). The natural map of the same program does not, once the right pieces are chosen:

    K dU - f - G' r = 0,   r_n = (r_n - rho gap)+,   r_t = projection of (r_t - rho slip) on the disc of radius s,

with s frozen (or De Saxce's shift, :class:`ShiftedCone`), or s = mu (r_n)+ for exact Coulomb friction on the same
quadratic model (then unsymmetric, and its result is used only if it is exact). A step is that of
:mod:`bipot.programs.newton`, with a new factorisation only where a contact has changed its piece.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from bipot.errors import ProgramError
from bipot.programs.conic import TangentProgram
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.newton import Linearised
from bipot.programs.ordering import Pattern
from bipot.programs.pieces import Law, Pieces, ShiftedCone
from bipot.typing import Floats

ITERATIONS = 12
EXACT = 1e-10

RUNAWAY = 1e100
"""A step or a force above this, in the program's own units, nearly overflows when squared: the iteration diverges."""


def polish(program: TangentProgram, x: Floats, r: Floats, frames: Frames | None = None) -> tuple[Floats, Floats]:
    """The program's answer to round-off, from (x (n,), r (c, d)); the start if Newton makes it worse."""
    terms, scale = program.contact, _scale(program)

    def at(motion: Floats, r: Floats) -> Law:
        if terms.shift is not None:
            return ShiftedCone.of(terms.rows, motion, r, scale, terms.shift)
        return Pieces.of(terms.rows, motion, r, scale, threshold=terms.threshold)

    x, r, _ = _newton(program, at, x, r, frames)
    return x, r


def couple(program: TangentProgram, x: Floats, r: Floats, frames: Frames | None = None) -> tuple[Floats, Floats] | None:
    """Exact Coulomb on the program's quadratic model, from (x, r); None when Newton does not reach it."""
    rows, scale = program.contact.rows, _scale(program)
    x, r, error = _newton(program, lambda motion, r: Pieces.of(rows, motion, r, scale), x, r, frames)
    return (x, r) if error <= EXACT else None


def _newton(
    program: TangentProgram,
    at: Callable[[Floats, Floats], Law],
    x: Floats,
    r: Floats,
    frames: Frames | None,
) -> tuple[Floats, Floats, float]:
    """Best iterate and its residual over the largest force."""
    rows, K = program.contact.rows, sp.csc_matrix(program.K)
    frames = frames or Frames.of(rows, Pattern.of(K.indices, K.indptr))
    best, least, last = (x, r), np.inf, None
    scale = max(float(np.abs(program.f).max()), float(np.finfo(float).tiny))
    for _ in range(ITERATIONS):
        residual, motion = K @ x - program.f, rows.motion(x)
        law, scale = at(motion, r), max(scale, float(np.abs(r).max(initial=0.0)))
        balance, miss = float(np.abs(residual - rows.forces(r)).max()), law.value(motion, r)
        error = max(balance, float(np.abs(miss).max(initial=0.0))) / scale
        # Once it no longer falls from round-off, another step would only add noise. Until then steps are worth taking:
        # an open contact of a body without force must carry exactly none.
        if least <= EXACT and error >= least:
            break
        if error < least:
            best, least = (x, r), error
        try:
            if last is None or not last.pieces.same(law):
                last = Linearised.of(frames.pattern.by_row(np.asarray(K.data, dtype=np.float64)), frames, law)
        except ProgramError:
            break
        dx, r = last.step(residual, miss, r)
        if not max(float(np.abs(dx).max(initial=0.0)), float(np.abs(r).max(initial=0.0))) <= RUNAWAY:
            break
        # Where there is no force, what is left of it is the round-off of its row.
        x, r = x + dx, np.where(last.pieces.none, 0.0, r)
    return *best, least


def _scale(program: TangentProgram) -> Floats:
    """The scale between force and motion at each contact (c,): the mean stiffness, softened."""
    return np.full(program.contact.rows.count, SOFTENED * float(program.K.diagonal().mean()))
