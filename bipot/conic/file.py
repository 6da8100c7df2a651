"""Named vectors in one npz file with a declared kind: read back to the last bit, without pickled objects."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.basics.replacing import replace
from bipot.conic.archive import Archive, opened_archive
from bipot.errors import BipotError

Arrays = Mapping[str, NDArray[Any]]

PARTS = ("data", "indices", "indptr")
"""The vectors of a matrix by columns or by rows."""


class FileError(BipotError):
    """A file without the expected contents; the message names the file and what is wrong."""


def write(path: str | Path, kind: str, arrays: Arrays) -> None:
    """Write ``arrays`` to the file of exactly that name, marked as of ``kind``, whole or not at all.

    Raises:
        FileError: it cannot be written.
    """
    fields: dict[str, Any] = {"kind": np.array(kind), **arrays}
    content = BytesIO()
    np.savez_compressed(content, **fields)
    replace(path, content.getbuffer(), FileError)


def read_vectors(
    path: str | Path,
    kind: str,
    fields: Mapping[str, str],
    together: Mapping[str, str],
    lengths: Mapping[str, tuple[str, int]],
) -> dict[str, NDArray[Any]]:
    """The vectors of a file of ``kind``, by name; ``fields`` it must have, those of ``together`` all or none.

    Both give the letter of numpy's kind of type ("f", "i", "U") by name. ``lengths`` names for some the vector of the
    same length, and by how much they are longer. Vectors that do not fit are not unpacked, and others are not read.

    Raises:
        FileError: no such file, another kind of file, a vector that is missing, of another type or not finite.
    """
    try:
        with opened_archive(Path(path)) as archive:
            found = _read(path, archive, kind, fields, together, lengths)
    except BipotError:
        raise
    except Exception as failure:
        # Damaged bytes make numpy, zipfile and zlib raise whatever they meet first.
        raise FileError(f"{path} cannot be read as a npz file without pickles: {failure!s:.300}") from failure
    for name, vector in found.items():
        if vector.dtype.kind == "f" and not np.isfinite(vector).all():
            place = int(np.flatnonzero(~np.isfinite(vector))[0])
            raise FileError(f"{path}: {name!r} holds NaN or inf: [{place}] = {vector[place]}")
    return found


def _read(
    path: str | Path,
    archive: Archive,
    kind: str,
    fields: Mapping[str, str],
    together: Mapping[str, str],
    lengths: Mapping[str, tuple[str, int]],
) -> dict[str, NDArray[Any]]:
    told = None
    if "kind" in archive and archive.declared("kind").shape == ():
        told = str(archive.array("kind"))
    if told != kind:
        raise FileError(f"{path} is of kind {told!s:.60}: it must be {kind!r}")
    asked = {**fields, **together} if any(name in archive for name in together) else fields
    found = {name: _length(path, archive, name, letter, kind) for name, letter in asked.items()}
    archive.require_small(list(asked))
    for name, (other, more) in lengths.items():
        if name in found and found[name] != found[other] + more:
            words = f"{name} has {found[name]} entries, must have {found[other] + more}, as {other} has {found[other]}"
            raise FileError(f"{path} holds vectors that do not fit together: {words}")
    return {name: archive.array(name) for name in asked}


def _length(path: str | Path, archive: Archive, name: str, letter: str, kind: str) -> int:
    """The length that a vector declares; refused unless it is a vector of that kind."""
    if name not in archive:
        raise FileError(f"{path} has no {name!r}, which a {kind} has")
    declared = archive.declared(name)
    if declared.dtype.kind != letter or len(declared.shape) != 1:
        words = f"of type {declared.dtype} and shape {declared.shape!s:.60}"
        raise FileError(f"{path}: {name!r} is {words}, not a vector of kind {letter!r}")
    return declared.shape[0]


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
