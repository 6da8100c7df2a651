"""Reader and writer of FCLIB files, the HDF5 layout in which this community exchanges frictional problems.

A file holds either `/fclib_local` (W, q) or `/fclib_global` (M, H, f, w), with `spacedim`, `vectors/mu` and
`info`; optionally `/solution` and `/guesses` with u, r (and v). A matrix group has m, n, nz, nzmax, p, i, x:
nz >= 0 marks triplets (i rows, p columns, the first nz count, duplicates add), -1 compressed columns, -2
compressed rows. Files are not trusted: everything is checked before use (:mod:`bipot.hdf5.checked`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from bipot.basics.replacing import replace
from bipot.coulomb.problem import CoulombProblem, GlobalCoulombProblem, column_count, require_problem
from bipot.errors import BipotError, SceneError, require_count, require_path, require_type
from bipot.hdf5.isolated import isolated as run_isolated
from bipot.hdf5.source import INTEGERS, LARGEST
from bipot.typing import Floats, as_numbers

if TYPE_CHECKING:
    import h5py

    from bipot.hdf5.checked import Checked

NUMBERS = "fiu"
"""Kinds that stand for real numbers: FCLIB's own reader converts integers as well."""

LARGEST_INDEX = np.iinfo(np.int32).max
"""FCLIB's indices and counts are C ints."""

LOCAL, GLOBAL, SOLUTION = "fclib_local", "fclib_global", "solution"
"""Names of the groups that hold a problem in its reduced or its global form, and its solution."""

COLUMNS, ROWS = -1, -2
"""Values of nz for compressed columns and compressed rows; any nz >= 0 is the number of triplets."""


class FclibError(BipotError):
    """A file that does not hold a frictional contact problem in the FCLIB layout."""


def _read_matrix(parent: Checked, name: str, rows: int, cols: int) -> sparse.csr_array:
    """The matrix of that name, which must be ``rows`` by ``cols``."""
    group = parent.group(name)
    group.integer("m", rows, rows)
    group.integer("n", cols, cols)
    nz = group.integer("nz", min(COLUMNS, ROWS))
    if nz >= 0:
        x, (i, p) = _entries(group, nz, {"i": rows, "p": cols})
        return sparse.csr_array(sparse.coo_array((x, (i, p)), shape=(rows, cols)))
    by_rows = nz == ROWS
    lines, across = (rows, cols) if by_rows else (cols, rows)
    p = _pointers(group, lines)
    x, (i,) = _entries(group, int(p[-1]), {"i": across})
    return sparse.csr_array((sparse.csr_array if by_rows else sparse.csc_array)((x, i, p), shape=(rows, cols)))


def _entries(group: Checked, count: int, sizes: Mapping[str, int]) -> tuple[Floats, list[NDArray[np.int32]]]:
    """The first ``count`` of x, and of the indices of these names below their sizes.

    There may be more, up to nzmax, which do not count and are not read.
    """
    room = group.integer("nzmax", count)
    for name in ("x", *sizes):
        length = group.length(name)
        group.require(length <= room, f"{name}: its length", length, f"at most nzmax = {room}")
    x = group.rows("x", NUMBERS, 0, count, ())
    bounds = {name: min(size - 1, LARGEST_INDEX) for name, size in sizes.items()}
    indices = [group.rows(name, INTEGERS, 0, count, (), least=0, most=most) for name, most in bounds.items()]
    return x, [each.astype(np.int32) for each in indices]


def _pointers(group: Checked, lines: int) -> NDArray[np.int32]:
    """Where each of the ``lines`` starts, and where the last ends."""
    p = group.array("p", INTEGERS, (lines + 1,), least=0, most=LARGEST_INDEX).astype(np.int32)
    group.require(p[0] == 0, "p[0]", p[0], "0")
    falls = np.flatnonzero(np.diff(p) < 0)
    if falls.size:
        k = int(falls[0])
        group.require(False, f"p[{k + 1}]", p[k + 1], f"at least p[{k}] = {p[k]}")
    return p


def _form(file: Checked) -> str:
    for form in (LOCAL, GLOBAL):
        if form in file:
            return form
    raise FclibError(f"{file.source.path} holds neither /{LOCAL} nor /{GLOBAL}: it is not an FCLIB problem")


def read_fclib(
    path: str | Path, *, largest: int = LARGEST, isolated: bool = False
) -> CoulombProblem | GlobalCoulombProblem:
    """The problem of a file in its stored form; ``largest`` is the largest size of one array, in bytes.

    ``reduced(read_fclib(path))`` is the reduced form of either. ``isolated`` reads it in a process of its own, and then
    in HDF5's newer forms, too, which can be crafted to end the process (:mod:`bipot.hdf5.headers`).

    Raises:
        FclibError: any other layout, or a number that no problem can have; names the file, the field and its value.
    """
    require_path(path)
    require_count(largest, "largest")
    require_type(isolated, bool, "isolated")
    if isolated:
        # Made anew, because what comes from another process may be written to.
        return dataclasses.replace(run_isolated(f"{__name__}:read_problem", path, FclibError, largest=largest))
    return read_problem(path, largest, newest=False)


def read_problem(path: str | Path, largest: int, newest: bool = True) -> CoulombProblem | GlobalCoulombProblem:
    """As :func:`read_fclib`, in this process, where ``newest`` also of HDF5's newer forms."""
    from bipot.hdf5.checked import opened

    with opened(path, FclibError, largest, newest=newest) as file:
        group = file.group(_form(file))
        dim, vectors = group.integer("spacedim", 2, 3), group.group("vectors")
        try:
            return (_local if group.name == f"/{LOCAL}" else _global)(group, vectors, dim)
        except SceneError as failure:
            raise FclibError(f"{path}: {group.name}: {failure}") from failure


def _local(group: Checked, vectors: Checked, dim: int) -> CoulombProblem:
    # By increasing size, with lengths compared to known ones: excessive declarations are refused in time.
    rows = vectors.length("q")
    mu = _friction(vectors, "q", rows, dim)
    return CoulombProblem(_read_matrix(group, "W", rows, rows), vectors.array("q", NUMBERS, (rows,)), mu, dim)


def _global(group: Checked, vectors: Checked, dim: int) -> GlobalCoulombProblem:
    if "G" in group:
        raise FclibError(f"{group.source.path} has bilateral constraints (G): eliminate them before exporting")
    dofs, rows = vectors.length("f"), vectors.length("w")
    mu = _friction(vectors, "w", rows, dim)
    M, H = _read_matrix(group, "M", dofs, dofs), _read_matrix(group, "H", dofs, rows)
    f, w = vectors.array("f", NUMBERS, (dofs,)), vectors.array("w", NUMBERS, (rows,))
    return GlobalCoulombProblem(M, H, f, w, mu, dim)


def _friction(vectors: Checked, name: str, rows: int, dim: int) -> Floats:
    """One coefficient a contact, of which the vector of that name has ``dim`` rows each."""
    fits = rows > 0 and rows % dim == 0
    vectors.require(fits, f"{name}: its length", rows, f"a positive multiple of spacedim = {dim}")
    return vectors.array("mu", NUMBERS, (rows // dim,), least=0)


def reduced(problem: CoulombProblem | GlobalCoulombProblem) -> CoulombProblem:
    """The reduced form of either form."""
    require_problem(problem)
    return problem.reduced() if isinstance(problem, GlobalCoulombProblem) else problem


def read_solution(path: str | Path, *, largest: int = LARGEST) -> dict[str, Floats]:
    """Vectors u, r (perhaps v) of `/solution`, without those that were only declared; empty when the file has none.

    Raises:
        FclibError: no file of this layout, or vectors that are not of the length of its problem, or not finite.
    """
    from bipot.hdf5.checked import opened

    require_path(path)
    require_count(largest, "largest")
    with opened(path, FclibError, largest) as file:
        form = _form(file)
        if SOLUTION not in file:
            return {}
        group, vectors = file.group(SOLUTION), file.group(f"{form}/vectors")
        local = form == LOCAL
        lengths = solution_lengths(vectors.length("q" if local else "w"), None if local else vectors.length("f"))
        there = {name: length for name, length in lengths.items() if name in group and group.stored(name)}
        return {name: group.array(name, NUMBERS, (length,)) for name, length in there.items()}


def solution_lengths(rows: int, dofs: int | None) -> dict[str, int | None]:
    """Lengths of the vectors of `/solution`, None for any length: a reduced problem does not know its bodies."""
    return {"u": rows, "r": rows, "v": dofs}


def _write_matrix(parent: h5py.Group, name: str, matrix: sparse.csr_array) -> None:
    group = parent.create_group(name)
    integers = {"nzmax": matrix.nnz, "m": matrix.indptr.size - 1, "n": column_count(matrix), "nz": ROWS}
    most = max(integers.values())
    if most > LARGEST_INDEX:
        raise FclibError(
            f"{name} has {most} rows, columns or entries: must be at most {LARGEST_INDEX} in an FCLIB file"
        )
    for key, value in integers.items():
        group.create_dataset(key, data=np.array([value], dtype=np.int32))
    group.create_dataset("p", data=matrix.indptr.astype(np.int32))
    group.create_dataset("i", data=matrix.indices.astype(np.int32))
    group.create_dataset("x", data=matrix.data)


def _write_solution(file: h5py.File, solution: Mapping[str, Floats], lengths: Mapping[str, int | None]) -> None:
    group = file.create_group(SOLUTION)
    for key, given in solution.items():
        vector = as_numbers(given, f"solution[{key!r}]")
        fits = key in lengths and vector.ndim == 1 and lengths[key] in (None, vector.size)
        if not fits or not np.isfinite(vector).all():
            words = f"of {', '.join(lengths)}, finite and of the length of the problem"
            raise FclibError(f"solution[{key!r}] of shape {vector.shape}: must be one {words}")
        group.create_dataset(key, data=vector)


def write_fclib(
    path: str | Path,
    problem: CoulombProblem | GlobalCoulombProblem,
    *,
    title: str = "frictional contact problem",
    description: str = "",
    solution: Mapping[str, Floats] | None = None,
) -> None:
    """Write the problem as it stands, reduced or global, matrices by compressed rows.

    An old file is replaced when the new one is whole. ``solution`` may hold u, r (and v), stored in `/solution`. Of the
    ``title`` and the ``description`` only ASCII is kept exactly.

    Raises:
        FclibError: the file cannot be written, or the problem is larger than such a file can hold.
    """
    import h5py

    require_path(path)
    require_problem(problem)
    require_type(title, str, "title")
    require_type(description, str, "description")
    require_type(solution, Mapping, "solution", optional=True)
    content = BytesIO()
    with h5py.File(content, "w") as file:
        group = file.create_group(LOCAL if isinstance(problem, CoulombProblem) else GLOBAL)
        group.create_dataset("spacedim", data=np.array([problem.dim], dtype=np.int32))
        info = group.create_group("info")
        for key, text in {"title": title, "description": description, "math_info": ""}.items():
            info.create_dataset(key, data=np.bytes_(text.encode("ascii", "replace")))
        vectors = group.create_group("vectors")
        vectors.create_dataset("mu", data=problem.mu)
        dofs = None
        if isinstance(problem, CoulombProblem):
            _write_matrix(group, "W", problem.W)
            vectors.create_dataset("q", data=problem.q)
        else:
            dofs = problem.f.size
            _write_matrix(group, "M", problem.M)
            _write_matrix(group, "H", problem.H)
            vectors.create_dataset("f", data=problem.f)
            vectors.create_dataset("w", data=problem.w)
        if solution is not None:
            _write_solution(file, solution, solution_lengths(problem.mu.size * problem.dim, dofs))
    replace(path, content.getvalue(), FclibError)
