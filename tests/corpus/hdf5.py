"""Damage to one dataset of an HDF5 file: links, types, shapes, storage and filters that no reader may trust."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import h5py
import numpy as np

from tests.corpus.case import Case, damaged

Damage = Callable[[h5py.File, str], object]
"""Of an open file and the name of a dataset, whose place is free."""

HUGE = 2**40
SECRET = "/etc/hostname"
"""A file that no problem may bring in."""


def linked(link: object) -> Damage:
    """A link in the place of the dataset."""

    def damage(file: h5py.File, name: str) -> None:
        file[name] = link

    return damage


def rooted(file: h5py.File, name: str) -> None:
    """A circle of hard links."""
    file[name] = file["/"]


def group(file: h5py.File, name: str) -> None:
    file.create_group(name)


def of(data: object, dtype: object = None) -> Damage:
    """Other data."""
    return lambda file, name: file.create_dataset(name, data=data, dtype=dtype)


def typed(make: Callable[[], h5py.h5t.TypeID], shape: tuple[int, ...] = (4,)) -> Damage:
    """A dataset of a type that NumPy does not have, without data."""

    def damage(file: h5py.File, name: str) -> None:
        above, last = name.rsplit("/", 1)
        h5py.h5d.create(file[above].id, last.encode(), make(), h5py.h5s.create_simple(shape))

    return damage


def odd_integer() -> h5py.h5t.TypeID:
    """Three bytes, of which 17 bits count."""
    kind = h5py.h5t.STD_I32LE.copy()
    kind.set_precision(17)
    kind.set_size(3)
    return kind


def declared(shape: tuple[int, ...], **storage: object) -> Damage:
    """A shape without data."""
    return lambda file, name: file.create_dataset(name, shape, "f8", **storage)


def external(file: h5py.File, name: str) -> None:
    file.create_dataset(name, (4,), "f8", external=[(SECRET, 0, 32)])


def virtual(file: h5py.File, name: str, limited: bool) -> None:
    stop, shape = (4, (4,)) if limited else (h5py.UNLIMITED, (None,))
    layout = h5py.VirtualLayout((4,), "f8", maxshape=shape)
    layout[slice(0, stop)] = h5py.VirtualSource(SECRET, "x", (4,), maxshape=shape)[slice(0, stop)]
    file.create_virtual_dataset(name, layout)


def filtered(**filters: object) -> Damage:
    return lambda file, name: file.create_dataset(name, data=np.ones(64), chunks=(64,), **filters)


def chunk(content: bytes, skipped: int = 0, rows: int = 8, **filters: object) -> Damage:
    """One chunk of 8-byte floats whose stored bytes are these."""

    def damage(file: h5py.File, name: str) -> None:
        made = file.create_dataset(name, (rows,), "f8", chunks=(rows,), **filters)
        made.id.write_direct_chunk((0,), content, filter_mask=skipped)

    return damage


def pipeline(*codes: int) -> Damage:
    """A chunk that went through filters which nothing here has, or one of them twice."""

    def damage(file: h5py.File, name: str) -> None:
        above, last = name.rsplit("/", 1)
        plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plist.set_chunk((8,))
        for code in codes:
            plist.set_filter(code, h5py.h5z.FLAG_OPTIONAL, (5,) if code == h5py.h5z.FILTER_DEFLATE else ())
        space = h5py.h5s.create_simple((8,))
        made = h5py.h5d.create(file[above].id, last.encode(), h5py.h5t.IEEE_F64LE, space, plist)
        made.write_direct_chunk((0,), zlib.compress(zlib.compress(bytes(64))))

    return damage


def holes(file: h5py.File, name: str) -> None:
    """Two chunks of a thousand."""
    made = file.create_dataset(name, (8000,), "f8", chunks=(8,), compression="gzip")
    made[:8] = made[-8:] = 1.0


def bomb(file: h5py.File, name: str) -> None:
    """A stream of two gigabytes of zeros in some kilobytes, and a shape that says so."""
    made = file.create_dataset(name, (2**28,), "f8", chunks=(2**21,), compression="gzip")
    packed = zlib.compress(bytes(2**24), 9)
    for start in range(0, 2**28, 2**21):
        made.id.write_direct_chunk((start,), packed)


REPLACED: dict[str, Damage] = {
    "absent": lambda file, name: None,
    "soft link": linked(h5py.SoftLink("/elsewhere")),
    "soft link to itself": lambda file, name: linked(h5py.SoftLink("/" + name))(file, name),
    "external link": linked(h5py.ExternalLink(SECRET, "/x")),
    "circle of hard links": rooted,
    "group": group,
    "strings of any length": of(["1.0", "2.0"], h5py.string_dtype()),
    "strings": of(np.array([b"1.0", b"2.0"])),
    "arrays of any length": lambda file, name: file.create_dataset(name, (4,), h5py.vlen_dtype(np.float64)),
    "compound": of(np.zeros(4, [("x", "f8"), ("y", "f8")])),
    "enumeration": of(np.zeros(4, np.int8), h5py.enum_dtype({"a": 0, "b": 1})),
    "booleans": of(np.zeros(4, bool)),
    "opaque": of(np.zeros(4, "V8")),
    "references": lambda file, name: file.create_dataset(name, (4,), h5py.ref_dtype),
    "arrays": lambda file, name: file.create_dataset(name, (4,), np.dtype(("f8", (3,)))),
    "complex": of(np.zeros(4, complex)),
    "half floats": of(np.zeros(4, np.float16)),
    "integers of 17 bits": typed(odd_integer),
    "bits": typed(lambda: h5py.h5t.STD_B64LE),
    "times": typed(lambda: h5py.h5t.UNIX_D64LE),
    "null": of(h5py.Empty("f8")),
    "a number": of(1.0),
    "no numbers": of(np.zeros(0)),
    "two dimensions too many": of(np.zeros((2, 2, 2, 2, 2))),
    "a terabyte declared": declared((HUGE // 8,)),
    "a terabyte in chunks": declared((HUGE // 8,), chunks=(1000,), compression="gzip"),
    "more than any memory": declared((2**62,), chunks=(1000,)),
    "a chunk of a gigabyte": declared((4,), chunks=(2**27,), maxshape=(None,), compression="gzip"),
    "never written": declared((4,)),
    "external storage": external,
    "virtual": partial(virtual, limited=True),
    "virtual without end": partial(virtual, limited=False),
    "filter lzf": filtered(compression="lzf"),
    "filter scaleoffset": filtered(scaleoffset=3),
    "unknown filter": pipeline(32_000),
    "deflated twice": pipeline(h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_DEFLATE),
    "chunk that unpacks to too little": chunk(zlib.compress(bytes(63)), compression="gzip"),
    "chunk cut short": chunk(zlib.compress(np.random.default_rng(1).bytes(64))[:-20], compression="gzip"),
    "chunk that is no stream": chunk(b"\xff" * 64, compression="gzip"),
    "chunk skipped and too short": chunk(bytes(8), skipped=1, compression="gzip"),
    "chunk of no bytes to check": chunk(bytes(2), fletcher32=True),
    "chunk with a wrong checksum": chunk(np.random.default_rng(1).bytes(68), fletcher32=True),
    "holes": holes,
    "two gigabytes in kilobytes": bomb,
}
"""By what the dataset is replaced."""

if h5py.version.hdf5_version_tuple >= (2,):
    # Before, HDF5 refused to write so long a chunk of so few numbers.
    REPLACED |= {
        "chunk that unpacks to a gigabyte": chunk(zlib.compress(bytes(2**26)) * 16, compression="gzip"),
        "chunk that unpacks to 64 MB": chunk(zlib.compress(bytes(2**26)), compression="gzip"),
    }


def not_finite(value: float) -> Callable[[h5py.Dataset], None]:
    def change(dataset: h5py.Dataset) -> None:
        values = dataset[()]
        values.flat[-1] = value
        dataset[...] = values

    return change


CHANGED = {"NaN": not_finite(np.nan), "inf": not_finite(np.inf)}
"""Of a dataset of floats."""


def of_dataset(valid: Path, name: str, folder: Path, kinds: frozenset[str] = frozenset(REPLACED)) -> Iterator[Case]:
    """Copies of ``valid`` whose floats ``name`` are not what they should be, in every way of these kinds."""

    def replaced(damage: Damage, path: Path) -> None:
        with h5py.File(path, "a") as file:
            del file[name]
            damage(file, name)

    def changed(change: Callable[[h5py.Dataset], None], path: Path) -> None:
        with h5py.File(path, "a") as file:
            change(file[name])

    damages = {kind: partial(replaced, damage) for kind, damage in REPLACED.items() if kind in kinds}
    damages |= {kind: partial(changed, change) for kind, change in CHANGED.items()}
    yield from damaged(valid, folder, damages, name)


def _records(path: Path, name: str) -> tuple[bytearray, list[int], list[h5py.h5d.StoreInfo]]:
    """Bytes of a file, and for each chunk of a dataset its record in them and what HDF5 tells of it.

    Of a dataset of one dimension in HDF5's old index, whose records are size (4), filters (4), two offsets (8) and the
    place of the chunk (8 bytes).
    """
    with h5py.File(path, "r") as file:
        dataset = file[name].id
        chunks = [dataset.get_chunk_info(k) for k in range(dataset.get_num_chunks())]
    content = bytearray(path.read_bytes())
    found = []
    for chunk in chunks:
        (place,) = (k for k in range(len(content)) if content.startswith(struct.pack("<Q", chunk.byte_offset), k))
        found.append(place - 24)
    return content, found, chunks


def shared_chunks(path: Path, name: str) -> None:
    """All chunks of a dataset in the place of its first: few bytes that declare many."""
    content, records, chunks = _records(path, name)
    for record in records[1:]:
        struct.pack_into("<I", content, record, chunks[0].size)
        struct.pack_into("<Q", content, record + 24, chunks[0].byte_offset)
    path.write_bytes(content)


def longer_chunk(path: Path, name: str) -> None:
    """More bytes in the index than a chunk without filters has: HDF5 2.0 reads them into what it takes for one."""
    content, records, chunks = _records(path, name)
    struct.pack_into("<I", content, records[-1], chunks[-1].size + 5000)
    path.write_bytes(content)
