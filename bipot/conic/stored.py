"""A conic program read from a file written by :meth:`ConicProgram.save`, with its answer measured again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from bipot.basics.definite import asymmetry
from bipot.conic.file import Arrays, FileError, matrix_of, read_vectors
from bipot.conic.problem import KIND, Claim, Cone, ConicProgram, ConicSolution, Rows, Timing

FIELDS = {
    **dict.fromkeys(("P_data", "A_data", "q", "b"), "f"),
    **dict.fromkeys(("P_indices", "P_indptr", "A_indices", "A_indptr", "widths", "lengths", "starts", "stops"), "i"),
    **dict.fromkeys(("terms", "cones", "blocks"), "U"),
}
ANSWER = {**dict.fromkeys(("x", "z", "seconds", "optimum", "residuals"), "f"), "outcome": "U", "iterations": "i"}
"""Fields of an answer beside those of a program; the letters are numpy's kinds of type."""

LENGTHS = {
    **{f"{name}_indices": (f"{name}_data", 0) for name in "PA"},
    **{"P_indptr": ("q", 1), "A_indptr": ("b", 1), "x": ("q", 0), "z": ("b", 0)},
    **dict.fromkeys(("cones", "widths", "lengths"), ("terms", 0)),
    **dict.fromkeys(("starts", "stops"), ("blocks", 0)),
}
"""By name of a vector: another one, and by how many entries the first is longer."""

REPEATED = 1e-12
"""Difference of a (relative) residual between machines, and of P from its transpose: far below the accuracy asked of
solvers."""


def load(path: str | Path) -> tuple[ConicProgram, ConicSolution | None]:
    """The program of a file, which has no statement of its own, and the answer in it, None where there is none.

    Raises:
        FileError: the file was not written by :meth:`ConicProgram.save`, or the recomputed optimum and residuals of its
            answer are not the stored ones.
    """
    found = read_vectors(path, KIND, FIELDS, ANSWER, LENGTHS)
    try:
        program = _program(found)
        if "x" not in found:
            return program, None
        answer = _answer(program, found)
    except (ValueError, TypeError) as failure:
        raise FileError(f"{path} holds vectors that do not fit together: {failure}") from failure
    # Numbers of a foreign file may overflow; the residuals then differ from the stored ones.
    with np.errstate(over="ignore", invalid="ignore"):
        measures = {"optimum": [program.cost(answer.x)], "residuals": answer.residuals()}
    for name, measured in measures.items():
        stored = found[name]
        if len(stored) != len(measured) or not np.allclose(measured, stored, rtol=1e-6, atol=REPEATED):
            raise FileError(f"{path}: its answer has {name} {np.array(measured)}, stored is {stored}")
    return program, answer


def _program(found: Arrays) -> ConicProgram:
    """Raises ValueError where the vectors, of :data:`LENGTHS`, do not fit together otherwise."""
    q, b, widths, lengths = (found[name] for name in ("q", "b", "widths", "lengths"))
    terms, cones = found["terms"].tolist(), [Cone(word) for word in found["cones"].tolist()]
    _require(((lengths >= 0) & (lengths <= len(b))).all() and lengths.sum() == len(b), "lengths", lengths)
    _require((widths >= 1).all() and not (lengths % widths).any(), "widths", widths)
    _require(len(set(terms)) == len(terms), "terms", terms)
    starts, stops = found["starts"], found["stops"]
    _require((0 <= starts).all() and (starts <= stops).all(), "starts", starts)
    _require((stops <= len(q)).all(), "stops", stops)
    A = matrix_of(found, "A", sp.csr_matrix, (len(b), len(q)))
    ends = np.cumsum(lengths)
    rows = tuple(
        Rows(term, cone, sp.csr_matrix(A[end - length : end]), b[end - length : end], width)
        for term, cone, width, length, end in zip(
            terms, cones, widths.tolist(), lengths.tolist(), ends.tolist(), strict=True
        )
    )
    parts = map(slice, starts.tolist(), stops.tolist())
    blocks = dict(zip(found["blocks"].tolist(), parts, strict=True))
    _require(len(blocks) == len(starts), "blocks", found["blocks"])
    P = matrix_of(found, "P", sp.csc_matrix, (len(q), len(q)))
    if asymmetry(sp.csr_array(P)) > REPEATED:
        raise ValueError("P is not symmetric")
    return ConicProgram(P, q, rows, blocks)


def _answer(program: ConicProgram, found: Arrays) -> ConicSolution:
    """Raises ValueError where the claim, the iterations or the seconds are none."""
    (outcome,), (iterations,) = found["outcome"].tolist(), found["iterations"].tolist()
    dual, timing = program.split(found["z"]), Timing(*found["seconds"].tolist())
    return ConicSolution(program, found["x"], dual, Claim(outcome), iterations, timing)


def _require(fits: bool | np.bool_, name: str, value: object) -> None:
    if not fits:
        raise ValueError(f"{name} = {value!s:.80}")
