"""One dataset of an untrusted file: its declarations are checked, and its numbers once they are read."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bipot.hdf5.source import Source
from bipot.hdf5.storage import contiguous, require_own, require_stored
from bipot.hdf5.types import require_kind

if TYPE_CHECKING:
    from h5py.h5d import DatasetID

Shape = tuple[int | None, ...]
"""None for a length that may be any."""


@dataclass(frozen=True)
class Allowed:
    """Values that a dataset may hold: from ``least`` to ``most``, and finite or not."""

    finite: bool = True
    least: float = -inf
    most: float = inf


@dataclass(frozen=True)
class Dataset:
    """A dataset by the ``field`` that messages name, and the shape it declares, which need not be stored."""

    source: Source
    field: str
    id: DatasetID
    shape: tuple[int, ...]

    @staticmethod
    def of(source: Source, field: str, found: Any) -> Dataset:
        """What was found under a name; refuses what is no dataset, or one of another file's numbers."""
        import h5py

        if not isinstance(found, h5py.h5d.DatasetID):
            raise source.refuse(f"{source.path}: {field} is no dataset")
        with source.reading(field):
            # Before the shape: asked for one, HDF5 opens the files of a virtual dataset.
            require_own(source, field, found)
            space = found.get_space()
            kind = space.get_simple_extent_type()
            source.require(kind != h5py.h5s.NULL, f"{field}: its shape", "null", "that of an array")
            return Dataset(source, field, found, space.get_simple_extent_dims())

    @property
    def stored(self) -> bool:
        """Whether it has a place in the file; for chunks, which only reading can tell, this is assumed."""
        with self.source.reading(self.field):
            return not contiguous(self.id) or self.id.get_offset() is not None

    def require(self, kind: str, shape: Shape, rows: int | None = None) -> None:
        """Refuse another kind, another shape, and more ``rows`` (None for all) than the limit of one array allows."""
        found = self.shape
        fits = len(found) == len(shape) and all(want in (None, n) for n, want in zip(found, shape, strict=True))
        self.source.require(fits, f"{self.field}: its shape", found, _words(shape))
        with self.source.reading(self.field):
            require_kind(self.source, self.field, self.id, kind)
        held, largest = 8 * prod(found if rows is None else (rows, *found[1:])), self.source.largest
        self.source.require(held <= largest, f"{self.field}: its bytes", held, f"at most {largest}")

    def read(self, kind: str, start: int, stop: int, allowed: Allowed) -> NDArray[Any]:
        """Rows from ``start`` up to ``stop``, or the one number where it has no dimensions."""
        import h5py

        with self.source.reading(self.field):
            require_stored(self.source, self.field, self.id, start, stop)
            whole = h5py.Dataset(self.id)
            found = np.asarray(whole[start:stop] if self.shape else whole[()])
        target = np.float64 if "f" in kind else np.int64
        if target is np.int64 and found.dtype == np.uint64:
            allowed = replace(allowed, most=min(allowed.most, np.iinfo(np.int64).max))
        self._require_values(found, allowed)
        return found.astype(target, copy=False)

    def _require_values(self, values: NDArray[Any], allowed: Allowed) -> None:
        least, most = allowed.least, allowed.most
        bounds = f"in [{least}, {most}]"
        checks = (
            (allowed.finite and values.dtype.kind == "f", lambda: ~np.isfinite(values), "finite"),
            (least > -inf, lambda: values < least, bounds),
            (most < inf, lambda: values > most, bounds),
        )
        for asked, beyond, words in checks:
            if asked and (bad := beyond()).any():
                place = tuple(int(k) for k in np.unravel_index(bad.argmax(), bad.shape))
                self.source.require(False, f"{self.field}{list(place)}", values[place], words)


def _words(shape: Shape) -> str:
    return str(tuple("any" if n is None else n for n in shape)).replace("'", "")
