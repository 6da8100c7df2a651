"""The file that is being read: its name and limits, and the wording of refusals."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import RawIOBase
from typing import BinaryIO

from bipot.errors import BipotError, Refusal

LARGEST = 2**28
"""Bytes of the largest array that is read, 8 per number."""

INTEGERS = "iu"
"""Kinds of a count, signed or not, by NumPy's letters."""

SHOWN = 80
"""Largest number of characters of a value in a message."""


@dataclass(frozen=True)
class Source:
    """A file with its name in messages, its bytes, and the size, in bytes, of the largest array that is read.

    ``newest`` allows objects that are not plain (:mod:`bipot.hdf5.headers`).
    """

    path: str
    file: BinaryIO | RawIOBase
    size: int
    largest: int
    refuse: Refusal
    newest: bool

    def require(self, condition: bool, field: str, value: object, allowed: str) -> None:
        """Refuse the file by the name of the field, its value and what is allowed, unless ``condition``."""
        if not condition:
            shown = str(value)
            shown = shown if len(shown) <= SHOWN else shown[:SHOWN] + "..."
            raise self.refuse(f"{self.path}: {field} = {shown}: must be {allowed}")

    def bytes_at(self, place: int, length: int) -> bytes:
        """Some bytes of the file, refused where it ends before."""
        needed = f"at least {place + length}, or it is no HDF5 file, or one that was cut off"
        self.require(place + length <= self.size, "its size in bytes", self.size, needed)
        self.file.seek(place)
        return self.file.read(length) or b""

    @contextmanager
    def reading(self, field: str) -> Iterator[None]:
        """Errors inside are reported as this file's refusal, with the name of the field."""
        try:
            yield
        except BipotError:
            raise
        except Exception as failure:
            # Damaged bytes make h5py raise whatever it meets first.
            raise self.refuse(f"{self.path}: {field} cannot be read ({failure})") from failure
