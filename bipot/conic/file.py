"""Named vectors in one npz file that says of what kind it is: read back to the last bit, pickled objects never."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.errors import BipotError

Arrays = Mapping[str, NDArray[Any]]

PARTS = ("data", "indices", "indptr")
"""Of a matrix by columns or by rows."""


class FileError(BipotError):
    """A file that does not hold what was asked of it; the message names the file and what is wrong."""


def write(path: str | Path, kind: str, arrays: Arrays) -> None:
    """Write ``arrays`` to the file of exactly that name, marked as of ``kind``."""
    fields: dict[str, Any] = {"kind": np.array(kind), **arrays}
    with Path(path).open("wb") as file:
        np.savez_compressed(file, **fields)


def read(
    path: str | Path, kind: str, fields: Mapping[str, str], together: Mapping[str, str] | None = None
) -> dict[str, NDArray[Any]]:
    """The vectors of a file of ``kind``, by name; ``fields`` it must have, those of ``together`` all or none.

    Both give the letter of numpy's kind of type ("f", "i", "U") by name.

    Raises:
        FileError: no such file, another kind of file, a vector that is missing, of another type or not finite.
    """
    try:
        with Path(path).open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            found = {name: np.asarray(file[name]) for name in file.files}
    except Exception as failure:
        # Damaged bytes make numpy, zipfile and zlib raise whatever they meet first.
        raise FileError(f"{path} cannot be read as a npz file without pickles: {failure}") from failure
    told = str(found.pop("kind", None))
    if told != kind:
        raise FileError(f"{path} is of kind {told:.60}: it must be {kind!r}")
    asked = {**fields, **(together or {})} if set(together or {}) & set(found) else fields
    for name, letter in asked.items():
        if name not in found:
            raise FileError(f"{path} has no {name!r}, which a {kind} has")
        vector = found[name]
        if vector.dtype.kind != letter or vector.ndim != 1:
            shape, dtype = vector.shape, vector.dtype
            raise FileError(f"{path}: {name!r} is of type {dtype} and shape {shape}, not a vector of kind {letter!r}")
        if letter == "f" and not np.isfinite(vector).all():
            raise FileError(f"{path}: {name!r} holds NaN or inf")
    return found


def compressed(name: str, matrix: sp.csc_matrix | sp.csr_matrix) -> dict[str, NDArray[Any]]:
    """The vectors of a matrix by columns or by rows, stored zeros included."""
    return {f"{name}_{part}": getattr(matrix, part) for part in PARTS}


def by_columns(arrays: Arrays, name: str, shape: tuple[int, int]) -> sp.csc_matrix:
    """The matrix of :func:`compressed`; raises ValueError where its vectors are those of no such matrix."""
    data, indices, indptr = (arrays[f"{name}_{part}"] for part in PARTS)
    matrix = sp.csc_matrix((data, indices, indptr), shape=shape)
    matrix.check_format(full_check=True)
    return matrix


def by_rows(arrays: Arrays, name: str, shape: tuple[int, int]) -> sp.csr_matrix:
    """As :func:`by_columns`, by rows."""
    transposed = by_columns(arrays, name, (shape[1], shape[0]))
    return sp.csr_matrix((transposed.data, transposed.indices, transposed.indptr), shape=shape)
