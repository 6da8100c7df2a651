"""Groups of an untrusted HDF5 file: every name, type, shape and storage place is checked before it is read.

Only hard links are followed, and only integers and floats of the standard sizes are read. A refusal names the file,
the field, its value and what is allowed.

h5py takes long to import, and only files need it: what needs no file imports this module where it opens one.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import RawIOBase
from math import inf
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from h5py.h5g import GroupID
from h5py.h5l import TYPE_HARD
from h5py.h5o import open as open_object
from numpy.typing import NDArray

from bipot.errors import BipotError, Refusal
from bipot.hdf5.dataset import Dataset, Shape, require_kind
from bipot.hdf5.headers import require_plain, require_plain_file
from bipot.hdf5.source import INTEGERS, LARGEST, Source

LARGEST_TEXT = 2**22
"""Bytes of a text."""

MOST_NAMES = 10_000
"""Largest number of links of a group whose names are read."""


@contextmanager
def opened(
    source: str | Path | BinaryIO | RawIOBase, refuse: Refusal, largest: int = LARGEST, *, newest: bool = False
) -> Iterator[Checked]:
    """The root of a file, given by its path or open for reading; ``refuse`` makes the error of a message.

    ``largest`` is the largest size of one array, in bytes, 8 per number. ``newest`` allows objects of HDF5's newer
    forms, which can be crafted to crash the process (:mod:`bipot.hdf5.headers`).
    """
    with _bytes(source, refuse) as file:
        name = str(source) if isinstance(source, str | Path) else str(getattr(source, "name", "the open file"))
        told = Source(name, file, file.seek(0, 2), largest, refuse, newest)
        with told.reading("the file"):
            if not newest:
                require_plain_file(told)
            hdf5 = h5py.File(source, "r", locking=False)
        try:
            yield Checked(told, "", hdf5.id)
        finally:
            with told.reading("the file"):
                hdf5.close()


@contextmanager
def _bytes(source: str | Path | BinaryIO | RawIOBase, refuse: Refusal) -> Iterator[BinaryIO | RawIOBase]:
    """The file for reading its bytes."""
    if not isinstance(source, str | Path):
        yield source
        return
    path = Path(source)
    if not path.is_file():
        # A pipe or a device would be waited for, or read without end.
        raise refuse(f"{path} cannot be read: {'it is no regular file' if path.exists() else 'there is none'}")
    try:
        file = path.open("rb")
    except OSError as failure:
        raise refuse(f"{path} cannot be read ({failure})") from failure
    with file:
        yield file


@dataclass(frozen=True)
class Checked:
    """A group by its ``name`` in a file, "" the root; fields are named from it, ``"a/b"`` for one in a group of it.

    Every method refuses by the error given to :func:`opened`. A ``kind`` holds NumPy's letters of the allowed types,
    f, i and u: numbers come back as float64 where f is among them, else as int64.
    """

    source: Source
    name: str
    id: GroupID

    def __contains__(self, name: str) -> bool:
        *above, last = name.split("/")
        parent = self.group("/".join(above)) if above else self
        with self.source.reading(self._full(name)):
            return parent.id.links.exists(last.encode())

    def require(self, condition: bool, name: str, value: object, allowed: str) -> None:
        """Refuse the file by the name of a field in this group, its value and what is allowed, unless ``condition``."""
        self.source.require(condition, self._full(name), value, allowed)

    def names(self) -> list[str]:
        """Names of its links, refused where there are more than MOST_NAMES."""
        found: list[bytes] = []

        def take(name: bytes) -> bool | None:
            found.append(name)
            # Anything but None ends the iteration: a group may declare any number.
            return True if len(found) > MOST_NAMES else None

        with self.source.reading(self._full()):
            self.id.links.iterate(take)
            many = len(found) > MOST_NAMES
            self.source.require(not many, f"{self._full()}: number of its names", "more", f"at most {MOST_NAMES}")
            return [name.decode() for name in found]

    def group(self, name: str) -> Checked:
        """The group of that name."""
        found = self._item(name)
        if not isinstance(found, GroupID):
            raise self._refusal(name, "is no group")
        return Checked(self.source, self._full(name), found)

    def shape(self, name: str) -> tuple[int, ...]:
        """The declared shape of a dataset."""
        return self._dataset(name).shape

    def length(self, name: str) -> int:
        """The declared number of rows of a dataset."""
        shape = self.shape(name)
        self.require(len(shape) > 0, f"{name}: its shape", shape, "of one dimension at least")
        return shape[0]

    def stored(self, name: str) -> bool:
        """Whether a dataset in one piece was ever written; one that was only declared reads as zeros elsewhere."""
        return self._dataset(name).stored

    def array(
        self, name: str, kind: str, shape: Shape, *, finite: bool = True, least: float = -inf, most: float = inf
    ) -> NDArray[Any]:
        """A whole dataset of that kind and shape, None for any length, its values from ``least`` to ``most``."""
        dataset = self._dataset(name)
        dataset.require_form(kind, shape)
        return dataset.read(kind, 0, dataset.shape[0] if shape else 1, finite=finite, least=least, most=most)

    def rows(
        self,
        name: str,
        kind: str,
        start: int,
        stop: int,
        shape: Shape,
        *,
        finite: bool = True,
        least: float = -inf,
        most: float = inf,
    ) -> NDArray[Any]:
        """Rows from ``start`` up to ``stop``, each of ``shape``; only these are allocated."""
        dataset = self._dataset(name)
        dataset.require_form(kind, (None, *shape), stop - start)
        length = dataset.shape[0]
        inside = 0 <= start <= stop <= length
        self.require(inside, f"{name}: number of its rows", length, f"at least {stop}")
        return dataset.read(kind, start, stop, finite=finite, least=least, most=most)

    def integer(self, name: str, least: float = -inf, most: float = inf) -> int:
        """The one integer of a dataset, which has no dimensions or one of length 1, from ``least`` to ``most``."""
        dataset = self._dataset(name)
        dataset.require_form(INTEGERS, () if dataset.shape == () else (1,))
        value = dataset.read(INTEGERS, 0, 1).item()
        self.require(least <= value <= most, name, value, str(least) if least == most else f"in [{least}, {most}]")
        return value

    def attribute(self, name: str) -> int:
        """The one integer of an attribute of this group."""
        field = f"{self._full()}: attribute {name}"
        with self.source.reading(field):
            self.source.require(h5py.h5a.exists(self.id, name.encode()), field, "missing", "there")
            found = h5py.h5a.open(self.id, name.encode())
            self.source.require(found.shape in ((), (1,)), f"{field}: its shape", found.shape, "() or (1,)")
            require_kind(self.source, field, found, INTEGERS)
            value = np.empty(found.shape, found.dtype)
            found.read(value)
            return int(value.reshape(()).item())

    def text(self, name: str, largest: int = LARGEST_TEXT) -> str:
        """The text whose UTF-8 bytes are the unsigned 8-bit integers of a dataset of one dimension."""
        length = self.length(name)
        self.require(length <= largest, f"{name}: its bytes", length, f"at most {largest}")
        codes = self.array(name, "u", (length,), most=255)
        with self.source.reading(self._full(name)):
            return codes.astype(np.uint8).tobytes().decode("utf-8")

    def _full(self, name: str = "") -> str:
        return f"{self.name}/{name}" if name else self.name or "/"

    def _refusal(self, name: str, why: str) -> BipotError:
        return self.source.refuse(f"{self.source.path}: {self._full(name)} {why}")

    def _dataset(self, name: str) -> Dataset:
        return Dataset.of(self.source, self._full(name), self._item(name))

    def _item(self, name: str) -> Any:
        """The object of a name, by hard links only."""
        found: Any = self.id
        with self.source.reading(self._full(name)):
            for part in name.encode().split(b"/"):
                if not isinstance(found, GroupID) or not part or not found.links.exists(part):
                    raise self._refusal(name, "is missing")
                link = found.links.get_info(part)
                if link.type != TYPE_HARD:
                    raise self._refusal(name, "is a link to elsewhere: only what a group holds itself is read")
                if not self.source.newest:
                    require_plain(self.source, self._full(name), link.u)
                found = open_object(found, part)
        return found
