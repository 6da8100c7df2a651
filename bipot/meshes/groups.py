"""Named groups of a mesh of meshio: boundaries are groups of the lines or faces that bound cells, regions of cells.

Groups are numbers in cell data, which ``field_data`` name as pairs (number, dimension), or sets of cells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bipot.errors import require, require_type
from bipot.meshes.elements import elements_of
from bipot.typing import Ints, listed

Numbers = Mapping[str, int | tuple[int, int]]
"""Names of groups with their numbers, or with pairs (number, dimension)."""

Members = dict[str, list[tuple[int, Ints]]]
"""Members of groups by name, block by block: the number of the block of cells, and numbers (n,) of cells in it."""

FACETS = {d: tuple({element.facet: None for element in elements_of(d)}) for d in (2, 3)}
"""Facets of cells in a plane, and in space, by names in meshio."""

TAGS = ("gmsh:physical", "medit:ref")
"""Cell data in which mesh files number groups; 0 is none."""


def groups(
    mesh: Any, dimension: int, tag: str | None, names: Numbers | None
) -> tuple[dict[str, Ints], dict[str, Ints]]:
    """Facets (f, n), by all nodes or their ends, and numbers (n,) of the body's cells, by the name of their group.

    Cells of the body are numbered through all blocks of the ``dimension``, in their order. ``tag`` and ``names`` are
    those of ``Mesh.from_meshio``.
    """
    sizes = [len(block.data) for block in mesh.cells]
    facets = [k for k, block in enumerate(mesh.cells) if block.type in FACETS[dimension]]
    body = [k for k, block in enumerate(mesh.cells) if block.dim == dimension]
    first = dict(zip(body, np.cumsum([0, *(sizes[k] for k in body)])[:-1].tolist(), strict=True))
    bounds, regions = _tagged(mesh, dimension, (facets, body), tag, names)
    bounds |= _sets(mesh, facets)
    regions |= _sets(mesh, body)
    return (
        {name: _joined([mesh.cells[k].data[which] for k, which in members]) for name, members in bounds.items()},
        {name: np.unique(np.concatenate([first[k] + which for k, which in parts])) for name, parts in regions.items()},
    )


def _tagged(
    mesh: Any, dimension: int, blocks: tuple[list[int], list[int]], tag: str | None, names: Numbers | None
) -> tuple[Members, Members]:
    """Facets and cells by name from numbers in cell data: by given ``names``, else the file's, else the numbers."""
    require_type(tag, str, "tag", optional=True)
    require_type(names, Mapping, "names", optional=True)
    named = all(isinstance(name, str) for name in names or {})
    require(named, "names", dict(names or {}), "names with their numbers, as {'top': 3}")
    known = sorted(mesh.cell_data)
    require(tag is None or tag in known, "tag", tag, f"one of the cell data {known}")
    tag = tag or next((name for name in TAGS if name in known), None)
    require(tag is not None or not names, "names", dict(names or {}), "with the name of the cell data that has them")
    if tag is None:
        return {}, {}
    data = mesh.cell_data[tag]
    facets, body = ([(k, np.asarray(data[k])) for k in some] for some in blocks)
    require(_whole(facets), "tag", tag, "cell data of one whole number a cell")
    if not _whole(body):
        # Numbers of boundaries may come with others, or none, of the cells.
        require(any(numbers.any() for _, numbers in facets), "tag", tag, "cell data of one whole number a cell")
        body = []
    values = [sorted({int(value) for _, numbers in some for value in np.unique(numbers)}) for some in (facets, body)]
    if names:
        wanted = _wanted(names, values, dimension, tag)
    else:
        kinds = ("boundaries", "regions")
        wanted = [_called(mesh, dimension - 1 + k, values[k], kind) for k, kind in enumerate(kinds)]
    bounds, regions = (
        {name: [(k, np.flatnonzero(numbers == value)) for k, numbers in some] for name, value in chosen.items()}
        for some, chosen in zip((facets, body), wanted, strict=True)
    )
    return bounds, regions


def _whole(data: Sequence[tuple[int, NDArray[Any]]]) -> bool:
    """Whether cell data have one whole number a cell."""
    numeric = all(d.ndim == 1 and d.dtype.kind in "iuf" and bool(np.isfinite(d).all()) for _, d in data)
    return numeric and all(bool((numbers == np.round(numbers)).all()) for _, numbers in data)


def _called(mesh: Any, dimension: int, values: list[int], kind: str) -> dict[str, int]:
    """Numbers of cells of a ``dimension`` by the file's names of them, or themselves."""
    given = {name: np.asarray(pair) for name, pair in mesh.field_data.items()}
    called = {int(pair[0]): name for name, pair in given.items() if pair.shape == (2,) and pair[1] == dimension}
    numbered = [(called.get(value, str(value)), value) for value in values if value]
    twice = len({name for name, _ in numbered}) < len(numbered)
    require(not twice, f"mesh {kind}", [name for name, _ in numbered], "of different names")
    return dict(numbered)


def _wanted(names: Numbers, values: list[list[int]], dimension: int, tag: str) -> list[dict[str, int]]:
    """Numbers of boundaries, and of regions, by the ``names`` given to them."""
    wanted: list[dict[str, int]] = [{}, {}]
    what = "lines" if dimension == 2 else "faces"
    allowed = f"one of the {what}' {tag}: {values[0]}, or of the cells': {values[1]}"
    for name, given in names.items():
        # A number alone is a boundary's if lines or faces have it.
        number, of = _pair(given)
        levels = (k for k in (0, 1) if of in (None, dimension - 1 + k))
        level = next((k for k in levels if np.ndim(number) == 0 and number in values[k]), -1)
        require(level >= 0, f"names[{name!r}]", given, allowed)
        wanted[level][name] = int(number)
    return wanted


def _pair(given: Any) -> tuple[Any, Any]:
    """A number and the dimension of its cells, None if that is not given."""
    pair = listed(given) and len(given) == 2 and all(np.ndim(part) == 0 for part in given)
    return tuple(given) if pair else (given, None)


def _sets(mesh: Any, blocks: list[int]) -> Members:
    """The sets of cells that contain only cells of the ``blocks``."""
    found: Members = {}
    for name, sets in mesh.cell_sets.items():
        # Sets with names of this form hold other numbers of meshio.
        members = [] if name.startswith("gmsh:") else list(enumerate(sets))[: len(mesh.cells)]
        members = [(k, which) for k, which in members if which is not None and np.size(which)]
        if members and all(k in blocks for k, _ in members):
            chosen = [(k, _members(which, len(mesh.cells[k].data), name)) for k, which in members]
            found |= {name: chosen} if any(len(which) for _, which in chosen) else {}
    return found


def _members(which: Any, count: int, name: str) -> Ints:
    """Numbers (n,) of the members of a set among ``count`` cells, given as numbers or as booleans."""
    chosen = np.asarray(which)
    if chosen.dtype.kind == "b" and chosen.shape == (count,):
        return np.flatnonzero(chosen)
    whole = chosen.ndim == 1 and chosen.dtype.kind in "iu" and bool(((chosen >= 0) & (chosen < count)).all())
    require(whole, f"mesh set {name!r}", f"{chosen.dtype} of shape {chosen.shape}", f"numbers of its {count} cells")
    return chosen.astype(np.intp)


def _joined(facets: list[Ints]) -> Ints:
    """Facets of one kind, or the ends of both kinds."""
    facets = [block for block in facets if len(block)]
    width = min(block.shape[1] for block in facets)
    return np.concatenate([block[:, :width] for block in facets])
