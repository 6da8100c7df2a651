"""Named vectors in one npz file with a declared kind: read back to the last bit, without pickled objects.

A file is not trusted: an archive declares the unpacked length of each member, and zipfile unpacks no more; each member
declares its array in a header. Both must agree, and the arrays must fit in memory, before the first number is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from math import prod
from pathlib import Path
from typing import Any, TypeVar
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

import numpy as np
import scipy.sparse as sp
from numpy.lib import format as npy
from numpy.typing import NDArray

from bipot.basics.replacing import replace
from bipot.errors import BipotError

Arrays = Mapping[str, NDArray[Any]]
Matrix = TypeVar("Matrix", sp.csc_matrix, sp.csr_matrix)

PARTS = ("data", "indices", "indptr")
"""The vectors of a matrix by columns or by rows."""

LARGEST = 2**30
"""Bytes of all members that are read of one file."""

LARGEST_DIRECTORY = 2**16
"""Bytes of an archive's directory, which zipfile reads whole: some hundred members."""

LONGEST_WORD = 1000
"""Characters of the longest word that is read."""

END, END_SIZE, LOCATOR, LOCATOR_SIZE = b"PK\x05\x06", 22, b"PK\x06\x07", 20
"""Signatures and sizes of the record that ends an archive, and of the one before it in archives beyond 4 GB."""


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
    replace(path, content.getvalue(), FileError)


def read_vectors(
    path: str | Path,
    kind: str,
    fields: Mapping[str, str],
    together: Mapping[str, str],
    lengths: Mapping[str, tuple[str, int]],
) -> dict[str, NDArray[Any]]:
    """The vectors of a file of ``kind``, by name; it must have all ``fields``, and all or none of ``together``.

    Both give the letter of numpy's kind of type ("f", "i", "U") by name. ``lengths`` gives by name another vector and
    by how much the named one is longer. Vectors that do not fit are not unpacked, and no others are read.

    Raises:
        FileError: no such file, another kind of file, a vector that is missing, of another type or not finite.
    """
    try:
        with opened_archive(Path(path)) as archive:
            known = "kind" in archive and archive.declared("kind")[1] == ()
            if (declared := str(archive.array("kind")) if known else None) != kind:
                raise FileError(f"{path} is of kind {declared!s:.60}: it must be {kind!r}")
            asked = {**fields, **together} if any(name in archive for name in together) else fields
            sizes = {name: _length(path, archive, name, letter, kind) for name, letter in asked.items()}
            total = sum(archive.file.getinfo(f"{name}.npy").file_size for name in asked)
            _require(total <= LARGEST, f"its vectors have {total} bytes: must have at most {LARGEST}")
            for name, (other, longer) in lengths.items():
                if name in sizes and sizes[name] != (due := sizes[other] + longer):
                    words = f"{name} has {sizes[name]} entries, must have {due}, as {other} has {sizes[other]}"
                    raise FileError(f"{path} holds vectors that do not fit together: {words}")
            found = {name: archive.array(name) for name in asked}
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


def _length(path: str | Path, archive: Archive, name: str, letter: str, kind: str) -> int:
    """The length that a vector declares; refused unless it is a vector of that kind."""
    if name not in archive:
        raise FileError(f"{path} has no {name!r}, which a {kind} has")
    dtype, shape = archive.declared(name)
    if dtype.kind != letter or len(shape) != 1:
        words = f"of type {dtype} and shape {shape!s:.60}"
        raise FileError(f"{path}: {name!r} is {words}, not a vector of kind {letter!r}")
    return shape[0]


def compressed(name: str, matrix: sp.csc_matrix | sp.csr_matrix) -> dict[str, NDArray[Any]]:
    """The vectors of a matrix by columns or by rows, stored zeros included."""
    return {f"{name}_{part}": getattr(matrix, part) for part in PARTS}


def matrix_of(arrays: Arrays, name: str, kind: type[Matrix], shape: tuple[int, int]) -> Matrix:
    """The matrix of :func:`compressed`; raises ValueError where its vectors are those of no such matrix."""
    data, indices, indptr = (arrays[f"{name}_{part}"] for part in PARTS)
    matrix = kind((data, indices, indptr), shape=shape)
    matrix.check_format(full_check=True)
    single = matrix.copy()
    single.sum_duplicates()
    if single.nnz < matrix.nnz:
        raise ValueError(f"{name} has an entry twice")
    return matrix


@dataclass(frozen=True)
class Archive:
    """The members of an opened npz file, by the names of its arrays. All methods raise BadZipFile or ValueError."""

    file: ZipFile

    def __contains__(self, name: str) -> bool:
        return f"{name}.npy" in self.file.NameToInfo

    def declared(self, name: str) -> tuple[np.dtype[Any], tuple[int, ...]]:
        """Type and shape of an array, refused unless its member is exactly as long as they need."""
        info = self.file.getinfo(f"{name}.npy")
        packed = info.compress_type in (ZIP_STORED, ZIP_DEFLATED)
        _require(packed, f"{name!r} is packed by method {info.compress_type}: must be deflated or stored")
        with self.file.open(info) as member:
            version = npy.read_magic(member)  # type: ignore[arg-type]
            _require(version == (1, 0), f"{name!r} has a header of version {version}: must be (1, 0)")
            shape, _, dtype = npy.read_array_header_1_0(member)  # type: ignore[arg-type]
            header = member.tell()
        number, word = dtype.kind in "fiu" and dtype.itemsize <= 8, dtype.kind == "U"
        known = number or (word and 0 < dtype.itemsize <= LONGEST_WORD * np.dtype("U1").itemsize)
        _require(known, f"{name!r} is of type {dtype}: must be one of numbers or short words")
        size = header + prod(shape) * dtype.itemsize
        whole = min(shape, default=0) >= 0 and size == info.file_size
        _require(whole, f"{name!r} of shape {shape} has {info.file_size} bytes: must have {size}")
        return dtype, shape

    def array(self, name: str) -> NDArray[Any]:
        """The array; :meth:`declared` has to have accepted its type and shape before."""
        with self.file.open(f"{name}.npy") as member:
            return npy.read_array(member, allow_pickle=False)  # type: ignore[arg-type]


@contextmanager
def opened_archive(path: Path) -> Iterator[Archive]:
    """The archive of a path, after a check that its directory is small."""
    # A pipe or a device would be waited for, or read without end.
    _require(path.is_file(), "it is no regular file" if path.exists() else "there is none")
    with path.open("rb") as file:
        size = file.seek(0, 2)
        start = min(size, END_SIZE + LOCATOR_SIZE)
        file.seek(-start, 2)
        tail = file.read(start)
        end = tail[-END_SIZE:]
        plain = len(end) == END_SIZE and end.startswith(END) and not tail.startswith(LOCATOR)
        _require(plain, "it does not end as an archive of up to 4 GB without a comment does")
        directory = int.from_bytes(end[12:16], "little")
        _require(
            directory <= LARGEST_DIRECTORY, f"its directory has {directory} bytes, not {LARGEST_DIRECTORY} at most"
        )
        with ZipFile(file) as archive:
            yield Archive(archive)


def _require(fits: bool, why: str) -> None:
    if not fits:
        raise BadZipFile(why)
