"""The file that is being read: what messages and limits need to know of it, and how its refusals are worded."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import RawIOBase
from typing import BinaryIO

from bipot.errors import BipotError

Refusal = Callable[[str], BipotError]
"""Makes the error of a message."""

SHOWN = 80
"""Characters of a value that a message shows: a file can hold any."""


@dataclass(frozen=True)
class Source:
    """A file by its name in messages, its bytes, and the largest array, in bytes, that is taken from it.

    ``newest`` tells that objects are opened that are not plain (:mod:`bipot.hdf5.headers`).
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
        self.require(place + length <= self.size, "end of what it tells", place + length, f"at most {self.size}")
        self.file.seek(place)
        return self.file.read(length) or b""

    @contextmanager
    def reading(self, field: str) -> Iterator[None]:
        """Whatever is met inside is said as this file's refusal, with the name of the field."""
        try:
            yield
        except BipotError:
            raise
        except Exception as failure:
            # Damaged bytes make h5py raise whatever it meets first.
            raise self.refuse(f"{self.path}: {field} cannot be read ({failure})") from failure
