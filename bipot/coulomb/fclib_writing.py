"""Writer of FCLIB files, in the layout that :mod:`bipot.coulomb.fclib` reads and describes."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from bipot.basics.replacing import replace
from bipot.coulomb.fclib import GLOBAL, LARGEST_INDEX, LOCAL, ROWS, SOLUTION, FclibError, solution_lengths
from bipot.coulomb.problem import CoulombProblem, GlobalCoulombProblem, column_count, require_problem
from bipot.errors import require_path, require_type
from bipot.typing import Floats, as_numbers

if TYPE_CHECKING:
    import h5py


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


def _write_info(parent: h5py.Group, title: str, description: str) -> None:
    info = parent.create_group("info")
    for key, text in {"title": title, "description": description, "math_info": ""}.items():
        info.create_dataset(key, data=np.bytes_(text.encode("ascii", "replace")))


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
        SceneError: no path, no problem, a title or description that is no string, or a solution that is no mapping of
            numbers.
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
        _write_info(group, title, description)
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
    replace(path, content.getbuffer(), FclibError)
