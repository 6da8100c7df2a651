"""Where the numbers of a dataset lie in its file, asked before any is read.

A dataset may declare any size: what is not stored in this file, whole, is refused. A compressed chunk is decoded here
up to its declared size, because HDF5 grows its buffer to whatever the stream holds.
"""

from __future__ import annotations

import zlib
from itertools import pairwise, product
from math import prod
from typing import TYPE_CHECKING

from bipot.hdf5.source import Source

if TYPE_CHECKING:
    from h5py.h5d import DatasetID, StoreInfo

LARGEST_CHUNK = 2**25
"""Bytes of one decoded chunk: HDF5 allocates it whole, however small the dataset is."""

CHECKSUM = 4
"""Bytes that Fletcher's checksum adds to a chunk."""


def require_own(source: Source, field: str, dataset: DatasetID) -> None:
    """Refuse a dataset whose numbers are another file's."""
    import h5py

    plist = dataset.get_create_plist()
    layout = plist.get_layout()
    names = {h5py.h5d.COMPACT: "compact", h5py.h5d.CONTIGUOUS: "contiguous", h5py.h5d.CHUNKED: "chunked"}
    told = "virtual" if layout == h5py.h5d.VIRTUAL else names.get(layout, layout)
    source.require(layout in names, f"{field}: its layout", told, "compact, contiguous or chunked")
    external = plist.get_external_count()
    source.require(external == 0, f"{field}: number of its external files", external, "0")


def require_stored(source: Source, field: str, dataset: DatasetID, start: int, stop: int) -> None:
    """Refuse a dataset whose rows from ``start`` up to ``stop`` are not in the file, whole and of their declared size.

    A dataset without dimensions is one row.
    """
    import h5py

    layout = dataset.get_create_plist().get_layout()
    if layout == h5py.h5d.CONTIGUOUS:
        _require_contiguous(source, field, dataset)
    if layout == h5py.h5d.CHUNKED:
        _require_chunks(source, field, dataset, start, stop)


def _require_contiguous(source: Source, field: str, dataset: DatasetID) -> None:
    declared = prod(dataset.shape) * dataset.dtype.itemsize
    if declared:
        offset = dataset.get_offset()
        stored = 0 if offset is None else min(dataset.get_storage_size(), source.size - offset)
        source.require(stored >= declared, f"{field}: its stored bytes", stored, f"{declared}, as declared")


def _require_chunks(source: Source, field: str, dataset: DatasetID, start: int, stop: int) -> None:
    """Refuse rows whose chunks are not there, each once, apart from one another, and of the declared size decoded."""
    shape, chunk = dataset.shape, dataset.get_create_plist().get_chunk()
    decoded = prod(chunk) * dataset.dtype.itemsize
    source.require(0 < decoded <= LARGEST_CHUNK, f"{field}: bytes of a chunk", decoded, f"in [1, {LARGEST_CHUNK}]")
    filters = _filters(source, field, dataset)
    rows = range(start // chunk[0] * chunk[0], stop, chunk[0]) if start < stop else range(0)
    grid = [rows, *(range(0, n, c) for n, c in zip(shape[1:], chunk[1:], strict=True))]
    asked = [place for place in _chunks(source, field, dataset) if place.chunk_offset[0] in rows]
    wanted = prod(map(len, grid))
    source.require(len(asked) == wanted, f"{field}: number of stored chunks", len(asked), f"{wanted}, as declared")
    once = {place.chunk_offset for place in asked} == set(product(*grid))
    source.require(once, f"{field}: its stored chunks", "others than those declared", "each there once")
    _require_apart(source, field, asked)
    for place in asked:
        length = _decoded_length(dataset, place, filters, decoded) if filters else place.size
        source.require(
            length == decoded, f"{field}: decoded bytes of the chunk at {place.chunk_offset}", length, f"{decoded}"
        )


def _chunks(source: Source, field: str, dataset: DatasetID) -> list[StoreInfo]:
    """All that are stored, refused where they are more than the bytes of the file."""
    found: list[StoreInfo] = []
    count = dataset.get_num_chunks()
    source.require(count <= source.size, f"{field}: number of stored chunks", count, f"at most {source.size}")
    if count:
        dataset.chunk_iter(found.append)
    return found


def _require_apart(source: Source, field: str, places: list[StoreInfo]) -> None:
    """Refuse chunks outside the file, or that share bytes: few bytes could then declare many."""
    ends = sorted((place.byte_offset, place.byte_offset + place.size) for place in places)
    last = max((end for _, end in ends), default=0)
    source.require(last <= source.size, f"{field}: end of its chunks", last, f"at most {source.size}, within the file")
    apart = all(one[1] <= other[0] for one, other in pairwise(ends))
    source.require(apart, f"{field}: places of its chunks", "one in another", "apart")


def _filters(source: Source, field: str, dataset: DatasetID) -> list[int]:
    """Codes of the filters in the order of writing."""
    import h5py

    plist, codes = dataset.get_create_plist(), []
    known = (h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_FLETCHER32)
    for k in range(plist.get_nfilters()):
        code, _, _, name = plist.get_filter(k)
        once = code in known and code not in codes
        source.require(once, f"{field}: its filter", f"{code} {name!r}", "shuffle, deflate or fletcher32, each once")
        codes.append(code)
    return codes


def _decoded_length(dataset: DatasetID, place: StoreInfo, filters: list[int], declared: int) -> int | str:
    """Bytes of a chunk after its filters, or why there are none; never decodes more than ``declared`` and some."""
    import h5py

    skipped, data = dataset.read_direct_chunk(place.chunk_offset)
    length = len(data)
    for k in reversed(range(len(filters))):
        if skipped >> k & 1:
            continue
        if filters[k] == h5py.h5z.FILTER_FLETCHER32:
            length -= CHECKSUM
        elif filters[k] == h5py.h5z.FILTER_DEFLATE:
            stream = zlib.decompressobj()
            try:
                length = len(stream.decompress(data[:length], declared + CHECKSUM + 1))
            except zlib.error as failure:
                return str(failure)
            if not stream.eof:
                return f"more than {declared}" if length > declared + CHECKSUM else "a stream without its end"
    return length
