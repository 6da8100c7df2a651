"""Meshes of scikit-fem and of files (through meshio) as arrays for a :class:`~bipot.meshes.mesh.Mesh`.

Nodes that belong to no cell are dropped, and cells numbered as mirror images are reversed; cells keep their order.
Facets are the lines or faces that bound cells, which a file marks as boundaries as it does cells as regions
(:mod:`bipot.meshes.groups`). Files that cannot give a mesh of one kind of element are refused in words.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from bipot.errors import SceneError, require
from bipot.meshes import abaqus
from bipot.meshes.cells import MeshParts, used
from bipot.meshes.elements import Element, same_places
from bipot.meshes.facets import Facets
from bipot.meshes.groups import FACETS, TAGS, Numbers, groups
from bipot.typing import Floats, Ints

KINDS = {element.cell: element for element in Element}
"""Elements by their names in meshio."""

IGNORED = ("vertex", *FACETS[2])

FORMATS = {".msh": "gmsh"}
"""The format meant by file endings that meshio knows for several formats."""

FLAT = 1e-12


def of_skfem(mesh: Any) -> MeshParts:
    """A mesh of scikit-fem with its named boundaries and subdomains."""
    import skfem

    kinds = {getattr(skfem, element.shapes): element for element in Element}
    known = isinstance(mesh, skfem.Mesh) and mesh.elem in kinds
    require(known, "mesh", type(mesh).__name__, f"one of scikit-fem, of {[element.shapes for element in Element]}")
    ends, element = np.asarray(mesh.facets).T, kinds[mesh.elem]
    facets = {name: ends[np.asarray(f)] for name, f in (mesh.boundaries or {}).items()}
    order = same_places(element.every_place, np.asarray(mesh.elem().doflocs))
    cells = mesh.dofs.element_dofs.T[:, order].astype(np.intp)
    return _parts(mesh.doflocs.T, cells, facets, {}, dict(mesh.subdomains or {}))


def of_meshio(source: Any, tag: str | None, names: Numbers | None) -> MeshParts:
    """A mesh of meshio, or of a file that it reads; ``tag`` and ``names`` as in ``Mesh.from_meshio``."""
    require(find_spec("meshio") is not None, "mesh", "a file", "read by meshio: pip install bipot[mesh]")
    import meshio

    mesh = source if isinstance(source, meshio.Mesh) else _read(source)
    cells, dimension = _cells(mesh)
    facets, regions = groups(mesh, dimension, tag, names)
    return _parts(_places(mesh.points, cells, dimension), cells, facets, mesh.point_sets, regions)


def to_meshio(parts: MeshParts) -> Any:
    """The parts as a mesh of meshio: boundaries are cells of facets numbered from 1, groups of Gmsh, sets of nodes.

    Regions are sets of cells, and groups numbered on; elements of one number that follow each other are a block.
    """
    require(find_spec("meshio") is not None, "mesh", "to write", "handed to meshio: pip install bipot[mesh]")
    import meshio

    element, d = parts.element, parts.nodes.shape[1]
    order = np.concatenate([element.ends, np.setdiff1d(np.arange(element.facets.shape[1]), element.ends)])
    bounds = [facets[:, order] for facets in parts.boundaries.values()]
    numbers, named = _numbered(parts)
    starts = np.flatnonzero(np.diff(numbers, prepend=-1))
    body = np.split(parts.elements, starts[1:])
    # Gmsh 4.1 wants every block to be an entity of its own, and every node on one: the body, or a boundary it is on.
    dims = np.repeat([d, d - 1], [len(body), len(bounds)])
    tags = np.concatenate([np.arange(len(body)), np.arange(1, len(bounds) + 1)])
    block = np.empty(len(parts.nodes), dtype=np.intp)
    for number, cells in enumerate([*body, *bounds]):
        block[cells] = number
    # An entity with all nodes on others gets a node of no cell, which is dropped when the file is read.
    bare = np.setdiff1d(np.arange(len(dims)), block)
    block = np.concatenate([block, bare])
    nodes = np.concatenate([parts.nodes, parts.nodes[np.zeros_like(bare)]])
    sizes = list(map(len, [*body, *bounds]))
    groups_of = np.concatenate([numbers[starts], tags[len(body) :]])
    data = {TAGS[0]: groups_of, "gmsh:geometrical": tags}
    return meshio.Mesh(
        np.pad(nodes, ((0, 0), (0, 3 - d))),
        [*((element.cell, cells) for cells in body), *((element.facet, facets) for facets in bounds)],
        {"gmsh:dim_tags": np.column_stack([dims, tags])[block]},
        {name: list(map(np.full, sizes, of)) for name, of in data.items()},
        named | {name: np.array([number, d - 1]) for number, name in enumerate(parts.boundaries, 1)},
        {name: np.unique(facets) for name, facets in parts.boundaries.items()},
        {name: _apart(members, starts, len(bounds)) for name, members in parts.regions.items()},
    )


def _apart(members: Ints, starts: Ints, others: int) -> list[Ints]:
    """Numbers (n,) of elements as those of the cells in each block, which begin at ``starts``, and none in others."""
    parts = np.split(members, np.searchsorted(members, starts[1:]))
    return [part - start for part, start in zip(parts, starts, strict=True)] + [members[:0]] * others


def _numbered(parts: MeshParts) -> tuple[Ints, dict[str, Ints]]:
    """Numbers (e,) of the elements' regions, 0 for none, and those with the dimension by the names of regions.

    A region that shares an element with an earlier one has no number, as an element has only one; neither has one with
    the name of a boundary, which files of Gmsh would confuse.
    """
    numbers, named = np.zeros(len(parts.elements), dtype=np.intp), dict[str, Ints]()
    for number, (name, members) in enumerate(parts.regions.items(), len(parts.boundaries) + 1):
        if name not in parts.boundaries and not numbers[members].any():
            numbers[members] = number
            named[name] = np.array([number, parts.element.dimension])
    return numbers, named


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
                return abaqus.read(path)
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


def _parts(
    points: Floats, cells: Ints, bounds: Mapping[str, Ints], sets: Mapping[str, Any], regions: Mapping[str, Ints]
) -> MeshParts:
    """The mesh of cells (e, k), facets (f, n) by all of their nodes or their ends, sets of nodes, and regions."""
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
    return used(MeshParts(points, cells, boundaries, regions))


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
