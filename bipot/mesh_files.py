"""Meshes of scikit-fem and of files (through meshio) as arrays: what a :class:`~bipot.mesh.Mesh` is made of.

Cells with four nodes get mid-sides, a ninth node is dropped, and so are nodes of no cell; cells numbered clockwise are
turned. What no plane mesh of quadrilaterals can come from is refused in words.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bipot.abaqus import plain_types
from bipot.errors import SceneError, require, require_type
from bipot.facets import Facets
from bipot.typing import Floats, Ints

QUADS = {"quad": 4, "quad8": 8, "quad9": 8}
"""Kinds of cells taken, and how many of their nodes."""

LINES = ("line", "line3")
IGNORED = ("vertex", *LINES)

TAGS = ("gmsh:physical", "medit:ref")
"""Cell data in which mesh files number boundaries; 0 is none."""

FORMATS = {".msh": "gmsh"}
"""Of endings that meshio knows for several programs, the one meant."""

REVERSED = [0, 3, 2, 1, 7, 6, 5, 4]
FLAT = 1e-12


class Parts(NamedTuple):
    """Nodes (a, 2), elements (e, 8) and edges (f, 3) by the boundary's name."""

    nodes: Floats
    elements: Ints
    boundaries: dict[str, Ints]


def of_skfem(mesh: Any) -> Parts:
    """A mesh of scikit-fem, MeshQuad or MeshQuad2, with its named boundaries."""
    import skfem

    kinds = (skfem.ElementQuad1, skfem.ElementQuad2)
    known = isinstance(mesh, skfem.MeshQuad) and mesh.elem in kinds
    require(known, "mesh", type(mesh).__name__, "a MeshQuad or MeshQuad2 of scikit-fem")
    if mesh.elem is skfem.ElementQuad2:
        points, cells = mesh.doflocs.T, mesh.dofs.element_dofs.T[:, :8]
    else:
        points, cells = mesh.p.T, mesh.t.T
    ends = np.asarray(mesh.facets).T
    return _parts(points, cells, {name: ends[np.asarray(f)] for name, f in (mesh.boundaries or {}).items()}, {})


def of_meshio(source: Any, tag: str | None, names: Mapping[str, int] | None) -> Parts:
    """A mesh of meshio, or of a file that it reads; ``tag`` and ``names`` as in ``Mesh.from_meshio``."""
    require(find_spec("meshio") is not None, "mesh", "a file", "read by meshio: pip install bipot[mesh]")
    import meshio

    mesh = source if isinstance(source, meshio.Mesh) else _read(source)
    cells = _quads(mesh)
    edges = _tagged(mesh, tag, names) | _sets_of_lines(mesh)
    return _parts(_flat(mesh.points, cells), cells, edges, mesh.point_sets)


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


def _quads(mesh: Any) -> Ints:
    """The cells (e, 4) or (e, 8), all of one kind."""
    blocks = [block for block in mesh.cells if block.type not in IGNORED and len(block.data)]
    kinds = sorted({block.type for block in blocks})
    require(len(kinds) > 0, "mesh cells", kinds, "quadrilaterals; there are none")
    solid = [block.type for block in blocks if block.dim == 3]
    require(not solid, "mesh cells", solid[:1], "of the plane: bodies in space have no contact here")
    allowed = f"all of one kind, one of {sorted(QUADS)}"
    require(len(kinds) == 1 and kinds[0] in QUADS, "mesh cells", kinds, allowed)
    return np.concatenate([block.data for block in blocks])[:, : QUADS[kinds[0]]].astype(np.intp)


def _flat(points: Any, cells: Ints) -> Floats:
    """Positions (a, 2) of the nodes (a, 2 or 3): a third coordinate is the same for all that cells use."""
    given = np.asarray(points)
    require(given.dtype.kind in "iuf", "mesh nodes", f"of type {given.dtype}", "numbers")
    points = given.astype(np.float64)
    require(points.ndim == 2 and points.shape[1] in (2, 3), "mesh nodes", points.shape, "of two or three coordinates")
    require(int(cells.max()) < len(points), "mesh cells", f"node index {cells.max()}", f"below {len(points)} nodes")
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


def _parts(points: Floats, cells: Ints, edges: dict[str, Ints], sets: Mapping[str, Any]) -> Parts:
    """The mesh of cells (e, 4) or (e, 8), edges (f, 2) or (f, 3), and sets of nodes."""
    given = cells.shape[1]
    cells = _anticlockwise(points, cells)
    if given == 4:
        points, cells = _with_mid_sides(points, cells)
    _require_order(points, cells, straight=given == 4)
    facets = Facets.of(cells)
    boundaries = {name: _with_middle(name, some, facets) for name, some in edges.items()}
    for name, members in sets.items():
        found = _covered(np.asarray(members), facets, given)
        if len(found):
            boundaries.setdefault(name, found)
    used, elements = np.unique(cells, return_inverse=True)
    number = np.full(len(points), -1, dtype=np.intp)
    number[used] = np.arange(len(used))
    return Parts(points[used], elements.reshape(cells.shape), {name: number[e] for name, e in boundaries.items()})


def _anticlockwise(points: Floats, cells: Ints) -> Ints:
    """The cells, those with a negative area numbered the other way round."""
    x, y = np.moveaxis(points[cells[:, :4]], 2, 0)
    clockwise = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) < 0
    back = [k for k in REVERSED if k < cells.shape[1]]
    return np.where(clockwise[:, None], cells[:, back], cells)


def _with_mid_sides(points: Floats, quads: Ints) -> tuple[Floats, Ints]:
    """Nodes and cells (e, 8) of straight cells (e, 4): a node in the middle of every edge."""
    ends = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2), axis=2)
    edges, which = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middle = points[edges].mean(axis=1)
    return np.vstack([points, middle]), np.hstack([quads, len(points) + which.reshape(quads.shape)])


def _require_order(points: Floats, cells: Ints, straight: bool) -> None:
    """Mid-side nodes lie between their corners, and the corners of straight cells go around."""
    corners, middle = points[cells[:, :4]], points[cells[:, 4:]]
    along = np.roll(corners, -1, axis=1) - corners
    off = np.linalg.norm(middle - corners - along / 2, axis=2)
    stray = np.flatnonzero((off >= np.linalg.norm(along, axis=2) / 2).any(axis=1))[:1].tolist()
    allowed = "corners first, then mid-sides, each between its two corners (in the circle over its edge)"
    require(not stray, "mesh node order of cell", stray, allowed)
    if straight:
        before = np.roll(along, 1, axis=1)
        turn = before[..., 0] * along[..., 1] - before[..., 1] * along[..., 0]
        folded = np.flatnonzero((turn <= 0).any(axis=1))[:1].tolist()
        require(not folded, "mesh node order of cell", folded, "around a convex quadrilateral")


def _with_middle(name: str, edges: Ints, facets: Facets) -> Ints:
    """The edges (f, 3) as end, middle, end, of ends (f, 2), or of all three nodes (f, 3) in whatever order."""
    require(len(edges) > 0, f"mesh boundary {name!r}", "empty", "at least one edge")
    found = facets.find(edges) if edges.shape[1] == 3 else _between(edges, facets)
    lost = edges[found < 0][:1].tolist()
    require(not lost, f"mesh boundary {name!r}", lost, "edges of cells")
    return facets.nodes[found]


def _between(ends: Ints, facets: Facets) -> Ints:
    """Which facet has the ends (f, 2); -1 if none."""
    ends, own = np.sort(ends, axis=1), np.sort(facets.nodes[:, [0, 2]], axis=1)
    unit = [int(max(ends.max(), own.max())) + 1, 1]
    order = np.argsort(own @ unit)
    found = order[np.searchsorted((own @ unit)[order], ends @ unit).clip(max=len(order) - 1)]
    return np.where((own[found] == ends).all(axis=1), found, -1)


def _covered(members: Ints, facets: Facets, given: int) -> Ints:
    """The outer edges (f, 3) between nodes of a set, none if they leave one out: then it is a set of another use."""
    asked = [0, 2] if given == 4 else [0, 1, 2]
    found = facets.nodes[np.isin(facets.nodes[:, asked], members).all(axis=1) & ~facets.shared]
    return found if np.isin(members, found[:, asked]).all() else found[:0]
