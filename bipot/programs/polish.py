r"""Semismooth Newton on a tangent program, from an interior-point answer or from any other.

Interior points stall where strict complementarity fails (the axis node of a quadratic mesh carries no force and no
gap). The natural map of the same program has no such trouble once the right pieces are chosen:

    K dU - f - G' r = 0,   r_n = (r_n - rho gap)+,   r_t = projection of (r_t - rho slip) on the disc of radius s,

with s frozen (or De Saxce's shift, :meth:`bipot.programs.pieces.Mapped.shifted_cone`), or s = mu (r_n)+ for exact
Coulomb friction on the same quadratic model (then unsymmetric, and only a step of the fixed point on s: the result
counts only if it is exact). The iteration is that of :func:`bipot.programs.newton.minimised`.
"""

from __future__ import annotations

import numpy as np

from bipot.programs.conic import TangentProgram
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.newton import EXACT, Model, minimised
from bipot.programs.pieces import Law, Mapped, Pieces
from bipot.typing import Floats


def polish(program: TangentProgram, x: Floats, r: Floats, frames: Frames | None = None) -> tuple[Floats, Floats]:
    """The program's own answer to round-off, from (x (n,), r (c, d)); the start if Newton worsens it."""
    terms, scale = program.contact, _scale(program)

    def at(motion: Floats, r: Floats) -> Law:
        if terms.shift is not None:
            return Mapped.shifted_cone(terms.rows, motion, r, scale, terms.shift)
        return Pieces.of(terms.rows, motion, r, scale, threshold=terms.threshold)

    best = minimised(_model(program), at, x, r, frames)
    return best.x, best.r


def couple(program: TangentProgram, x: Floats, r: Floats, frames: Frames | None = None) -> tuple[Floats, Floats] | None:
    """Exact Coulomb on the program's quadratic model, from (x, r); None when Newton does not reach it."""
    rows, scale = program.contact.rows, _scale(program)
    best = minimised(_model(program), lambda motion, r: Pieces.of(rows, motion, r, scale), x, r, frames)
    return (best.x, best.r) if best.error <= EXACT else None


def _model(program: TangentProgram) -> Model:
    return Model(program.K, program.f, program.contact.rows)


def _scale(program: TangentProgram) -> Floats:
    """What balances force against motion at each contact (c,): the mean stiffness, softened."""
    return np.full(program.contact.rows.count, SOFTENED * float(program.K.diagonal().mean()))
