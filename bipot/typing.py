"""Array aliases, and how an array inside a frozen object is kept from being written to."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

Scalar = TypeVar("Scalar", bound=np.generic)


def read_only(values: ArrayLike, kind: type[Scalar]) -> NDArray[Scalar]:
    """A copy of ``values`` as numbers of ``kind`` that refuses to be written to.

    >>> read_only([1, 2], np.float64).flags.writeable
    False
    """
    array = np.array(values, dtype=kind)
    array.flags.writeable = False
    return array
