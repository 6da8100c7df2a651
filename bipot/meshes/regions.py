"""Regions of a mesh: named sets of its elements, such as those of one material."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bipot.errors import require, require_type
from bipot.typing import Bools, FrozenMap, Ints, as_array, read_only


def regions_of(given: Mapping[str, Any], count: int) -> FrozenMap[str, Ints]:
    """Regions by name among ``count`` elements as ascending element numbers (n,), from numbers (n,) or booleans (e,).

    Raises:
        SceneError: no mapping from names; a region that is empty, holds an element twice, or one that is not there.

    >>> regions_of({"core": [2, 0], "shell": [False, True, False]}, 3)
    FrozenMap({'core': array([0, 2]), 'shell': array([1])})
    """
    require_type(given, Mapping, "mesh.regions")
    return FrozenMap({name: _members(name, members, count) for name, members in given.items()})


def marks_of(regions: Mapping[str, Ints], count: int) -> Bools:
    """Whether each of ``count`` elements is in each region, shape (r, e).

    >>> marks_of({"core": np.array([0]), "body": np.array([0, 1])}, 3).astype(int).tolist()
    [[1, 0, 0], [1, 1, 0]]
    """
    marks = np.zeros((len(regions), count), dtype=bool)
    for mark, members in zip(marks, regions.values(), strict=True):
        mark[members] = True
    return marks


def _members(name: object, given: object, count: int) -> Ints:
    """The numbers (n,) of a region's elements in ascending order."""
    label = f"mesh region {name!r}"
    require_type(name, str, f"{label}, its name")
    members = as_array(given, label)
    if members.dtype.kind == "b":
        require(members.shape == (count,), label, f"marks {members.shape}", f"one of each element, ({count},)")
        members = np.flatnonzero(members)
    require(members.size > 0, label, "empty", "at least one element")
    whole = members.dtype.kind in "iu" and members.ndim == 1
    require(whole, label, f"{members.dtype} {members.shape}", "element numbers (n,), or a boolean a element")
    outside = members[(members < 0) | (members >= count)][:1].tolist()
    require(not outside, label, f"element {outside}", f"in [0, {count})")
    ordered = np.sort(members)
    twice = ordered[:-1][ordered[:-1] == ordered[1:]][:1].tolist()
    require(not twice, label, f"element {twice}", "there once")
    return read_only(ordered, np.intp)
