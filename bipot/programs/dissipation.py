r"""The increment with plastic strain as a variable: the ``dissipation`` program.

With e = e_0 + B dU the strain increment, d its elastic deviator and e_p = dev e - d the (trace-free) plastic strain,

    minimise  sum_q w [ p_0 tr e + K/2 (tr e)^2 + s_0 : d + G |d|^2 + sqrt(2/3) a |e_p| + H/3 |e_p|^2 ]
              - F . dU + sum_c s_c |G_t,c dU + w_t,c|     subject to   G_n dU + g >= 0,

one second-order cone a point. It is (21)-(22) with total stress sigma_0 = p_0 1 + s_0 and *no* return map, convex
and globally convergent for frozen threshold and configuration. a + H |e_p|_eq is the tangent line of sigma_Y at
the last pass, |e_p|_eq = sqrt(2/3) |e_p|, hence the factors. The elastic deviator is a variable of its own because
P is then diagonal on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import ConicProgram, Variables
from bipot.conic.through_cvxpy import Stated
from bipot.programs.data import Block, Term, Units
from bipot.programs.terms import ContactTerms, norm_rows
from bipot.typing import Floats

ROOT = np.sqrt(2.0 / 3.0)

BEYOND = 1e4
"""A yield stress above this, in the units of a program, cannot be reached: its value does not matter."""


@dataclass(frozen=True)
class PlasticModel:
    """Material data at g points, in coordinates of an orthonormal basis of the m trace-free tensors.

    ``volumetric`` (g, n) and ``deviatoric`` (g m, n) map dU to tr e and dev e; ``trace_0`` (g,) and ``deviator_0``
    (g, m) are their values at dU = 0; ``pressure`` (g,) and ``stress`` (g, m) the parts of sigma_0; ``weight`` (g,)
    volumes; ``threshold`` a (g,) and ``slope`` H (g,) the linearised yield stress; ``bulk``, ``shear`` moduli (g,). An
    infinite threshold stands for a material that does not flow; a body that flows nowhere has no cones.
    """

    volumetric: sp.csr_matrix
    deviatoric: sp.csr_matrix
    trace_0: Floats
    deviator_0: Floats
    pressure: Floats
    stress: Floats
    weight: Floats
    threshold: Floats
    slope: Floats
    bulk: Floats
    shear: Floats

    @property
    def flows(self) -> bool:
        """Whether plastic strain is a variable."""
        return bool(np.isfinite(self.threshold).any())

    def scaled(self, units: Units) -> PlasticModel:
        """Strains in ``units.strain``, stresses in ``units.stress``, volumes in ``units.volume``."""
        modulus = units.strain / units.stress
        return replace(
            self,
            volumetric=self.volumetric * units.size,
            deviatoric=self.deviatoric * units.size,
            trace_0=self.trace_0 / units.strain,
            deviator_0=self.deviator_0 / units.strain,
            pressure=self.pressure / units.stress,
            stress=self.stress / units.stress,
            weight=self.weight / units.volume,
            threshold=np.minimum(self.threshold / units.stress, BEYOND if self.flows else np.inf),
            slope=self.slope * modulus,
            bulk=self.bulk * modulus,
            shear=self.shear * modulus,
        )


@dataclass(frozen=True)
class DissipationProgram:
    """Material model, external force F (n,), contact with frozen threshold; stiffness (n,) of a ``spring``, or none."""

    model: PlasticModel
    force: Floats
    contact: ContactTerms
    spring: Floats | None = None

    def scaled(self, units: Units) -> DissipationProgram:
        """Dimensionless data."""
        spring = None if self.spring is None else self.spring * (units.length / units.force)
        return DissipationProgram(
            self.model.scaled(units), self.force / units.force, self.contact.scaled(units), spring
        )

    def conic(self) -> ConicProgram:
        """Variables (dU, d, t, slip bounds), P = diag(K_vol, 2 G w, 2/3 H w, 0); without flow dU and slip bounds."""
        m, variables, thresholds = self.model, Variables(), self.contact.threshold[self.contact.sliding]
        points, width = m.stress.shape
        weights, shear = np.repeat(m.weight, width), np.repeat(m.shear, width)
        variables.add(Block.DISPLACEMENT, len(self.force))
        stiffness, force = _quadratic(m.volumetric, m.weight, m.pressure, m.bulk, m.trace_0)
        diagonal = cost = np.zeros(0)
        if m.flows:
            variables.add(Block.ELASTIC_DEVIATOR, points * width)
            variables.add(Block.PLASTIC_NORM, points)
            diagonal = np.concatenate([2 * shear * weights, 2 / 3 * m.slope * m.weight])
            cost = np.concatenate([weights * m.stress.ravel(), ROOT * m.weight * m.threshold])
        else:
            sheared, slope = _quadratic(m.deviatoric, weights, m.stress.ravel(), 2 * shear, m.deviator_0.ravel())
            stiffness, force = sp.csc_matrix(stiffness + sheared), force + slope
        if self.spring is not None:
            stiffness = sp.csc_matrix(stiffness + sp.diags(self.spring))
        bounds = variables.add(Block.SLIP_BOUND, len(thresholds))
        rows = self.contact.cone_rows(variables.size, bounds)
        if m.flows:
            norms, elastic = (variables.blocks[name].start for name in (Block.PLASTIC_NORM, Block.ELASTIC_DEVIATOR))
            rows = (norm_rows(Term.YIELD, m.deviatoric, m.deviator_0, variables.size, norms, minus=elastic), *rows)
        return ConicProgram(
            P=_beside(stiffness, np.concatenate([diagonal, np.zeros(len(thresholds))])),
            q=np.concatenate([force - self.force, cost, thresholds]),
            rows=rows,
            blocks=variables.blocks,
            statement=self.statement,
        )

    def statement(self) -> Stated:
        """The same program stated in cvxpy."""
        import cvxpy as cp

        m = self.model
        dU = cp.Variable(len(self.force), name=Block.DISPLACEMENT)
        sliding, blocks, constraints = self.contact.statement(dU)
        volume_change = m.volumetric @ dU + m.trace_0
        deviator = cp.reshape(m.deviatoric @ dU, m.stress.shape, order="C") + m.deviator_0
        d = cp.Variable(m.stress.shape, name=Block.ELASTIC_DEVIATOR) if m.flows else deviator
        root = np.sqrt(m.weight)
        stored = (
            (m.weight * m.pressure) @ volume_change
            + cp.sum_squares(cp.multiply(root * np.sqrt(m.bulk / 2), volume_change))
            + cp.sum(cp.multiply(m.weight[:, None] * m.stress, d))
            + cp.sum_squares(cp.multiply((root * np.sqrt(m.shear))[:, None], d))
        )
        if self.spring is not None:
            stored += cp.sum_squares(cp.multiply(np.sqrt(self.spring), dU)) / 2
        cost = stored - self.force @ dU + sliding
        if m.flows:
            t = cp.Variable(len(m.weight), name=Block.PLASTIC_NORM)
            cost += ROOT * (m.weight * m.threshold) @ t + cp.sum_squares(cp.multiply(root * np.sqrt(m.slope / 3), t))
            blocks = {Block.ELASTIC_DEVIATOR: d, Block.PLASTIC_NORM: t, **blocks}
            constraints = {Term.YIELD: cp.SOC(t, deviator - d, axis=1), **constraints}
        return Stated(cp.Problem(cp.Minimize(cost), list(constraints.values())), blocks, constraints)


def _quadratic(
    B: sp.csr_matrix, weight: Floats, stress: Floats, modulus: Floats, start: Floats
) -> tuple[sp.csc_matrix, Floats]:
    """Second derivative (n, n) and slope (n,) at dU = 0 of sum w (stress e + modulus/2 e^2), e = start + B dU."""
    root = np.repeat(np.sqrt(modulus * weight), np.diff(B.indptr))
    weighted = sp.csr_matrix((root * B.data, B.indices, B.indptr), shape=B.shape)
    return sp.csc_matrix(weighted.T @ weighted), B.T @ (weight * (stress + modulus * start))


def _beside(block: sp.csc_matrix, diagonal: Floats) -> sp.csc_matrix:
    """diag(block, diagonal)."""
    n, number = len(block.indptr) - 1, np.arange(len(diagonal))
    data = np.concatenate([block.data, diagonal])
    indices = np.concatenate([block.indices, n + number])
    indptr = np.concatenate([block.indptr, block.nnz + 1 + number])
    return sp.csc_matrix((data, indices, indptr), shape=(n + len(diagonal), n + len(diagonal)))
