"""Symmetric tensors at points, read by the names that their components have in a geometry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bipot.errors import require, require_type
from bipot.fem.reduction import COMPONENTS, SQRT2, Geometry, mandel_to_full
from bipot.typing import Floats

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
