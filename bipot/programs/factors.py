"""Factorisation of the sparse systems of Newton's method: scipy's SuperLU, or MKL's Pardiso where it is installed."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from bipot.errors import ProgramError, require
from bipot.typing import Floats

SYMMETRIC = {"SymmetricMode": True}
"""SuperLU's mode for a symmetric pattern, which prefers the diagonal pivots for which the order was made."""

PIVOT = 1e-2
"""Part of a column's largest entry above which the diagonal is the pivot, which preserves the ordering's fill."""

RELAX = 4
"""Columns at the leaves that SuperLU merges: faster than its default on the small supernodes of a mesh."""

SINGULAR = "the Newton matrix is singular: the body can move without resistance"

PERTURBED = 14
"""Index of Pardiso's number of replaced pivots."""


class Factor(Protocol):
    """Factors of a matrix A (n, n)."""

    def solve(self, b: Floats) -> Floats:
        """x (n,) with A x = b."""
        ...


@runtime_checkable
class LinearSolver(Protocol):
    """Factorises matrices that are in an order of elimination."""

    def factorise(self, transpose: sp.csc_matrix, panel: int) -> Factor:
        """Factors of A, whose transpose is given by columns; ``panel`` columns may be processed at once.

        Raises:
            ProgramError: A is singular.
        """
        ...


@dataclass(frozen=True)
class SuperLUFactor:
    """Factors of the transpose."""

    lu: sla.SuperLU

    def solve(self, b: Floats) -> Floats:
        """See :class:`Factor`."""
        return self.lu.solve(b, "T")


@dataclass(frozen=True)
class SuperLU:
    """``scipy.sparse.linalg.splu`` in the given order."""

    def factorise(self, transpose: sp.csc_matrix, panel: int) -> SuperLUFactor:
        """See :class:`LinearSolver`."""
        settings = {"diag_pivot_thresh": PIVOT, "relax": RELAX, "panel_size": panel, "options": SYMMETRIC}
        try:
            return SuperLUFactor(sla.splu(transpose, permc_spec="NATURAL", **settings))
        except RuntimeError as singular:
            raise ProgramError(SINGULAR) from singular


DEFAULT = SuperLU()


@dataclass(frozen=True)
class PardisoFactor:
    """Factors that MKL keeps, and the matrix (n, n) by rows for its refinement of answers."""

    solver: Any
    matrix: sp.csr_matrix

    def solve(self, b: Floats) -> Floats:
        """See :class:`Factor`."""
        return np.asarray(self.solver.solve(self.matrix, b), dtype=np.float64)


@dataclass(frozen=True)
class Pardiso:
    """MKL's Pardiso by ``pypardiso``, in an order of its own: for large bodies in space, on x86 processors.

    MKL is free of charge but not free software; it is an optional extra, ``pip install 'bipot[pardiso]'``.

    Raises:
        SceneError: the package ``pypardiso`` is not installed.
    """

    def __post_init__(self) -> None:
        require(find_spec("pypardiso") is not None, "linear", "pardiso", "installed: pip install pypardiso")

    def factorise(self, transpose: sp.csc_matrix, panel: int) -> PardisoFactor:
        """See :class:`LinearSolver`; the panel is SuperLU's."""
        import pypardiso  # pyright: ignore[reportMissingImports] (an extra that the suite does without)

        solver, matrix = pypardiso.PyPardisoSolver(), sp.csr_matrix(transpose.T)
        try:
            solver.factorize(matrix)
        except (ValueError, pypardiso.pardiso_wrapper.PyPardisoError) as singular:
            raise ProgramError(SINGULAR) from singular
        # Pardiso continues with another pivot where one is zero to round-off.
        if solver.get_iparm(PERTURBED):
            solver.free_memory(everything=True)
            raise ProgramError(SINGULAR)
        found = PardisoFactor(solver, matrix)
        weakref.finalize(found, solver.free_memory, everything=True)
        return found
