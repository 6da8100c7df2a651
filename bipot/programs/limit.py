r"""The limit load of a body in a fixed shape: a kinematic program, and the inequalities that make its answer a proof.

A motion v gains F . v from the loads and dissipates D(v) = sum_q w sqrt(2/3) sigma_Y |dev B v|. Over all

    tr B v = 0 everywhere,    G_n v >= mu |G_t v| at the contacts,    F . v = 1,

the least D(v) is the fraction of the load that the body carries. Where it is below one, no stress within the yield
surface and no contact forces within Coulomb's cone balance F in this shape: virtual work with v gives F . v = sum_q w
sigma : B v - sum_c r . G v <= D(v), because r . G v >= 0 in the cone's dual (Farkas). The dilatant slip belongs to the
proof and not to the body, and only raises the fraction. The inequalities judge any v, however it was found.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.linalg import qr
from scipy.sparse.linalg import norm as row_lengths
from scipy.sparse.linalg import splu

from bipot.conic.clarabel import solve_once
from bipot.conic.problem import Cone, ConicProgram, Rows, Variables
from bipot.conic.solver import Accuracy
from bipot.errors import InfeasibleProgram, ProgramError
from bipot.programs.data import Block, ContactRows, Term
from bipot.programs.dissipation import ROOT, PlasticModel
from bipot.programs.terms import ContactTerms, norm_rows, widened
from bipot.typing import Floats, max_abs

ACCURATE = Accuracy(1e-9)

DENSE = 3000
"""Unknowns up to which a basis of the motions that preserve the volume is computed."""

DEPENDENT = (1e-8, 1e-10, 1e-12)
"""Remainders of a row, over the longest, below which it depends on the others, tried in turn: round-off far from the
origin is above the last, rows of curved or axisymmetric elements that lock are below the first."""

FARKAS = 1e-6
"""Work by which a mechanism may penetrate tools, over the load's gain or its dissipation."""

BALANCED = 1e-6
"""Gain of a load, over the work of its parts on the largest motion, up to which no collapse is claimed: where the parts
balance each other it is round-off, or more in a shape that was found with equilibrium to 1e-7."""

KEPT = 1e-9
"""Work by which a mechanism may change the volume, over the same; answers reach 1e-12. Where rows are nearly dependent,
as in curved elements that lock, a solver may leave 3e-7 and a limit load 1.5 % too low."""

SAME = 1e-6
"""Relative change of the dissipation up to which a mechanism with its volume corrected is still the least."""

SOFT = 1e-12
CORRECTIONS = 3
"""Regularisation of a correction's system where rows are dependent, and the number of its solutions: one usually leaves
1e-13 of a motion."""

UNMOVED = (
    "no motion that the load drives keeps the volume of the elements and closes no contact: "
    "elements that lock, supports or tools carry any multiple of it"
)


@dataclass(frozen=True)
class Mechanism:
    """A motion v (n,) on which a load gains one, with its judgement: works and v itself are divided by the gain.

    ``volume`` is the largest change of volume (as work of sigma_Y), ``carried`` the plastic dissipation, and
    ``overtaken`` the work of all loads together on the largest closure of a contact, or lack of dilatant opening.
    ``share`` is the gain F . v over sum_i |F_i| max |v|, small where the parts of the load balance each other on v.
    Where ``rubs`` is false no contact slips: no friction would hold the load.
    """

    v: Floats
    volume: float
    carried: float
    overtaken: float
    share: float
    rubs: bool = True

    @staticmethod
    def of(model: PlasticModel, force: Floats, rows: ContactRows, v: Floats) -> Mechanism:
        """The mechanism of the motion v (n,) under ``force`` (n,); a motion without gain is none."""
        gain = float(force @ v)
        if not gain > 0:
            return Mechanism(v, np.inf, np.inf, np.inf, 0.0)
        change = np.abs(model.volumetric @ v).max() * model.weight.sum() * model.threshold.max()
        flow = np.linalg.norm((model.deviatoric @ v).reshape(model.stress.shape), axis=1)
        carried = float(ROOT * (model.weight * model.threshold) @ flow) / gain
        return Mechanism(v / gain, float(change) / gain, carried, _overtaken(force, rows, v) / gain, _share(force, v))

    @property
    def admissible(self) -> bool:
        """Whether only plastic flow resists the motion."""
        scale = max(self.carried, 1.0)
        return self.volume <= KEPT * scale and self.overtaken <= FARKAS * scale

    @property
    def holds(self) -> bool:
        """Whether the motion proves that the load is above the limit: admissible, with less dissipation than gain.

        A gain that is only what is left of the load's parts when they cancel does not count: the load is in balance.
        """
        return self.admissible and self.carried < 1 and self.share > BALANCED


def _share(force: Floats, v: Floats) -> float:
    """The gain F . v over the work of all parts of F on the largest part of v."""
    return float(force @ v) / (float(np.abs(force).sum()) * max_abs(v))


def _overtaken(force: Floats, rows: ContactRows, v: Floats) -> float:
    """The work of all of the load on the largest closure of a contact, or lack of dilatant opening."""
    motion = _still(rows).motion(v)
    slip = np.where(rows.tied, 1.0, rows.mu) * np.linalg.norm(motion[:, 1:], axis=1)
    short = np.where(rows.tied, np.abs(motion[:, 0]) + slip, np.maximum(slip - motion[:, 0], 0.0))
    return float(short.max(initial=0.0)) * float(np.abs(force).sum())


def sliding(force: Floats, rows: ContactRows, rigid: Floats) -> Mechanism:
    """The mechanism without strain, a combination of ``rigid`` motions (n, m) by which contacts slide or open.

    By duality there is one where no contact forces in their cones balance the load F (n,) on the body as a whole.

    Raises:
        InfeasibleProgram: there is none.
        ProgramError: no answer.
    """
    gain = force @ rigid
    most = np.abs(force).sum() * np.abs(rigid).max(axis=0, initial=0.0)
    gain = np.where(np.abs(gain) > BALANCED * most, gain, 0.0)
    if not gain.any():
        raise InfeasibleProgram(UNMOVED)
    variables, size = Variables(), rigid.shape[1]
    variables.add(Block.DISPLACEMENT, size)
    gained = Rows(Term.GAIN, Cone.ZERO, sp.csr_matrix(gain / max_abs(force)), -np.ones(1))
    cones = (gained, *_dilatant(_combined(rows, rigid)).cone_rows(size, size))
    program = ConicProgram(P=sp.csc_matrix((size, size)), q=np.zeros(size), rows=cones, blocks=variables.blocks)
    v = rigid @ solve_once(program, ACCURATE).block(Block.DISPLACEMENT)
    v /= float(force @ v)
    return Mechanism(v, 0.0, 0.0, _overtaken(force, rows, v), _share(force, v))


def unit_rows(rows: sp.csr_matrix) -> sp.csr_matrix:
    """The rows (m, n), each over its length; one of zeros stays."""
    length = row_lengths(rows, axis=1)
    return sp.csr_matrix(sp.diags(1 / np.where(length > 0, length, 1.0)) @ rows)


@dataclass(frozen=True)
class LimitProgram:
    """The material (its moduli and present stress do not matter), the load F (n,), the contacts.

    ``volumes`` (m, n) are independent rows that vanish where every change of volume does, None where none are known.
    """

    model: PlasticModel
    force: Floats
    rows: ContactRows
    volumes: sp.csr_matrix | None = None

    def mechanism(self) -> Mechanism:
        """The motion found, with its judgement.

        An answer that changes the volume is replaced by the nearest motion that preserves it. This proves a bound, but
        not the least one if its dissipation differs. Then, or if the interior points fail on the rows of volume,
        bases of the motions that preserve it are tried as well.

        Raises:
            InfeasibleProgram: no motion that the load drives keeps the volume.
            ProgramError: no answer.
        """
        try:
            found = self.judged(self.motion())
            kept = found if found.admissible else self.judged(self.nearest(found.v))
        except InfeasibleProgram:
            raise
        except ProgramError:
            if not (bases := isochoric(self._volumes)):
                raise
            return self._spanned(bases)
        same = abs(kept.carried - found.carried) <= SAME * found.carried
        if (kept.admissible and same) or not (bases := isochoric(self._volumes)):
            return kept
        spanned = self._spanned(bases)
        return min((m for m in (kept, spanned) if m.admissible), key=lambda m: m.carried, default=spanned)

    def _spanned(self, bases: list[Floats]) -> Mechanism:
        """The first admissible mechanism of ever smaller ``bases`` (n, k), or else that of the first.

        One without an answer proves nothing: rows that depend on others but for round-off may leave it no motion.
        """
        first, *smaller = bases
        found = self.judged(first @ self.within(first).motion())
        for basis in smaller:
            if found.admissible:
                break
            with suppress(ProgramError):
                other = self.judged(basis @ self.within(basis).motion())
                found = other if other.admissible else found
        return found

    def within(self, basis: Floats) -> LimitProgram:
        """The program of coefficients (k,) of a basis (n, k) of motions that preserve the volume, without its rows."""
        volumetric, deviatoric = (sp.csr_matrix(A @ basis) for A in (self.model.volumetric[:0], self.model.deviatoric))
        model = replace(self.model, volumetric=volumetric, deviatoric=deviatoric)
        return LimitProgram(model, basis.T @ self.force, _combined(self.rows, basis))

    def motion(self) -> Floats:
        """The answer (n,) to the sparse program as it stands.

        Raises:
            InfeasibleProgram: no motion that the load drives keeps the volume.
            ProgramError: no answer.
        """
        largest = np.abs(self.force).max(initial=0.0)
        if not largest > 0:
            raise InfeasibleProgram(UNMOVED)
        # The numbers of the program are of order one for any load.
        program = replace(self, force=self.force / largest)
        try:
            return solve_once(program.conic(), ACCURATE).block(Block.DISPLACEMENT)
        except InfeasibleProgram as none:
            raise InfeasibleProgram(UNMOVED) from none

    def nearest(self, v: Floats) -> Floats:
        """The motion (n,) nearest to v (n,) that preserves the volume: v - V'(V V')^-1 V v for rows V of unit length.

        Dependent rows hardly change it; the resulting motion is judged in any case.
        """
        rows = unit_rows(self._volumes)
        m, n = rows.get_shape()
        saddle = sp.block_array([[sp.identity(n), rows.T], [rows, -SOFT * sp.identity(m)]])
        factor = splu(sp.csc_matrix(saddle))
        for _ in range(CORRECTIONS):
            v = v - factor.solve(np.append(np.zeros(n), rows @ v))[:n]
        return v

    def judged(self, v: Floats) -> Mechanism:
        """The judgement of the motion v (n,)."""
        return Mechanism.of(self.model, self.force, self.rows, v)

    @property
    def _volumes(self) -> sp.csr_matrix:
        """Rows that vanish where every change of volume does."""
        return self.model.volumetric if self.volumes is None else self.volumes

    def conic(self) -> ConicProgram:
        """Variables (v, t): least sum_q w sqrt(2/3) sigma_Y t_q, t_q >= |dev B v|, and the constraints."""
        m, variables = self.model, Variables()
        points, width = m.stress.shape
        variables.add(Block.DISPLACEMENT, len(self.force))
        norms = variables.add(Block.PLASTIC_NORM, points)
        gain = np.append(self.force, np.zeros(points))
        volume = widened(self._volumes, variables.size)
        return ConicProgram(
            P=sp.csc_matrix((variables.size, variables.size)),
            q=np.concatenate([np.zeros(len(self.force)), ROOT * m.weight * m.threshold]),
            rows=(
                Rows(Term.GAIN, Cone.ZERO, sp.csr_matrix(gain), -np.ones(1)),
                Rows(Term.VOLUME, Cone.ZERO, volume, np.zeros(len(volume.indptr) - 1)),
                norm_rows(Term.YIELD, m.deviatoric, np.zeros((points, width)), variables.size, norms),
                *_dilatant(self.rows).cone_rows(variables.size, variables.size),
            ),
            blocks=variables.blocks,
        )


def isochoric(volumes: sp.csr_matrix) -> list[Floats]:
    """Orthonormal motions (n, k) for which the rows ``volumes`` (m, n) are zero; none if there are too many unknowns.

    Where elements lock the rows are dependent, and as equalities they would stall interior points. How nearly they are
    is not known: the bases are ever smaller, as ever more rows count as independent.
    """
    if volumes.get_shape()[1] > DENSE:
        return []
    factors: tuple[Floats, ...] = qr(volumes.toarray().T, pivoting=True)  # type: ignore[assignment]
    Q, size = factors[0], np.abs(np.diagonal(factors[1]))
    ranks = dict.fromkeys(int((size > part * size[0]).sum()) for part in DEPENDENT)
    return [Q[:, rank:] for rank in ranks]


def _combined(rows: ContactRows, motions: Floats) -> ContactRows:
    """The rows for coefficients (k,) of ``motions`` (n, k)."""
    return replace(rows, G_n=sp.csr_matrix(rows.G_n @ motions), G_t=sp.csr_matrix(rows.G_t @ motions))


def _dilatant(rows: ContactRows) -> ContactTerms:
    """G_n v >= mu |G_t v| at all contacts, and no motion of ties."""
    zeros = np.zeros(len(rows.frictional))
    return ContactTerms(_still(rows), threshold=zeros, shift=zeros)


def _still(rows: ContactRows) -> ContactRows:
    """The rows of a rate: closed contacts with resting tools."""
    return replace(rows, gap=np.zeros_like(rows.gap), slip=np.zeros_like(rows.slip))
