"""Meshes of scikit-fem and of files (through meshio) as arrays for a :class:`~bipot.meshes.mesh.Mesh`.

Nodes that belong to no cell are dropped, and cells numbered as mirror images are reversed. Facets are the lines or
faces that bound cells, which a file marks as boundaries by numbers in its cell data or by sets of cells. Files that
cannot give a mesh of one kind of element are refused in words. Types of Abaqus that meshio does not know are replaced
by one of the same shape.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from bipot.errors import SceneError, require, require_type
from bipot.meshes.cells import MeshParts, used
from bipot.meshes.elements import Element, elements_of, same_places
from bipot.meshes.facets import Facets
from bipot.typing import Floats, Ints

KINDS = {element.cell: element for element in Element}
"""Elements by their names in meshio."""

FACETS = {d: tuple({element.facet: None for element in elements_of(d)}) for d in (2, 3)}
"""Facets of cells in a plane, and in space, by names in meshio."""

TAGS = ("gmsh:physical", "medit:ref")
"""Cell data in which mesh files number boundaries; 0 is none."""

IGNORED = ("vertex", *FACETS[2])

FORMATS = {".msh": "gmsh"}
"""The format meant by file endings that meshio knows for several formats."""

PLAIN = {"3": "S3", "4": "S4", "6": "STRI65", "8": "S8R"}
"""A type of Abaqus that meshio knows, by the number of nodes of a plane element."""

PLANE = re.compile(r"(?im)^(\*ELEMENT\b[^\n]*\bTYPE\s*=\s*)C(?:PE|PS|PEG|AX)([3468])[A-Z]*\b")

FLAT = 1e-12


def of_skfem(mesh: Any) -> MeshParts:
    """A mesh of scikit-fem with its named boundaries."""
    import skfem

    kinds = {getattr(skfem, element.shapes): element for element in Element}
    known = isinstance(mesh, skfem.Mesh) and mesh.elem in kinds
    require(known, "mesh", type(mesh).__name__, f"one of scikit-fem, of {[element.shapes for element in Element]}")
    ends, element = np.asarray(mesh.facets).T, kinds[mesh.elem]
    facets = {name: ends[np.asarray(f)] for name, f in (mesh.boundaries or {}).items()}
    order = same_places(element.every_place, np.asarray(mesh.elem().doflocs))
    return _parts(mesh.doflocs.T, mesh.dofs.element_dofs.T[:, order].astype(np.intp), facets, {})


def of_meshio(source: Any, tag: str | None, names: Mapping[str, int] | None) -> MeshParts:
    """A mesh of meshio, or of a file that it reads; ``tag`` and ``names`` as in ``Mesh.from_meshio``."""
    require(find_spec("meshio") is not None, "mesh", "a file", "read by meshio: pip install bipot[mesh]")
    import meshio

    mesh = source if isinstance(source, meshio.Mesh) else _read(source)
    cells, dimension = _cells(mesh)
    facets = _tagged(mesh, dimension, tag, names) | _sets_of_facets(mesh, dimension)
    return _parts(_places(mesh.points, cells, dimension), cells, facets, mesh.point_sets)


def to_meshio(parts: MeshParts) -> Any:
    """The parts as a mesh of meshio: boundaries are cells of facets numbered from 1, groups of Gmsh, sets of nodes."""
    require(find_spec("meshio") is not None, "mesh", "to write", "handed to meshio: pip install bipot[mesh]")
    import meshio

    element, (count, d) = parts.element, parts.nodes.shape
    order = np.concatenate([element.ends, np.setdiff1d(np.arange(element.facets.shape[1]), element.ends)])
    bounds = [facets[:, order] for facets in parts.boundaries.values()]
    tags: list[Any] = [np.full(len(cells), number) for number, cells in enumerate([parts.elements, *bounds])]
    # Gmsh 4.1 wants every node on an entity: the body, or a boundary it is on.
    entity = np.tile([d, 0], (count, 1))
    for number, facets in enumerate(bounds, 1):
        entity[facets] = d - 1, number
    # An entity with all nodes on others gets a node of no cell, which is dropped when the file is read.
    bare = np.setdiff1d(np.arange(len(tags)), entity[:, 1])
    entity = np.concatenate([entity, np.stack([np.where(bare > 0, d - 1, d), bare], axis=1)])
    nodes = np.concatenate([parts.nodes, parts.nodes[np.zeros_like(bare)]])
    return meshio.Mesh(
        np.pad(nodes, ((0, 0), (0, 3 - d))),
        [(element.cell, parts.elements), *((element.facet, facets) for facets in bounds)],
        {"gmsh:dim_tags": entity},
        {TAGS[0]: tags, "gmsh:geometrical": tags},
        {name: np.array([number, d - 1]) for number, name in enumerate(parts.boundaries, 1)},
        {name: np.unique(facets) for name, facets in parts.boundaries.items()},
    )


def _read(path: Any) -> Any:
    """The file as a mesh of meshio, whose readers print, end in exceptions of any kind, or leave Python."""
    import meshio

    require(isinstance(path, str | Path), "mesh", path, "the path of a mesh file, or a mesh of meshio")
    path = Path(path)
    require(path.is_file(), "mesh file", str(path), "a file that exists")
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            if path.suffix.lower() == ".inp":
                return meshio.read(plain_types(path), "abaqus")
            return meshio.read(path, FORMATS.get(path.suffix.lower()))
    except (Exception, SystemExit) as failure:
        why = " ".join(f"{type(failure).__name__} {failure} {said.getvalue()}".split())
        raise SceneError(f"mesh file = {str(path)!r}: must be a mesh that meshio reads ({why})") from failure


def _cells(mesh: Any) -> tuple[Ints, int]:
    """The cells (e, k), all of one kind, and their dimension: those of space if there are any, else of a plane."""
    blocks = [block for block in mesh.cells if block.type not in IGNORED and len(block.data)]
    dimension = 3 if any(block.dim == 3 for block in blocks) else 2
    blocks = [block for block in blocks if block.dim == dimension]
    kinds = sorted({block.type for block in blocks})
    require(len(kinds) > 0, "mesh cells", kinds, "of a plane or of space; there are none")
    allowed = f"all of one kind, one of {sorted(KINDS)}"
    require(len(kinds) == 1 and kinds[0] in KINDS, "mesh cells", kinds, allowed)
    cells = np.concatenate([np.asarray(block.data) for block in blocks])
    whole = cells.dtype.kind in "iu"
    require(whole, "mesh cells", f"node indices of type {cells.dtype}", "whole numbers")
    return cells.astype(np.intp), dimension


def _tagged(mesh: Any, dimension: int, tag: str | None, names: Mapping[str, int] | None) -> dict[str, Ints]:
    """Facets by name from numbers in cell data: by given ``names``, else by the file's, else by the numbers."""
    require_type(tag, str, "tag", optional=True)
    require_type(names, Mapping, "names", optional=True)
    named = all(isinstance(name, str) for name in names or {})
    require(named, "names", dict(names or {}), "names with their numbers, as {'top': 3}")
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


def _sets_of_facets(mesh: Any, dimension: int) -> dict[str, Ints]:
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


def _places(points: Any, cells: Ints, dimension: int) -> Floats:
    """Positions (a, d) of the nodes (a, 2 or 3): if a plane has a third coordinate, it is constant."""
    given = np.asarray(points)
    require(given.dtype.kind in "iuf", "mesh nodes", f"of type {given.dtype}", "numbers")
    points = given.astype(np.float64)
    require(points.ndim == 2 and points.shape[1] in (2, 3), "mesh nodes", points.shape, "of two or three coordinates")
    outside = cells[(cells < 0) | (cells >= len(points))][:1].tolist()
    require(not outside, "mesh cells", f"node index {outside}", f"in [0, {len(points)})")
    used = points[np.unique(cells)]
    require(bool(np.isfinite(used).all()), "mesh nodes", "NaN or infinite", "finite")
    if dimension == 3:
        require(points.shape[1] == 3, "mesh nodes", points.shape, "of three coordinates, as the cells are of space")
        return points
    extent = np.ptp(used, axis=0)
    depth = float(extent[2:].max(initial=0.0))
    require(depth <= FLAT * extent.max(), "mesh z coordinates", f"over {depth:.3g}", "constant: the mesh is of a plane")
    return points[:, :2]


def _parts(points: Floats, cells: Ints, bounds: Mapping[str, Ints], sets: Mapping[str, Any]) -> MeshParts:
    """The mesh of cells (e, k), facets (f, n) by all of their nodes or their ends, and sets of nodes."""
    element = Element.of(cells.shape[1], points.shape[1])
    # Cells with a negative area or volume are numbered as their mirror images.
    inverted = _at_corners(points, cells, element).sum(axis=1) < 0
    cells = np.where(inverted[:, None], cells[:, element.mirrored], cells)
    _require_order(points, cells, element)
    facets = Facets.of(cells, element)
    boundaries = {name: _with_middle(name, some, facets) for name, some in bounds.items()}
    for name, members in sets.items():
        found = _covered(np.asarray(members), facets)
        if len(found):
            boundaries.setdefault(name, found)
    return used(MeshParts(points, cells, boundaries))


def _at_corners(points: Floats, cells: Ints, element: Element) -> Floats:
    """Volumes (e, corners) that the edges of straight cells span at their corners."""
    x = points[cells]
    return np.linalg.det(x[:, element.around] - x[:, : element.corners, None])


def _require_order(points: Floats, cells: Ints, element: Element) -> None:
    """Require that mid-side nodes lie between their corners, and that corners of straight cells go around."""
    sides = points[cells[:, element.edges]]
    along = sides[:, :, -1] - sides[:, :, 0]
    off = np.linalg.norm(sides[:, :, 1:-1] - (sides[:, :, :1] + along[:, :, None] / 2), axis=-1)
    stray = np.flatnonzero((off >= np.linalg.norm(along, axis=2)[:, :, None] / 2).any(axis=(1, 2)))[:1].tolist()
    allowed = "corners first, then mid-sides, each between its two corners (in the circle over its edge)"
    require(not stray, "mesh node order of cell", stray, allowed)
    if not element.quadratic:
        folded = np.flatnonzero((_at_corners(points, cells, element) <= 0).any(axis=1))[:1].tolist()
        convex = "around a triangle or a convex quadrilateral, in space around the base, then the top above it"
        require(not folded, "mesh node order of cell", folded, convex)


def _with_middle(name: str, bounds: Ints, facets: Facets) -> Ints:
    """The facets with the nodes ``bounds`` (f, n), their ends or all in any order."""
    what = "edge" if facets.element.dimension == 2 else "face"
    require(len(bounds) > 0, f"mesh boundary {name!r}", "empty", f"at least one {what}")
    found = facets.find(bounds)
    lost = bounds[found < 0][:1].tolist()
    require(not lost, f"mesh boundary {name!r}", lost, f"{what}s of cells")
    return facets.nodes[found]


def _covered(members: Ints, facets: Facets) -> Ints:
    """The outer facets (f, n) between nodes of a set; none if they leave one out, as the set then has another use."""
    found = facets.nodes[np.isin(facets.nodes, members).all(axis=1) & ~facets.shared]
    return found if np.isin(members, found).all() else found[:0]


def plain_types(path: Path) -> io.TextIOBase:
    """The file's text with types for plane strain, plane stress and revolution replaced by those of plain shapes.

    They differ in mechanics only, which a mesh does not contain.
    """
    given = path.read_text(encoding="utf-8", errors="replace")
    text = io.StringIO(PLANE.sub(lambda found: found[1] + PLAIN[found[2]], given))
    # Included files are relative to it.
    text.name = str(path)  # type: ignore[attr-defined]
    return text
