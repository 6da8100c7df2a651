"""Reader and writer of FCLIB files, the HDF5 layout in which this community exchanges frictional problems.

A file holds either `/fclib_local` (W, q) or `/fclib_global` (M, H, f, w), with `spacedim`, `vectors/mu` and
`info`; optionally `/solution` and `/guesses` with u, r (and v). A matrix group has m, n, nz, nzmax, p, i, x:
nz >= 0 marks triplets (i rows, p columns, the first nz count, duplicates add), -1 compressed columns, -2
compressed rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from bipot.coulomb.problem import CoulombProblem, GlobalCoulombProblem, columns
from bipot.errors import BipotError
from bipot.tensors import FloatArray

if TYPE_CHECKING:
    import h5py


class FclibError(BipotError):
    """A file that does not hold a frictional contact problem in the FCLIB layout."""


class _Form(StrEnum):
    LOCAL = "fclib_local"
    GLOBAL = "fclib_global"


class _Storage(IntEnum):
    """Negative values of nz; any nz >= 0 is the number of triplets."""

    COLUMNS = -1
    ROWS = -2


def _read_matrix(group: h5py.Group) -> sparse.csr_array:
    m, n, nz = (int(np.ravel(group[key][()])[0]) for key in ("m", "n", "nz"))  # type: ignore[index]
    p, i, x = (np.asarray(group[key][()]) for key in ("p", "i", "x"))  # type: ignore[index]
    if nz >= 0:
        return sparse.csr_array(sparse.coo_array((x[:nz], (i[:nz], p[:nz])), shape=(m, n)))
    filled = int(p[-1])
    if nz == _Storage.COLUMNS:
        return sparse.csr_array(sparse.csc_array((x[:filled], i[:filled], p), shape=(m, n)))
    if nz == _Storage.ROWS:
        return sparse.csr_array((x[:filled], i[:filled], p), shape=(m, n))
    raise FclibError(f"matrix {group.name} has nz = {nz}: it must be >= 0 (triplets), -1 or -2")


def _vector(group: h5py.Group, key: str) -> FloatArray:
    return np.asarray(group[key][()], dtype=np.float64).ravel()  # type: ignore[index]


def _form(file: h5py.File, path: Path) -> _Form:
    for form in _Form:
        if form in file:
            return form
    raise FclibError(f"{path} holds neither /{_Form.LOCAL} nor /{_Form.GLOBAL}: it is not an FCLIB problem")


@contextmanager
def _opened(path: str | Path) -> Iterator[h5py.File]:
    """The file for reading; what it lacks is said as an FclibError."""
    # h5py takes long to import, and only files need it.
    import h5py

    try:
        with h5py.File(path, "r") as file:
            yield file
    except BipotError:
        raise
    except (KeyError, OSError, TypeError, ValueError, IndexError) as failure:
        raise FclibError(f"{path} is not a readable FCLIB file: {failure}") from failure


def read_fclib(path: str | Path) -> CoulombProblem | GlobalCoulombProblem:
    """The problem of a file, in the form it is stored in. Raises FclibError on any other layout.

    ``reduced(read_fclib(path))`` is the reduced form of either.
    """
    with _opened(path) as file:
        form = _form(file, Path(path))
        group: Any = file[form]
        vectors, dim = group["vectors"], int(np.ravel(group["spacedim"][()])[0])
        mu = _vector(vectors, "mu")
        if form is _Form.LOCAL:
            return CoulombProblem(_read_matrix(group["W"]), _vector(vectors, "q"), mu, dim)
        if "G" in group:
            raise FclibError(f"{path} has bilateral constraints (G): eliminate them before exporting")
        M, H = _read_matrix(group["M"]), _read_matrix(group["H"])
        return GlobalCoulombProblem(M, H, _vector(vectors, "f"), _vector(vectors, "w"), mu, dim)


def reduced(problem: CoulombProblem | GlobalCoulombProblem) -> CoulombProblem:
    """The reduced form of either form."""
    return problem.reduced() if isinstance(problem, GlobalCoulombProblem) else problem


def read_solution(path: str | Path) -> dict[str, FloatArray]:
    """Vectors of `/solution` (u, r, perhaps v), empty when the file has none. Raises FclibError where it is no file
    of this layout."""
    with _opened(path) as file:
        if "solution" not in file:
            return {}
        group: Any = file["solution"]
        return {key: _vector(group, key) for key in group}


def _write_matrix(parent: h5py.Group, name: str, matrix: sparse.csr_array) -> None:
    group = parent.create_group(name)
    integers = {
        "nzmax": matrix.nnz,
        "m": matrix.indptr.size - 1,
        "n": columns(matrix),
        "nz": int(_Storage.ROWS),
    }
    for key, value in integers.items():
        group.create_dataset(key, data=np.array([value], dtype=np.int32))
    group.create_dataset("p", data=matrix.indptr.astype(np.int32))
    group.create_dataset("i", data=matrix.indices.astype(np.int32))
    group.create_dataset("x", data=matrix.data)


def _write_info(parent: h5py.Group, title: str, description: str) -> None:
    info = parent.create_group("info")
    for key, text in {"title": title, "description": description, "math_info": ""}.items():
        info.create_dataset(key, data=np.bytes_(text.encode("ascii", "replace")))


def write_fclib(
    path: str | Path,
    problem: CoulombProblem | GlobalCoulombProblem,
    *,
    title: str = "frictional contact problem",
    description: str = "",
    solution: Mapping[str, FloatArray] | None = None,
) -> None:
    """Write the problem as it stands (reduced or global), matrices by compressed rows; an old file is
    replaced.

    ``solution`` may hold u, r (and v), stored in `/solution`. Only ASCII text is kept exactly.
    """
    import h5py

    with h5py.File(path, "w") as file:
        local = isinstance(problem, CoulombProblem)
        group = file.create_group(_Form.LOCAL if local else _Form.GLOBAL)
        group.create_dataset("spacedim", data=np.array([problem.dim], dtype=np.int32))
        _write_info(group, title, description)
        vectors = group.create_group("vectors")
        vectors.create_dataset("mu", data=problem.mu)
        if isinstance(problem, CoulombProblem):
            _write_matrix(group, "W", problem.W)
            vectors.create_dataset("q", data=problem.q)
        else:
            _write_matrix(group, "M", problem.M)
            _write_matrix(group, "H", problem.H)
            vectors.create_dataset("f", data=problem.f)
            vectors.create_dataset("w", data=problem.w)
        if solution is not None:
            answers = file.create_group("solution")
            for key, vector in solution.items():
                answers.create_dataset(key, data=np.asarray(vector, dtype=np.float64))
