r"""The increment as a quadratic energy with exact contact at a frozen threshold: the ``tangent`` program.

    minimise    1/2 dU' K dU - f' dU + sum_c s_c |G_t,c dU + w_t,c|
    subject to  G_n dU + g >= 0

The proximal-Newton model of (21)-(25): K from C^ep at the current iterate, f the load that makes the model's
stationarity the increment's equilibrium. :meth:`TangentProgram.statement` is the cvxpy form to read;
:meth:`TangentProgram.conic` the same data for Clarabel directly; a test holds them equal.
"""

from __future__ import annotations

from dataclasses import dataclass

import cvxpy as cp
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.programs.data import Block, ConicProgram, ContactRows, Units
from bipot.programs.statement import ContactData, ContactStatement, Stated
from bipot.programs.terms import ContactTerms

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TangentProgram:
    """K (n, n) sparse or dense, f (n,), contact rows on dU with their frozen threshold s (f,)."""

    K: sp.csc_matrix | Floats
    f: Floats
    contact: ContactTerms

    @staticmethod
    def of(K: sp.csc_matrix | Floats, f: Floats, rows: ContactRows, threshold: Floats) -> TangentProgram:
        """The program from its physical data."""
        return TangentProgram(K, f, ContactTerms(rows, threshold))

    def scaled(self, units: Units) -> TangentProgram:
        """Dimensionless: displacements in ``units.length``, forces in ``units.force``."""
        return TangentProgram(
            self.K * (units.length / units.force),
            self.f / units.force,
            self.contact.scaled(units),
        )

    def conic(self) -> ConicProgram:
        """Variables (dU, t): P = diag(K, 0), q = (-f, s), rows of :class:`ContactTerms`."""
        n = len(self.f)
        cost = self.contact.threshold[self.contact.sliding]
        P = _padded(self.K, n + len(cost))
        blocks = {Block.DISPLACEMENT: slice(0, n), Block.SLIP_BOUND: slice(n, n + len(cost))}
        return ConicProgram(P, np.concatenate([-self.f, cost]), self.contact.cone_rows(n + len(cost), n), blocks)

    def statement(self) -> Stated:
        """The same program as one writes it."""
        dU = cp.Variable(len(self.f))
        contact = ContactStatement.of(dU, self.contact, ContactData.of(self.contact))
        energy = cp.quad_form(dU, cp.psd_wrap(self.K)) / 2 - self.f @ dU
        return Stated(cp.Problem(cp.Minimize(energy + contact.cost), contact.constraints), dU, contact)


def _padded(K: sp.csc_matrix | Floats, size: int) -> sp.csc_matrix:
    """diag(K, 0) (size, size); a dense K keeps its zeros, so that its pattern does not depend on its values."""
    if not isinstance(K, np.ndarray):
        P = sp.csc_matrix(K)
        P.resize((size, size))
        return P
    n = len(K)
    ends = np.minimum(np.arange(size + 1), n) * n
    return sp.csc_matrix((K.ravel(order="F"), np.tile(np.arange(n), n), ends), shape=(size, size))


@dataclass(frozen=True)
class CompiledTangent:
    """The dense tangent program of one structure, compiled once: K enters by a square root L' L = K.

    quad_form with a parameter is outside cvxpy's disciplined parametrised rules; |L dU|^2 is inside.
    """

    stated: Stated
    factor: cp.Parameter
    load: cp.Parameter
    data: ContactData

    @staticmethod
    def of(program: TangentProgram) -> CompiledTangent:
        """Compile for the structure (sizes, sliding set, operators) of ``program``."""
        n = len(program.f)
        dU, factor, load = cp.Variable(n), cp.Parameter((n, n)), cp.Parameter(n)
        data = ContactData.parameters(program.contact)
        contact = ContactStatement.of(dU, program.contact, data)
        energy = cp.sum_squares(factor @ dU) / 2 - load @ dU
        problem = cp.Problem(cp.Minimize(energy + contact.cost), contact.constraints)
        return CompiledTangent(Stated(problem, dU, contact), factor, load, data)

    def assign(self, program: TangentProgram) -> Stated:
        """Give the parameters the numbers of ``program``, which must have the compiled structure."""
        self.factor.value = square_root(np.asarray(program.K))
        self.load.value = program.f
        self.data.assign(program.contact)
        return self.stated


def square_root(K: Floats) -> Floats:
    """L with L' L = K. By eigenvalues: in homogeneous perfect flow K is singular, and Cholesky would refuse it."""
    values, vectors = np.linalg.eigh(K)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def structure(program: TangentProgram) -> bytes:
    """A key that is equal for two programs exactly when one compilation serves both."""
    contact = program.contact
    operators = (contact.rows.G_n, contact.rows.G_t, contact.shifted_rows()[2])
    parts = [a for G in operators for a in (np.array(G.shape), G.indptr, G.indices, G.data)]
    return b"".join(
        np.ascontiguousarray(a).tobytes() for a in (*parts, contact.rows.tied, contact.sliding, contact.coned)
    )
