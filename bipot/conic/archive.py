"""Vectors of an untrusted npz file: its declarations are checked before anything is unpacked.

An archive declares the unpacked length of each member, and zipfile unpacks no more; each member declares its array in a
header. Both must agree, and the arrays must fit in memory, before the first number is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

LARGEST = 2**30
"""Bytes of all members that are read of one file."""

LARGEST_DIRECTORY = 2**16
"""Bytes of an archive's directory, which zipfile reads whole: some hundred members."""

LONGEST_WORD = 1000
"""Characters."""

END, END_SIZE, LOCATOR, LOCATOR_SIZE = b"PK\x05\x06", 22, b"PK\x06\x07", 20
"""Signatures and sizes of the record that ends an archive, and of that of archives beyond 4 GB before it."""


@dataclass(frozen=True)
class Declared:
    """The declaration of a member."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]


@dataclass(frozen=True)
class Archive:
    """The members of an opened npz file, by the names of its arrays. All methods raise BadZipFile or ValueError."""

    file: ZipFile

    def __contains__(self, name: str) -> bool:
        return f"{name}.npy" in self.file.NameToInfo

    def declared(self, name: str) -> Declared:
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
        return Declared(dtype, shape)

    def require_small(self, names: list[str]) -> None:
        """Refuse more than LARGEST in all."""
        total = sum(self.file.getinfo(f"{name}.npy").file_size for name in names)
        _require(total <= LARGEST, f"its vectors have {total} bytes: must have at most {LARGEST}")

    def array(self, name: str) -> NDArray[Any]:
        """The array, to be read where it is of a declared type and shape."""
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
