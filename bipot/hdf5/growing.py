"""A dataset that grows by rows, through HDF5's own calls: a step needs fifty, for which h5py takes several times
longer."""

from __future__ import annotations

from math import prod
from typing import Any

import numpy as np
from h5py import h5s
from numpy.typing import ArrayLike

from bipot.hdf5.storage import LARGEST_CHUNK

CHUNK = 4096
"""Bytes of the chunks of small rows."""


class Growing:
    """Rows of one shape and type, in chunks that have a checksum (HDF5's Fletcher filter)."""

    def __init__(self, dataset: Any) -> None:
        self._id, self._shape, self._type = dataset.id, dataset.shape[1:], dataset.dtype
        self.rows: int = dataset.shape[0]
        # Kept, because making them anew takes as long as writing.
        self._place, self._from, self._given = self._id.get_space(), None, ()

    @staticmethod
    def create(group: Any, name: str, first: ArrayLike) -> Growing:
        """A new dataset of the rows ``first`` (n, ...); a chunk holds as many, or more if they are small.

        No chunk is larger than the limit of readers.
        """
        rows = np.asarray(first)
        many = max(len(rows), CHUNK // max(rows[:1].nbytes, 1), 1)
        # Of a scene without tools some have no columns, which no chunk may lack.
        sizes = tuple(size or None for size in rows.shape[1:])
        chunks = _cut((many, *(max(size, 1) for size in rows.shape[1:])), rows.itemsize)
        made = group.create_dataset(name, data=rows, maxshape=(None, *sizes), chunks=chunks, fletcher32=True)
        return Growing(made)

    def append(self, values: ArrayLike) -> None:
        """Add rows (n, ...) of the shape and type of those that are there."""
        rows = np.ascontiguousarray(values, dtype=self._type)
        whole = (self.rows + len(rows), *self._shape)
        self._id.set_extent(whole)
        if rows.size:
            if rows.shape != self._given:
                self._from, self._given = h5s.create_simple(rows.shape), rows.shape
            self._place.set_extent_simple(whole)
            self._place.select_hyperslab((self.rows, *(0 for _ in self._shape)), rows.shape)
            self._id.write(self._from, self._place, rows)
        self.rows += len(rows)

    def cut(self, rows: int) -> None:
        """Truncate the dataset to so many ``rows``."""
        self._id.set_extent((rows, *self._shape))
        self.rows = rows


def _cut(chunk: tuple[int, ...], itemsize: int) -> tuple[int, ...]:
    """A chunk divided along its first directions until its size is within the limit of readers."""
    sizes = list(chunk)
    for k, size in enumerate(sizes):
        pieces = -(-prod(sizes) * itemsize // LARGEST_CHUNK)
        sizes[k] = -(-size // pieces)
    return tuple(sizes)
