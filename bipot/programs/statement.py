r"""Contact as one states it in cvxpy, shared by every exact program.

    cost s' t,   G_n dU + g >= 0,   (t_c, G_t,c dU + w_c) in the second-order cone,   ties as equalities,

or, with De Saxce's shift frozen, (G_n,c dU + g_c + shift_c, mu G_t,c dU + mu w_c) in it and no cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from bipot.programs.data import Block, Term
from bipot.programs.terms import ContactTerms


@dataclass(frozen=True)
class ContactStatement:
    """The contact part of a stated program: its cost, its variables and its constraints, by the conic form's names."""

    cost: Any
    blocks: dict[str, cp.Expression]
    constraints: dict[str, cp.Constraint]

    @staticmethod
    def of(dU: cp.Variable, contact: ContactTerms) -> ContactStatement:
        """State gap, friction and ties on the displacement variable ``dU``."""
        rows = contact.rows
        normal, tied = rows.G_n[contact.unilateral], rows.G_n[rows.tied]
        sliding, slip = contact.tangent_rows(contact.sliding)
        cost: Any = cp.Constant(0.0)
        blocks: dict[str, cp.Expression] = {Block.DISPLACEMENT: dU}
        constraints: dict[str, cp.Constraint] = {}
        if normal.shape[0]:
            constraints[Term.GAP] = normal @ dU + rows.gap[contact.unilateral] >= 0
        if slip.size:
            t = blocks[Block.SLIP_BOUND] = cp.Variable(len(slip))
            constraints[Term.FRICTION] = cp.SOC(t, cp.reshape(sliding @ dU, slip.shape, order="C") + slip, axis=1)
            cost = contact.threshold[contact.sliding] @ t
        if tied.shape[0]:
            stuck, offset = contact.tangent_rows(contact.stuck)
            shut = np.concatenate([rows.gap[rows.tied], offset.ravel()])
            constraints[Term.TIE] = sp.vstack([tied, stuck]) @ dU + shut == 0
        normal, gap, tangent, slip = contact.shifted_rows()
        if gap.size:
            motion = cp.reshape(tangent @ dU, slip.shape, order="C") + slip
            constraints[Term.COULOMB] = cp.SOC(normal @ dU + gap, motion, axis=1)
        return ContactStatement(cost, blocks, constraints)
