"""Storage of a dataset's numbers in its file, checked before any is read.

A dataset may declare any size: numbers that are not completely stored in this file are refused. A compressed chunk is
decoded here up to its declared size, because HDF5 enlarges its buffer to the size of the stream.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod

import h5py
import numpy as np
from h5py.h5d import DatasetID, StoreInfo

from bipot.hdf5.source import Source

LARGEST_CHUNK = 2**25
"""Bytes of one decoded chunk: HDF5 allocates it whole, however small the dataset is."""

CHECKSUM = 4
"""Bytes that Fletcher's checksum adds to a chunk."""

LEAST_ROOM = 64
"""Bytes by which a stored chunk may exceed the decoded one, because noise cannot be compressed."""


@dataclass(frozen=True)
class Stored:
    """A dataset as it is stored, by the ``field`` that messages name."""

    source: Source
    field: str
    id: DatasetID

    def require(self, condition: bool, what: str, value: object, allowed: str) -> None:
        """Refuse the file by ``what`` it says of the dataset, the value and what is allowed, unless ``condition``."""
        self.source.require(condition, f"{self.field}: {what}", value, allowed)

    @property
    def contiguous(self) -> bool:
        """Whether its numbers lie in one piece."""
        return self.id.get_create_plist().get_layout() == h5py.h5d.CONTIGUOUS

    def require_own(self) -> None:
        """Refuse numbers that are another file's."""
        plist = self.id.get_create_plist()
        layout = plist.get_layout()
        names = {h5py.h5d.COMPACT: "compact", h5py.h5d.CONTIGUOUS: "contiguous", h5py.h5d.CHUNKED: "chunked"}
        told = "virtual" if layout == h5py.h5d.VIRTUAL else names.get(layout, layout)
        self.require(layout in names, "its layout", told, "compact, contiguous or chunked")
        external = plist.get_external_count()
        self.require(external == 0, "number of its external files", external, "0")

    def require_stored(self, start: int, stop: int) -> None:
        """Refuse rows from ``start`` up to ``stop`` that are not in the file, whole and of their declared size.

        A dataset without dimensions is one row.
        """
        if self.contiguous:
            self._require_contiguous()
        if self.id.get_create_plist().get_layout() == h5py.h5d.CHUNKED:
            self._require_chunks(start, stop)

    def _require_contiguous(self) -> None:
        declared = prod(self.id.shape) * self.id.dtype.itemsize
        if declared:
            offset = self.id.get_offset()
            stored = 0 if offset is None else min(self.id.get_storage_size(), self.source.size - offset)
            self.require(stored >= declared, "its stored bytes", stored, f"{declared}, as declared")

    def _require_chunks(self, start: int, stop: int) -> None:
        """Refuse rows whose chunks are not there, or not of the declared size once decoded.

        Several chunks may share one place, so that few bytes declare many: in total they must not exceed the file.
        """
        shape, chunk = self.id.shape, self.id.get_create_plist().get_chunk()
        decoded = prod(chunk) * self.id.dtype.itemsize
        self.require(0 < decoded <= LARGEST_CHUNK, "bytes of a chunk", decoded, f"in [1, {LARGEST_CHUNK}]")
        filters = self._filters()
        first = start // chunk[0] * chunk[0]
        counts = [-(-n // c) for n, c in zip((max(stop - first, 0), *shape[1:]), chunk, strict=True)]
        if start < stop and prod(counts):
            grid = _Grid(first, tuple(chunk), tuple(counts))
            if filters:
                self._require_decoded(grid, decoded, filters)
            else:
                self._require_listed(grid, decoded)

    def _filters(self) -> list[int]:
        """Codes of the filters in the order of writing."""
        plist, codes = self.id.get_create_plist(), []
        known = (h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_FLETCHER32)
        for k in range(plist.get_nfilters()):
            code, _, _, name = plist.get_filter(k)
            once = code in known and code not in codes
            self.require(once, "its filter", f"{code} {name!r}", "shuffle, deflate or fletcher32, each once")
            codes.append(code)
        return codes

    def _require_decoded(self, grid: _Grid, decoded: int, filters: list[int]) -> None:
        """Check filtered chunks one by one, because their index may list any number of them."""
        room, stored = bytearray(decoded + decoded // 100 + LEAST_ROOM), 0
        for place in grid.places():
            # What is longer than the room is refused before it is read.
            skipped, data = self.id.read_direct_chunk(place, out=room)
            stored += len(data)
            self._require_room(stored)
            length = _decoded_length(data, skipped, filters, decoded)
            self.require(length == decoded, f"decoded bytes of the chunk at {place}", length, f"{decoded}")

    def _require_listed(self, grid: _Grid, decoded: int) -> None:
        """Check unfiltered chunks: HDF5 reads as many bytes as their index says into the buffer of one chunk."""
        wanted, listed, found = prod(grid.counts), 0, set()
        self._require_room(wanted * decoded)

        def take(chunk: StoreInfo) -> bool | None:
            nonlocal listed
            listed += 1
            if chunk.size == decoded and chunk.chunk_offset in grid:
                found.add(chunk.chunk_offset)
            # An index that leads to one place again and again would be listed without end.
            return True if len(found) == wanted or listed > self.source.size else None

        self.id.chunk_iter(take)
        whole = f"{wanted} of {decoded} bytes each, as declared"
        self.require(len(found) == wanted, "number of its stored chunks", len(found), whole)

    def _require_room(self, stored: int) -> None:
        """Refuse chunks of more ``stored`` bytes than the file has."""
        self.require(stored <= self.source.size, "bytes of its chunks", stored, f"at most {self.source.size}")


@dataclass(frozen=True)
class _Grid:
    """Chunks from a row on, so many in every direction."""

    first: int
    chunk: tuple[int, ...]
    counts: tuple[int, ...]

    def places(self) -> Iterator[tuple[int, ...]]:
        """One after another, because a list would be as long as a file declares."""
        for number in range(prod(self.counts)):
            index = np.unravel_index(number, self.counts)
            row, *others = (int(k) * c for k, c in zip(index, self.chunk, strict=True))
            yield self.first + row, *others

    def __contains__(self, place: tuple[int, ...]) -> bool:
        steps = (place[0] - self.first, *place[1:])
        each = zip(steps, self.chunk, self.counts, strict=True)
        return all(not step % size and 0 <= step < size * count for step, size, count in each)


def _decoded_length(data: memoryview, skipped: int, filters: list[int], declared: int) -> int | str:
    """Bytes of a chunk after its filters, or why there are none; decodes no more than slightly above ``declared``."""
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
