r"""The data of a program, and a solution that measures itself.

A program in conic form is

    minimise  1/2 x' P x + q' x    subject to   A_i x + b_i in K_i,   i = 1 .. m,

with each ``A_i x + b_i`` a block of rows of one kind of cone. Optimality: ``P x + q = sum_i A_i' z_i`` with
``z_i`` in the dual cone and orthogonal to the rows, so the duals of gap and slip rows *are* the contact forces.

:meth:`ConicProgram.save` writes a program, with an answer if there is one, to a npz file of vectors for other solvers:
P by columns and all rows A by rows (``_data``, ``_indices``, ``_indptr``), q, b; for each block of rows its name
(``terms``), kind (``cones``, the values of :class:`Cone`), number of rows of one cone and of all (``widths``,
``lengths``); for each block of variables its name and slice (``blocks``, ``starts``, ``stops``). An answer adds x, the
duals z of all rows, what the solver claimed (``outcome``, ``iterations``, ``seconds``), ``optimum`` and ``residuals``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from bipot.conic.file import Arrays, compressed, write
from bipot.errors import is_whole, require, require_count, require_tuple, require_type
from bipot.typing import Floats, max_abs

KIND = "bipot conic program 1"
"""The declared kind of a file of :meth:`ConicProgram.save`."""


class Cone(Enum):
    """Kinds of cone; in SECOND_ORDER the first of each ``width`` rows bounds the norm of the others."""

    ZERO = "zero"
    NONNEGATIVE = "nonnegative"
    SECOND_ORDER = "second_order"


@dataclass
class Variables:
    """The named blocks of a program's variables, in the order in which they are added."""

    blocks: dict[str, slice] = field(default_factory=dict)
    size: int = 0

    def add(self, name: str, count: int) -> int:
        """Append ``count`` variables; returns the number of the first."""
        start, self.size = self.size, self.size + count
        self.blocks[name] = slice(start, self.size)
        return start


class Claim(Enum):
    """The solver's claim. ALMOST is recorded and re-checked, never silently taken for SOLVED."""

    SOLVED = "solved"
    ALMOST = "almost"


@dataclass(frozen=True, eq=False)
class Rows:
    """``A x + b`` in a product of equal cones of ``width`` rows each: A (m width, n), b (m width,).

    Cones other than SECOND_ORDER have one row: more would be measured as if the first bounded the others.

    Raises:
        SceneError: a wider cone of another kind, shapes that do not fit together.
    """

    term: str
    cone: Cone
    A: sp.csr_matrix
    b: Floats
    width: int = 1

    def __post_init__(self) -> None:
        require_type(self.term, str, "rows.term")
        require_type(self.cone, Cone, "rows.cone")
        require_count(self.width, "rows.width")
        _require_vector(self.b, "rows.b")
        require(sp.issparse(self.A), "rows.A", type(self.A).__name__, "a sparse matrix")
        count = len(self.b)
        require(self.A.shape[0] == count, "rows.A", f"of shape {self.A.shape}", f"of {count} rows, as rows.b")
        require(count % self.width == 0, "rows.b", f"of {count} numbers", f"of a multiple of {self.width}, the width")
        alone = self.cone is not Cone.SECOND_ORDER
        require(self.width == 1 or not alone, "width", self.width, f"1 in a {self.cone.value} cone")

    @property
    def count(self) -> int:
        """Number m of cones."""
        return len(self.b) // self.width

    def at(self, x: Floats) -> Floats:
        """A x + b (m width,)."""
        return self.A @ x + self.b


def _require_vector(value: object, field: str) -> None:
    right = isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fi"
    require(right, field, type(value).__name__, "an array of numbers with one axis")


def stacked(rows: Sequence[Rows], columns: int) -> tuple[sp.csr_matrix, Floats]:
    """(A, b) of blocks of rows, one below the other, with the entries that are stored."""
    A = sp.vstack([sp.csr_matrix((0, columns)), *(r.A for r in rows)], format="csr")
    return sp.csr_matrix(A), np.concatenate([np.zeros(0), *(r.b for r in rows)])


@dataclass(frozen=True, eq=False, repr=False)
class ConicProgram:
    """P (n, n) symmetric positive semidefinite, q (n,), cone rows, and the slices of the variable blocks.

    ``statement`` makes the same program stated in cvxpy, a :class:`bipot.conic.through_cvxpy.Stated`.

    Raises:
        SceneError: shapes that do not fit together, two blocks of rows of one term, which names their multipliers.
    """

    P: sp.csc_matrix
    q: Floats
    rows: tuple[Rows, ...]
    blocks: Mapping[str, slice]
    statement: Callable[[], Any] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        _require_vector(self.q, "program.q")
        n = len(self.q)
        shape = f"of shape {self.P.shape}" if sp.issparse(self.P) else type(self.P).__name__
        require(shape == f"of shape {(n, n)}", "program.P", shape, f"a sparse matrix of shape {(n, n)}, as program.q")
        object.__setattr__(self, "rows", require_tuple(self.rows, Rows, "program.rows"))
        terms = [rows.term for rows in self.rows]
        require(len(set(terms)) == len(terms), "program.rows", terms, "of a different term each")
        for rows in self.rows:
            shape, field = f"of shape {rows.A.shape}", f"program.rows, A of {rows.term}"
            require(rows.A.shape[1] == n, field, shape, f"of {n} columns, as program.q")
        require_type(self.blocks, Mapping, "program.blocks")
        for name, part in self.blocks.items():
            require_type(part, slice, field := f"program.blocks, {name}")
            whole = is_whole(part.start) and is_whole(part.stop) and part.step in (None, 1)
            fits = whole and 0 <= int(part.start) <= int(part.stop) <= n
            require(fits, field, part, f"a slice of whole numbers from 0 to {n}, as program.q")

    def __repr__(self) -> str:
        """One line, without the arrays."""
        rows = ", ".join(f"{rows.term} {len(rows.b)}" for rows in self.rows)
        return f"ConicProgram({len(self.q)} variables; rows of {rows or 'nothing'})"

    def cost(self, x: Floats) -> float:
        """1/2 x' P x + q' x."""
        return float(x @ (self.P @ x) / 2 + self.q @ x)

    def split(self, z: Floats) -> dict[str, Floats]:
        """The values z of all rows, one after another, by the rows' term: (m, width) each."""
        ends = np.cumsum([len(r.b) for r in self.rows])
        return {r.term: z[end - len(r.b) : end].reshape(-1, r.width) for r, end in zip(self.rows, ends, strict=True)}

    def save(self, path: str | Path, answer: ConicSolution | None = None) -> None:
        """Write the program, and an answer to it, for :func:`bipot.conic.stored.load` or any reader of npz files."""
        A, b = stacked(self.rows, len(self.q))
        rows, parts = self.rows, self.blocks.values()
        arrays = {
            **compressed("P", self.P),
            "q": self.q,
            **compressed("A", A),
            "b": b,
            "terms": np.array([str(r.term) for r in rows], dtype=np.str_),
            "cones": np.array([r.cone.value for r in rows], dtype=np.str_),
            "widths": np.array([r.width for r in rows], dtype=np.int64),
            "lengths": np.array([len(r.b) for r in rows], dtype=np.int64),
            "blocks": np.array([str(name) for name in self.blocks], dtype=np.str_),
            "starts": np.array([part.start for part in parts], dtype=np.int64),
            "stops": np.array([part.stop for part in parts], dtype=np.int64),
        }
        write(path, KIND, arrays if answer is None else {**arrays, **replace(answer, program=self).arrays()})


@dataclass(frozen=True)
class Timing:
    """Seconds spent stating (compiling, transferring) and solving a program, and on the body's part of it."""

    build: float = 0.0
    solve: float = 0.0
    assembly: float = 0.0

    def __add__(self, other: Timing) -> Timing:
        """Sum of each kind of seconds."""
        return Timing(self.build + other.build, self.solve + other.solve, self.assembly + other.assembly)


@dataclass(frozen=True, eq=False, repr=False)
class ConicSolution:
    """Primal x (n,), dual per term (m, width), and measures of both that are independent of the solver."""

    program: ConicProgram
    x: Floats
    dual: Mapping[str, Floats]
    outcome: Claim
    iterations: int
    timing: Timing

    def __repr__(self) -> str:
        """One line, without the arrays."""
        return f"ConicSolution({self.outcome.value} in {self.iterations} iterations: {self.program!r})"

    def block(self, block: str) -> Floats:
        """The variables of one named block."""
        return self.x[self.program.blocks[block]]

    def dual_residual(self) -> float:
        """max |P x + q - sum A' z|."""
        stationarity = self.program.P @ self.x + self.program.q
        for rows in self.program.rows:
            stationarity = stationarity - rows.A.T @ self.dual[rows.term].ravel()
        return max_abs(stationarity)

    def primal_residual(self) -> float:
        """Largest distance of a row block from its cone (componentwise excess)."""
        return max((excess(r, r.at(self.x).reshape(-1, r.width)) for r in self.program.rows), default=0.0)

    def duality_gap(self) -> float:
        """sum_i |z_i . (A_i x + b_i)|, zero at the optimum."""
        return sum((abs(float(self.dual[r.term].ravel() @ r.at(self.x))) for r in self.program.rows if r.count), 0.0)

    def dual_violation(self) -> float:
        """Largest distance of a multiplier from its dual cone, zero for equalities."""
        bounded = [r for r in self.program.rows if r.cone is not Cone.ZERO]
        return max((excess(r, self.dual[r.term]) for r in bounded), default=0.0)

    def residuals(self) -> Floats:
        """The four measures above, each over the size of the terms whose difference it is."""
        x, P, q = self.x, self.program.P, self.program.q
        gradient = max(max_abs(part) for part in (q, P @ x))
        offset = max((max_abs(r.b) for r in self.program.rows), default=0.0)
        terms = abs(float(x @ (P @ x))) + abs(float(q @ x))
        force = max((max_abs(z) for z in self.dual.values()), default=0.0)
        sizes = np.array([gradient, offset, terms, force])
        found = np.array([self.dual_residual(), self.primal_residual(), self.duality_gap(), self.dual_violation()])
        return found / np.where(sizes > 0, sizes, 1.0)

    def error(self) -> float:
        """The largest of the residuals."""
        return float(self.residuals().max())

    def arrays(self) -> Arrays:
        """The solution's arrays for a file (module docstring)."""
        duals = [self.dual[r.term].ravel() for r in self.program.rows]
        return {
            "x": self.x,
            "z": np.concatenate([np.zeros(0), *duals]),
            "outcome": np.array([self.outcome.value], dtype=np.str_),
            "iterations": np.array([self.iterations], dtype=np.int64),
            "seconds": np.array(astuple(self.timing)),
            "optimum": np.array([self.program.cost(self.x)]),
            "residuals": self.residuals(),
        }


def excess(rows: Rows, value: Floats) -> float:
    """Largest distance of values (m, width) from the rows' cone, measured on the first component."""
    if rows.count == 0:
        return 0.0
    if rows.cone is Cone.ZERO:
        return max_abs(value)
    inside = value[:, 0] - np.linalg.norm(value[:, 1:], axis=1)
    return float(np.maximum(-inside, 0).max())
