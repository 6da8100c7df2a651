"""Facets that a mesh of meshio marks as boundaries, by numbers in its cell data or by its sets of cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bipot.errors import require, require_type
from bipot.meshes.elements import elements_of
from bipot.typing import Ints

FACETS = {d: tuple({element.facet: None for element in elements_of(d)}) for d in (2, 3)}
"""Facets of cells in a plane, and in space, by names in meshio."""

TAGS = ("gmsh:physical", "medit:ref")
"""Cell data in which mesh files number boundaries; 0 is none."""


def tagged(mesh: Any, dimension: int, tag: str | None, names: Mapping[str, int] | None) -> dict[str, Ints]:
    """Facets by name from numbers in cell data: by given ``names``, else by the file's, else by the numbers."""
    require_type(tag, str, "tag", optional=True)
    require_type(names, Mapping, "names", optional=True)
    known = sorted(mesh.cell_data)
    require(tag is None or tag in known, "tag", tag, f"one of the cell data {known}")
    tag = tag or next((name for name in TAGS if name in known), None)
    require(tag is not None or not names, "names", dict(names or {}), "with the name of the cell data that has them")
    if tag is None:
        return {}
    facets = zip(mesh.cells, mesh.cell_data[tag], strict=True)
    blocks = [(block.data, np.asarray(data)) for block, data in facets if block.type in FACETS[dimension]]
    whole = all(d.ndim == 1 and d.dtype.kind in "iuf" and bool(np.isfinite(d).all()) for _, d in blocks)
    whole = whole and all((data == np.round(data)).all() for _, data in blocks)
    require(whole, "tag", tag, "cell data of one whole number a cell")
    values = sorted({int(value) for _, data in blocks for value in np.unique(data)})
    groups = {name: np.asarray(pair) for name, pair in mesh.field_data.items()}
    called = {int(p[0]): name for name, p in groups.items() if p.shape == (2,) and p[1] == dimension - 1}
    numbered = [(called.get(value, str(value)), value) for value in values if value]
    twice = len({name for name, _ in numbered}) < len(numbered)
    require(bool(names) or not twice, "mesh boundaries", [name for name, _ in numbered], "of different names")
    wanted = names or dict(numbered)
    for name, value in wanted.items():
        what = "lines" if dimension == 2 else "faces"
        known = np.ndim(value) == 0 and value in values
        require(known, f"names[{name!r}]", value, f"one of the {what}' {tag}: {values}")
    return {name: _joined([cells[data == value] for cells, data in blocks]) for name, value in wanted.items()}


def sets_of_facets(mesh: Any, dimension: int) -> dict[str, Ints]:
    """Facets by name from the sets of cells that contain only facets."""
    found = {}
    for name, sets in mesh.cell_sets.items():
        # Sets with names of this form hold other numbers of meshio.
        members = [] if name.startswith("gmsh:") else list(zip(mesh.cells, sets, strict=False))
        members = [(block, which) for block, which in members if which is not None and np.size(which)]
        if members and all(block.type in FACETS[dimension] for block, _ in members):
            found[name] = _joined([block.data[_members(which, len(block.data), name)] for block, which in members])
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
