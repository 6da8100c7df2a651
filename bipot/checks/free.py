"""Rigid motions of a body that nothing could prevent.

A rigid motion N v that the supports allow is free if no candidate contact could ever stop it: G_n N v >= 0 at every
candidate (none closes), and no slip where a contact with friction stays closed; welds stay as they are. Candidates
count at any distance, since they may land. These v form a cone in at most three dimensions, six in space; a linear
program says which contacts a motion in it can open.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import null_space

from bipot.basics.nonnegative import nonnegative
from bipot.checks.determinacy import ROUND_OFF, cleaned, openable
from bipot.iterate import Increment
from bipot.programs.data import ContactRows
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Floats, max_abs, vdot


def free(increment: Increment, forces: Floats) -> Floats | None:
    """A motion of the unknowns (n,) that nothing could prevent at the increment's start, None if none is known.

    Its largest nodal displacement is 1. Of a body under loads, nodal ``forces`` (a, d), it is one that they push,
    unless friction is capped. Contacts with friction do not slip in it, and all of them open or none changes.
    """
    system, rows = increment.system, increment.unmoved.rows
    rigid = system.rigid_at(increment.start.nodes)
    normal, tangent = _changes(rows, rigid)
    # These motions leave all contacts as they are and are free in both directions.
    still = null_space(np.vstack([normal, *tangent[rows.rubs]]), rcond=ROUND_OFF)
    push = np.array([vdot(forces, system.body.space.spread(way)) for way in rigid.T])
    if max_abs(push @ still) > ROUND_OFF * float(np.linalg.norm(forces)):
        return _of_length_one(system, rigid @ still @ (push @ still))
    if forces.any() and not rows.capped:
        # Where a contact with friction stays closed, bipot.limit_analysis.collapse decides on all motions by a proof.
        basis = null_space(np.vstack([normal[rows.tied], *tangent[rows.rubs]]), rcond=ROUND_OFF)
        v = basis @ _along(push @ basis, normal @ basis)
        stays = rows.rubs & (normal @ v <= ROUND_OFF * norm(v))
        return None if stays.any() else _of_length_one(system, rigid @ v)
    if (found := _opening(rows, normal, tangent)) is None:
        return None
    opened, basis = found
    if opened is not None:
        return _of_length_one(system, rigid @ basis @ opened)
    v = rigid @ basis @ null_space(normal @ basis, rcond=ROUND_OFF).sum(axis=1)
    motion = system.body.space.spread(v)
    # Where nothing opens, the motion is free in both directions, and the largest component is made positive.
    return _of_length_one(system, -v if motion.flat[np.abs(motion).argmax()] < 0 else v)


def neutral(increment: Increment) -> Floats | None:
    """A motion of the unknowns (n,) that leaves all contacts of the body at rest as they are, None if there is none."""
    system = increment.system.facing(increment.system.body.scene.mesh.nodes)
    rows, rigid = replace(increment, system=system, start=system.rest()).unmoved.rows, system.rigid
    normal, tangent = _changes(rows, rigid)
    still = null_space(np.vstack([normal, *tangent[rows.rubs]]), rcond=ROUND_OFF)
    return _of_length_one(system, rigid @ still[:, 0]) if still.size else None


def _changes(rows: ContactRows, rigid: Floats) -> tuple[Floats, Floats]:
    """How gaps (c, m) and slips (c, d - 1, m) change with ``rigid`` motions (n, m)."""
    tangent = np.zeros((rows.count, rows.tangents, rigid.shape[1]))
    tangent[rows.frictional] = cleaned(rows.G_t @ rigid, rigid).reshape(tangent[rows.frictional].shape)
    return cleaned(rows.G_n @ rigid, rigid), tangent


def _opening(rows: ContactRows, normal: Floats, tangent: Floats) -> tuple[Floats | None, Floats] | None:
    """The motion v (b,) that opens all contacts it can, None where none opens, in a basis (m, b); None if unknown.

    In motions of the basis welds neither open nor slip, and no contact slips that stays closed.
    """
    basis = null_space(np.vstack([normal[rows.tied], *tangent[rows.tied & rows.rubs]]), rcond=ROUND_OFF)
    rubbing = rows.rubs & ~rows.tied
    while (found := openable(normal @ basis)) is not None:
        opened, v = found
        closed = rubbing & ~opened
        if not closed.any():
            return v if opened.any() else None, basis
        slips = np.vstack([np.empty((0, basis.shape[1])), *(tangent[closed] @ basis)])
        basis, rubbing = basis @ null_space(slips, rcond=ROUND_OFF), rubbing & opened
    return None


def _along(push: Floats, normal: Floats) -> Floats:
    """The motion v (m,) with ``normal`` (c, m) v >= 0 that is nearest to ``push`` (m,): zero where it pushes none.

    It is push + normal' r with the r >= 0 for which this sum is shortest (Moreau).
    """
    # Rows that are dependent but for round-off would make the search endless, or end it elsewhere.
    push, normal = (np.where(np.abs(a) > ROUND_OFF * max_abs(a), a, 0.0) for a in (push, normal))
    r = nonnegative(normal.T, -push)
    v = push if r is None else push + normal.T @ r
    return np.zeros_like(v) if r is None or norm(v) <= ROUND_OFF * norm(push) else v


def _of_length_one(system: System, v: Floats) -> Floats | None:
    """The motion v (n,) over its largest nodal displacement, None if this is zero."""
    largest = float(norm(system.body.space.spread(v)).max())
    return v / largest if largest > 0 else None


def rubs(increment: Increment, v: Floats) -> bool:
    """Whether a contact opens so little by the motion v (n,) that friction could hold the body all the same.

    Forces in Coulomb's cone can work against a motion that opens a contact by less than mu times its slip.
    """
    rows = increment.unmoved.rows
    opens, slips = rows.G_n @ v, np.zeros(rows.count)
    slips[rows.frictional] = norm((rows.G_t @ v).reshape(rows.slip.shape))
    held = ~rows.tied & (slips > ROUND_OFF)
    return bool((opens[held] < rows.rubbing[held] * slips[held]).any())
