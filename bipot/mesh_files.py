"""Meshes of scikit-fem and of files (through meshio) as arrays: what a :class:`~bipot.mesh.Mesh` is made of.

Nodes of no cell are dropped and cells numbered clockwise are turned. What no plane mesh of one kind of element can come
from is refused in words.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from bipot.abaqus import plain_types
from bipot.cells import Parts, used
from bipot.elements import Element
from bipot.errors import SceneError, require, require_type
from bipot.facets import Facets
from bipot.typing import Floats, Ints

KINDS = {element.cell: element for element in Element}
"""Elements by their names in meshio."""

LINES = ("line", "line3")
IGNORED = ("vertex", *LINES)

TAGS = ("gmsh:physical", "medit:ref")
"""Cell data in which mesh files number boundaries; 0 is none."""

FORMATS = {".msh": "gmsh"}
"""Of endings that meshio knows for several programs, the one meant."""

FLAT = 1e-12


def of_skfem(mesh: Any) -> Parts:
    """A mesh of triangles or quadrilaterals of scikit-fem with its named boundaries."""
    import skfem

    kinds = {getattr(skfem, element.shapes): element for element in Element}
    known = isinstance(mesh, skfem.MeshTri | skfem.MeshQuad) and mesh.elem in kinds
    require(known, "mesh", type(mesh).__name__, "a MeshTri, MeshTri2, MeshQuad or MeshQuad2 of scikit-fem")
    ends = np.asarray(mesh.facets).T
    edges = {name: ends[np.asarray(f)] for name, f in (mesh.boundaries or {}).items()}
    return _parts(mesh.doflocs.T, mesh.dofs.element_dofs.T.astype(np.intp), edges, {})


def of_meshio(source: Any, tag: str | None, names: Mapping[str, int] | None) -> Parts:
    """A mesh of meshio, or of a file that it reads; ``tag`` and ``names`` as in ``Mesh.from_meshio``."""
    require(find_spec("meshio") is not None, "mesh", "a file", "read by meshio: pip install bipot[mesh]")
    import meshio

    mesh = source if isinstance(source, meshio.Mesh) else _read(source)
    cells = _cells(mesh)
    edges = _tagged(mesh, tag, names) | _sets_of_lines(mesh)
    return _parts(_flat(mesh.points, cells), cells, edges, mesh.point_sets)


def to_meshio(parts: Parts) -> Any:
    """The parts as a mesh of meshio: boundaries are line cells numbered from 1, groups of Gmsh, and sets of nodes."""
    require(find_spec("meshio") is not None, "mesh", "to write", "handed to meshio: pip install bipot[mesh]")
    import meshio

    element, count = Element.of(parts.elements.shape[1]), len(parts.nodes)
    order = [0, 2, 1] if element.quadratic else [0, 1]
    lines = [edges[:, order] for edges in parts.boundaries.values()]
    tags: list[Any] = [np.full(len(cells), number) for number, cells in enumerate([parts.elements, *lines])]
    # Gmsh 4.1 wants every node on an entity: the body, or a boundary it is on.
    entity = np.tile([2, 0], (count, 1))
    for number, edges in enumerate(lines, 1):
        entity[edges] = 1, number
    return meshio.Mesh(
        np.column_stack([parts.nodes, np.zeros(count)]),
        [(element.cell, parts.elements), *((element.line, edges) for edges in lines)],
        {"gmsh:dim_tags": entity},
        {TAGS[0]: tags, "gmsh:geometrical": tags},
        {name: np.array([number, 1]) for number, name in enumerate(parts.boundaries, 1)},
        {name: np.unique(edges) for name, edges in parts.boundaries.items()},
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


def _cells(mesh: Any) -> Ints:
    """The cells (e, k), all of one kind."""
    blocks = [block for block in mesh.cells if block.type not in IGNORED and len(block.data)]
    kinds = sorted({block.type for block in blocks})
    require(len(kinds) > 0, "mesh cells", kinds, "triangles or quadrilaterals; there are none")
    solid = [block.type for block in blocks if block.dim == 3]
    require(not solid, "mesh cells", solid[:1], "of the plane: bodies in space have no contact here")
    allowed = f"all of one kind, one of {sorted(KINDS)}"
    require(len(kinds) == 1 and kinds[0] in KINDS, "mesh cells", kinds, allowed)
    return np.concatenate([block.data for block in blocks]).astype(np.intp)


def _flat(points: Any, cells: Ints) -> Floats:
    """Positions (a, 2) of the nodes (a, 2 or 3): a third coordinate is the same for all that cells use."""
    given = np.asarray(points)
    require(given.dtype.kind in "iuf", "mesh nodes", f"of type {given.dtype}", "numbers")
    points = given.astype(np.float64)
    require(points.ndim == 2 and points.shape[1] in (2, 3), "mesh nodes", points.shape, "of two or three coordinates")
    outside = cells[(cells < 0) | (cells >= len(points))][:1]
    require(not outside.size, "mesh cells", f"node index {outside.max(initial=0)}", f"in [0, {len(points)})")
    used = points[np.unique(cells)]
    require(bool(np.isfinite(used).all()), "mesh nodes", "NaN or infinite", "finite")
    extent = np.ptp(used, axis=0)
    depth = float(extent[2:].max(initial=0.0))
    require(depth <= FLAT * extent.max(), "mesh z coordinates", f"over {depth:.3g}", "constant: the mesh is of a plane")
    return points[:, :2]


def _tagged(mesh: Any, tag: str | None, names: Mapping[str, int] | None) -> dict[str, Ints]:
    """Edges by name from numbers in cell data: names given, or those of the file, or the numbers themselves."""
    require_type(tag, str, "tag", optional=True)
    require_type(names, Mapping, "names", optional=True)
    known = sorted(mesh.cell_data)
    require(tag is None or tag in known, "tag", tag, f"one of the cell data {known}")
    tag = tag or next((name for name in TAGS if name in known), None)
    require(tag is not None or not names, "names", dict(names or {}), "with the name of the cell data that has them")
    if tag is None:
        return {}
    blocks = [(b.data, np.asarray(d)) for b, d in zip(mesh.cells, mesh.cell_data[tag], strict=True) if b.type in LINES]
    whole = all(d.ndim == 1 and d.dtype.kind in "iuf" and bool(np.isfinite(d).all()) for _, d in blocks)
    whole = whole and all((data == np.round(data)).all() for _, data in blocks)
    require(whole, "tag", tag, "cell data of one whole number a cell")
    values = sorted({int(value) for _, data in blocks for value in np.unique(data)})
    called = {int(of[0]): name for name, of in mesh.field_data.items() if len(of) == 2 and of[1] == 1}
    numbered = [(called.get(value, str(value)), value) for value in values if value]
    twice = len({name for name, _ in numbered}) < len(numbered)
    require(bool(names) or not twice, "mesh boundaries", [name for name, _ in numbered], "of different names")
    wanted = names or dict(numbered)
    for name, value in wanted.items():
        require(
            np.ndim(value) == 0 and value in values, f"names[{name!r}]", value, f"one of the lines' {tag}: {values}"
        )
    return {name: _joined([edges[data == value] for edges, data in blocks]) for name, value in wanted.items()}


def _sets_of_lines(mesh: Any) -> dict[str, Ints]:
    """Edges by name from sets of cells that hold lines alone."""
    found = {}
    for name, sets in mesh.cell_sets.items():
        # meshio keeps numbers of another kind there under names of its own.
        members = [] if name.startswith("gmsh:") else list(zip(mesh.cells, sets, strict=False))
        members = [(block, which) for block, which in members if which is not None and np.size(which)]
        if members and all(block.type in LINES for block, _ in members):
            found[name] = _joined([block.data[_members(which, len(block.data), name)] for block, which in members])
    return found


def _members(which: Any, count: int, name: str) -> Ints:
    """Numbers (n,) of the members of a set among ``count`` cells, given as numbers or as yes and no."""
    chosen = np.asarray(which)
    if chosen.dtype.kind == "b" and chosen.shape == (count,):
        return np.flatnonzero(chosen)
    whole = chosen.ndim == 1 and chosen.dtype.kind in "iu" and bool(((chosen >= 0) & (chosen < count)).all())
    require(whole, f"mesh set {name!r}", f"{chosen.dtype} of shape {chosen.shape}", f"numbers of its {count} cells")
    return chosen.astype(np.intp)


def _joined(edges: list[Ints]) -> Ints:
    """Edges of one kind, or the ends of both kinds."""
    edges = [some for some in edges if len(some)]
    width = min(some.shape[1] for some in edges)
    return np.concatenate([some[:, :width] for some in edges])


def _parts(points: Floats, cells: Ints, edges: Mapping[str, Ints], sets: Mapping[str, Any]) -> Parts:
    """The mesh of cells (e, k), edges (f, 2) or (f, 3), and sets of nodes."""
    cells = _anticlockwise(points, cells)
    _require_order(points, cells)
    facets = Facets.of(cells)
    boundaries = {name: _with_middle(name, some, facets) for name, some in edges.items()}
    for name, members in sets.items():
        found = _covered(np.asarray(members), facets)
        if len(found):
            boundaries.setdefault(name, found)
    return used(Parts(points, cells, boundaries))


def _anticlockwise(points: Floats, cells: Ints) -> Ints:
    """The cells, those with a negative area numbered the other way round."""
    element = Element.of(cells.shape[1])
    x, y = np.moveaxis(points[cells[:, : element.corners]], 2, 0)
    clockwise = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) < 0
    return np.where(clockwise[:, None], cells[:, element.mirrored], cells)


def _require_order(points: Floats, cells: Ints) -> None:
    """Mid-side nodes lie between their corners, and the corners of straight cells go around."""
    element = Element.of(cells.shape[1])
    sides = points[cells[:, element.edges]]
    along = sides[:, :, -1] - sides[:, :, 0]
    off = np.linalg.norm(sides[:, :, 1:-1] - (sides[:, :, :1] + along[:, :, None] / 2), axis=-1)
    stray = np.flatnonzero((off >= np.linalg.norm(along, axis=2)[:, :, None] / 2).any(axis=(1, 2)))[:1].tolist()
    allowed = "corners first, then mid-sides, each between its two corners (in the circle over its edge)"
    require(not stray, "mesh node order of cell", stray, allowed)
    if not element.quadratic:
        before = np.roll(along, 1, axis=1)
        turn = before[..., 0] * along[..., 1] - before[..., 1] * along[..., 0]
        folded = np.flatnonzero((turn <= 0).any(axis=1))[:1].tolist()
        require(not folded, "mesh node order of cell", folded, "around a triangle or a convex quadrilateral")


def _with_middle(name: str, edges: Ints, facets: Facets) -> Ints:
    """The facets that have the ends (f, 2), or all nodes (f, 3) in whatever order."""
    require(len(edges) > 0, f"mesh boundary {name!r}", "empty", "at least one edge")
    found = facets.find(edges)
    lost = edges[found < 0][:1].tolist()
    require(not lost, f"mesh boundary {name!r}", lost, "edges of cells")
    return facets.nodes[found]


def _covered(members: Ints, facets: Facets) -> Ints:
    """The outer edges (f, n) between nodes of a set, none if they leave one out: then it is a set of another use."""
    found = facets.nodes[np.isin(facets.nodes, members).all(axis=1) & ~facets.shared]
    return found if np.isin(members, found).all() else found[:0]
