"""One dataset of an untrusted file: its declarations are checked, and its numbers once they are read.

Integers and floats of the standard sizes are read, by NumPy's letters f, i and u.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, prod
from typing import Any

import h5py
import numpy as np
from h5py.h5a import AttrID
from h5py.h5d import DatasetID
from h5py.h5t import TypeID
from numpy.typing import NDArray

from bipot.hdf5.source import Source
from bipot.hdf5.storage import Stored

Shape = tuple[int | None, ...]
"""None for a length that may be any."""

WORDS = {"f": "floats", "i": "signed integers", "u": "unsigned integers"}
SIZES = {"f": (32, 64), "i": (8, 16, 32, 64), "u": (8, 16, 32, 64)}
STANDARD = {"f": "IEEE_F", "i": "STD_I", "u": "STD_U"}


@dataclass(frozen=True)
class Dataset(Stored):
    """A dataset and the shape it declares, which need not be stored."""

    shape: tuple[int, ...]

    @staticmethod
    def of(source: Source, field: str, found: Any) -> Dataset:
        """What was found under a name; refuses what is no dataset, or one of another file's numbers."""
        if not isinstance(found, h5py.h5d.DatasetID):
            raise source.refuse(f"{source.path}: {field} is no dataset")
        with source.reading(field):
            # Before the shape: asked for one, HDF5 opens the files of a virtual dataset.
            Stored(source, field, found).require_own()
            space = found.get_space()
            kind = space.get_simple_extent_type()
            source.require(kind != h5py.h5s.NULL, f"{field}: its shape", "null", "that of an array")
            return Dataset(source, field, found, space.get_simple_extent_dims())

    @property
    def stored(self) -> bool:
        """Whether it has a place in the file; for chunks, which only reading can tell, this is assumed."""
        with self.source.reading(self.field):
            return not self.contiguous or self.id.get_offset() is not None

    def require_form(self, kind: str, shape: Shape, rows: int | None = None) -> None:
        """Refuse another kind, another shape, and more ``rows`` (None for all) than the limit of one array allows."""
        found = self.shape
        fits = len(found) == len(shape) and all(want in (None, n) for n, want in zip(found, shape, strict=True))
        words = str(tuple("any" if n is None else n for n in shape)).replace("'", "")
        self.require(fits, "its shape", found, words)
        with self.source.reading(self.field):
            require_kind(self.source, self.field, self.id, kind)
        held, largest = 8 * prod(found if rows is None else (rows, *found[1:])), self.source.largest
        self.require(held <= largest, "its bytes", held, f"at most {largest}")

    def read(
        self, kind: str, start: int, stop: int, *, finite: bool = True, least: float = -inf, most: float = inf
    ) -> NDArray[Any]:
        """Rows from ``start`` up to ``stop``, or the one number where it has no dimensions.

        Refuses values that are not ``finite``, if they have to be, and those below ``least`` or above ``most``.
        """
        with self.source.reading(self.field):
            self.require_stored(start, stop)
            whole = h5py.Dataset(self.id)
            found = np.asarray(whole[start:stop] if self.shape else whole[()])
        target = np.float64 if "f" in kind else np.int64
        if target is np.int64 and found.dtype == np.uint64:
            most = min(most, np.iinfo(np.int64).max)
        bounds = f"in [{least}, {most}]"
        checks = (
            (finite and found.dtype.kind == "f", lambda: ~np.isfinite(found), "finite"),
            (least > -inf, lambda: found < least, bounds),
            (most < inf, lambda: found > most, bounds),
        )
        for asked, beyond, words in checks:
            if asked and (bad := beyond()).any():
                place = tuple(int(k) for k in np.unravel_index(bad.argmax(), bad.shape))
                self.source.require(False, f"{self.field}{list(place)}", found[place], words)
        return found.astype(target, copy=False)


def require_kind(source: Source, field: str, item: DatasetID | AttrID, kind: str) -> None:
    """Refuse a type that is none of the standard ones of the letters in ``kind``.

    The type is compared in HDF5's form: no NumPy type is made of a type that a file controls.
    """
    found = item.get_type()
    names = (f"{STANDARD[letter]}{size}{order}" for letter in kind for size in SIZES[letter] for order in ("LE", "BE"))
    known = any(found.equal(getattr(h5py.h5t, name)) for name in names)
    allowed = " or ".join(WORDS[letter] for letter in kind)
    source.require(known, f"{field}: its type", _kind(found), f"{allowed} of a standard size")


def _kind(found: TypeID) -> str:
    numbers = {h5py.h5t.INTEGER: "an integer", h5py.h5t.FLOAT: "a float"}
    others = {
        h5py.h5t.STRING: "a string",
        h5py.h5t.VLEN: "one of variable length",
        h5py.h5t.COMPOUND: "a compound",
        h5py.h5t.REFERENCE: "a reference",
        h5py.h5t.OPAQUE: "an opaque one",
        h5py.h5t.ENUM: "an enumeration",
        h5py.h5t.ARRAY: "an array",
        h5py.h5t.BITFIELD: "bits",
    }
    kind = found.get_class()
    return f"{numbers[kind]} of {found.get_size()} bytes" if kind in numbers else others.get(kind, f"of class {kind}")
