r"""Reductions of the displacement gradient: a constant embedding of its nonzero entries g.

The displacement gradient H (3, 3) has the entries g in R^m of a :class:`Reduction`, H[i, j] = g_a, and zeros elsewhere:
m = 5 where the plane is a meridian (the fifth is the hoop strain u_1 / r), 4 in plane strain, 9 in space. A Mandel
vector has s = 4 components in a plane and 6 in space, in the order of :mod:`bipot.tensors`; :class:`Components` reads
symmetric tensors by the names that these have in a geometry.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache, cached_property

import numpy as np

from bipot.errors import require, require_type
from bipot.tensors import components
from bipot.typing import Floats, Ints, read_only

SQRT2 = float(np.sqrt(2.0))

Entry = tuple[int, int]
COMPONENTS: tuple[Entry, ...] = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
HOOP: Entry = (2, 2)


@cache
def mandel_to_full(size: int) -> Floats:
    """The symmetric tensor (s, 9), by rows, of each component of a Mandel vector of ``size`` s; orthonormal."""
    out = np.zeros((size, 9))
    for k, (i, j) in enumerate(COMPONENTS[:size]):
        out[k, [3 * i + j, 3 * j + i]] = 1.0 if i == j else 1 / SQRT2
    return read_only(out, np.float64)


@dataclass(frozen=True, eq=False)
class Reduction:
    """Space of ``dimension`` d; ``entries`` (i, j) of H in g, column by column; with a ``ring`` HOOP is the last.

    The gradients of shape functions have p rows, N,1 to N,d and, with a ring, N/r. Tables are read-only.
    """

    dimension: int
    entries: tuple[Entry, ...]
    ring: bool = False

    @property
    def rows(self) -> int:
        """Number p of rows of the gradients."""
        return self.dimension + self.ring

    @property
    def extents(self) -> int:
        """Power of length in volumes: in plane strain per unit of thickness, on a meridian of the whole ring."""
        return self.rows

    @property
    def mandel(self) -> int:
        """Components s of a Mandel vector."""
        return components(self.dimension)

    @cached_property
    def places(self) -> tuple[tuple[int, int], ...]:
        """For each entry of g the number of its displacement and the row of its gradient."""
        return tuple((0, 2) if self.ring and entry == HOOP else entry for entry in self.entries)

    @cached_property
    def diagonal(self) -> Ints:
        """Numbers of the entries of g on the diagonal of H, whose sum is its trace."""
        return read_only(np.flatnonzero([i == j for i, j in self.entries]), np.intp)

    @cached_property
    def symmetric(self) -> Floats:
        """The map (s, m) from g to the Mandel vector of its symmetric part."""
        return read_only(mandel_to_full(self.mandel) @ self.embedding.T, np.float64)

    @cached_property
    def embedding(self) -> Floats:
        """The tensor H (m, 9), by rows, of each unit entry of g."""
        return read_only(np.eye(9)[[3 * i + j for i, j in self.entries]], np.float64)

    @cached_property
    def copied(self) -> tuple[Ints, Floats]:
        """Mandel components (m,) of which the entries of t = ``symmetric``' sigma are multiples, and factors (1, s)."""
        component = np.argmax(self.symmetric, axis=0)
        return read_only(component, np.intp), read_only([self.symmetric.max(axis=1)], np.float64)

    @cached_property
    def row_forces(self) -> Floats:
        """From a Mandel stress the factors (s, d p) of the rows of the gradients in the forces along each axis."""
        out = np.zeros((self.mandel, self.dimension, self.rows))
        for a, (i, row) in enumerate(self.places):
            out[:, i, row] += self.symmetric[:, a]
        return read_only(out.reshape(self.mandel, -1), np.float64)

    @cached_property
    def moving(self) -> Floats:
        """From a Mandel stress (d(w D' t)/dg)/w (s, m m) at fixed stress: d w = w div, d N,j = -N,l g_lj.

        With t = ``symmetric``' sigma it is t x trace, less t_ij in row (i, l) and column (l, j).
        """
        t, count = self.symmetric, len(self.entries)
        trace = np.array([float(i == j) for i, j in self.entries])
        out = t[:, :, None] * trace
        number = {entry: a for a, entry in enumerate(self.entries)}
        for (i, k), a in number.items():
            for (m, j), b in number.items():
                if k == m and (i, j) in number:
                    out[:, a, b] -= t[:, number[i, j]]
        return read_only(out.reshape(self.mandel, count * count), np.float64)


class Geometry(Enum):
    """The meaning of the mesh's coordinates.

    They are (r, z) on the meridian of a body around the axis r = 0, (x, y) in plane strain, and (x, y, z) in space.
    """

    AXISYMMETRIC = "axisymmetric"
    PLANE_STRAIN = "plane_strain"
    SOLID = "solid"

    @property
    def reduction(self) -> Reduction:
        """The tables of this geometry."""
        return _REDUCTIONS[self.value]


_PLANE: tuple[Entry, ...] = ((0, 0), (1, 0), (0, 1), (1, 1))
_REDUCTIONS = {
    "axisymmetric": Reduction(2, (*_PLANE, HOOP), ring=True),
    "plane_strain": Reduction(2, _PLANE),
    "solid": Reduction(3, tuple((i, j) for j in range(3) for i in range(3))),
}


NAMES: Mapping[Geometry, tuple[str, ...]] = {
    Geometry.AXISYMMETRIC: ("rr", "zz", "tt", "rz"),
    Geometry.PLANE_STRAIN: ("xx", "yy", "zz", "xy"),
    Geometry.SOLID: ("xx", "yy", "zz", "xy", "yz", "xz"),
}
"""Names in Mandel order; tt is the hoop component, zz in plane strain the one out of the plane."""


@dataclass(frozen=True, eq=False)
class Components:
    """The components of symmetric tensors whose Mandel vectors (…, s) are ``mandel``, by name.

    ``tensors["rz"]`` (…) is the component t_rz itself, a shear not multiplied by √2. ``names`` are the geometry's:
    rr, zz, tt (hoop), rz on a meridian, xx, yy, zz (out of the plane), xy in plane strain, and yz, xz in space.

    Raises:
        SceneError: a name that the geometry has not, or vectors of another length.

    >>> Components(np.array([1.0, 2.0, 3.0, 4.0 * np.sqrt(2.0)]), Geometry.AXISYMMETRIC)["rz"].round(12)
    np.float64(4.0)
    """

    mandel: Floats
    geometry: Geometry

    def __post_init__(self) -> None:
        require_type(self.geometry, Geometry, "geometry")
        size = self.geometry.reduction.mandel
        numbers = isinstance(self.mandel, np.ndarray) and self.mandel.dtype.kind in "fiu"
        require(numbers, "mandel", type(self.mandel).__name__, "an array of numbers")
        shape = np.shape(self.mandel)
        require(shape[-1:] == (size,), "mandel", f"of shape {shape}", f"of shape (…, {size}), {self.geometry.value}")

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the components, in Mandel order."""
        return NAMES[self.geometry]

    def __getitem__(self, name: str) -> Floats:
        known = isinstance(name, str) and name in self.names
        require(known, "component", name, f"one of {', '.join(self.names)} ({self.geometry.value})")
        k = self.names.index(name)
        i, j = COMPONENTS[k]
        return self.mandel[..., k] / (1.0 if i == j else SQRT2)

    @property
    def matrix(self) -> Floats:
        """The tensors (…, 3, 3), axes in the order of the diagonal's names."""
        full = self.mandel @ mandel_to_full(self.mandel.shape[-1])
        return full.reshape(*self.mandel.shape[:-1], 3, 3)
