"""Which types of numbers are read: integers and floats of the standard sizes, by NumPy's letters f, i and u."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bipot.hdf5.source import Source

if TYPE_CHECKING:
    from h5py.h5a import AttrID
    from h5py.h5d import DatasetID
    from h5py.h5t import TypeID

WORDS = {"f": "floats", "i": "signed integers", "u": "unsigned integers"}
SIZES = {"f": (32, 64), "i": (8, 16, 32, 64), "u": (8, 16, 32, 64)}
STANDARD = {"f": "IEEE_F", "i": "STD_I", "u": "STD_U"}


def require_kind(source: Source, field: str, item: DatasetID | AttrID, kind: str) -> None:
    """Refuse a type that is none of the standard ones of the letters in ``kind``.

    The type is compared in HDF5's form: no NumPy type is made of a type that a file controls.
    """
    import h5py

    found = item.get_type()
    names = (f"{STANDARD[letter]}{size}{order}" for letter in kind for size in SIZES[letter] for order in ("LE", "BE"))
    known = any(found.equal(getattr(h5py.h5t, name)) for name in names)
    allowed = " or ".join(WORDS[letter] for letter in kind)
    source.require(known, f"{field}: its type", _words(found), f"{allowed} of a standard size")


def _words(found: TypeID) -> str:
    import h5py

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
