"""Several meshes as one, whose parts only touch: bodies and deformable tools; and each of them by itself again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bipot.errors import require, require_type
from bipot.meshes.mesh import Mesh
from bipot.typing import Ints


def together(meshes: Mapping[str, Mesh]) -> Mesh:
    """One mesh of several parts, of one kind of element, each of which is a region of its name.

    Boundaries and regions of a part keep their names after its own: ``punch/base``. The regions come before the part,
    so that pictures that show the first region of an element show these.

    Raises:
        SceneError: no mesh, another type, elements of two kinds, one name for two boundaries or regions.

    >>> from bipot.meshes.sections import block
    >>> together({"one": block(1.0, 1.0, 1, 1), "other": block(2.0, 1.0, 2, 1)})
    Mesh(3 Q4 elements, 10 nodes; boundaries one/base, one/left, one/right, one/top, other/base, other/left, \
other/right, other/top; regions one, other)
    """
    require_type(meshes, Mapping, "meshes")
    require(len(meshes) > 0, "meshes", dict(meshes), "at least one mesh, by name")
    boundaries, regions, nodes, elements = {}, {}, [np.empty((0, 0))], [np.empty((0, 0), np.intp)]
    kinds = list[str]()
    at, of = 0, 0
    for part, mesh in meshes.items():
        require_type(part, str, "meshes, a name")
        require_type(mesh, Mesh, f"meshes[{part!r}]")
        kinds.append(mesh.element.name)
        own = {f"{part}/{name}": facets + at for name, facets in mesh.boundaries.items()}
        members = {f"{part}/{name}": members + of for name, members in mesh.regions.items()}
        twice = sorted({*own} & {*boundaries} | ({part, *members} & {*regions}))
        require(not twice, f"meshes[{part!r}]", twice[:1], "boundaries and regions of names that no part before has")
        boundaries |= own
        regions |= {**members, part: of + np.arange(len(mesh.elements))}
        nodes.append(mesh.nodes)
        elements.append(mesh.elements + at)
        at, of = at + len(mesh.nodes), of + len(mesh.elements)
    require(len(set(kinds)) == 1, "meshes", kinds, "of one kind of element: mesh.to(element) changes it")
    return Mesh(np.concatenate(nodes[1:]), np.concatenate(elements[1:]), boundaries, regions)


class Part(NamedTuple):
    """A part of a mesh as a ``mesh`` of its own, and the numbers that its ``nodes`` (n,) and ``elements`` (m,) had.

    Boundaries and regions have the names that they had, and of their facets and elements what is in the part.
    """

    mesh: Mesh
    nodes: Ints
    elements: Ints

    @staticmethod
    def of(mesh: Mesh, elements: Ints) -> Part:
        """Of some elements (m,) that have no node in common with others."""
        nodes, number = np.unique(mesh.elements[elements], return_inverse=True)
        inside, at = np.zeros(len(mesh.nodes), dtype=bool), np.zeros(len(mesh.nodes), np.intp)
        inside[nodes], at[nodes] = True, np.arange(len(nodes))
        facets = {name: at[of[inside[of[:, 0]]]] for name, of in mesh.boundaries.items()}
        regions = {name: np.flatnonzero(np.isin(elements, of)) for name, of in mesh.regions.items()}
        own = Mesh(
            nodes=mesh.nodes[nodes],
            elements=number.reshape(-1, mesh.elements.shape[1]),
            boundaries={name: of for name, of in facets.items() if len(of)},
            regions={name: of for name, of in regions.items() if len(of)},
        )
        return Part(own, nodes, elements)


def parts(mesh: Mesh, field: str = "mesh") -> dict[str, Part]:
    """The parts of a mesh that are not connected, by the names of the regions that they are; one of no name if it is.

    Raises:
        SceneError: a part of several that is no region, naming the ``field``.
    """
    if not mesh.connected.any():
        return {"": Part.of(mesh, np.arange(len(mesh.elements)))}
    found = dict[str, Part]()
    for k in range(int(mesh.connected.max()) + 1):
        own = np.flatnonzero(mesh.connected == k)
        names = [name for name, of in mesh.regions.items() if np.array_equal(of, own)]
        allowed = "of parts each of which is a region, as `together` makes them"
        require(bool(names), field, f"with a part of element {own[0]} that is none", allowed)
        part = Part.of(mesh, own)
        # Of several, that of the most boundaries and regions: one of its regions may be all of it, too.
        given = [*part.mesh.boundaries, *part.mesh.regions]
        found[max(names, key=lambda name: sum(of.startswith(f"{name}/") for of in given))] = part
    return found


def apart(mesh: Mesh) -> dict[str, Mesh]:
    """The meshes that :func:`together` has joined, by their names, each with the names that it had then.

    Raises:
        SceneError: another type, a mesh that is connected, or a part of it that is no region.

    >>> from bipot.meshes.sections import block
    >>> apart(together({"one": block(1.0, 1.0, 1, 1), "other": block(2.0, 1.0, 2, 1)}))["other"]
    Mesh(2 Q4 elements, 6 nodes; boundaries base, left, right, top)
    """
    require_type(mesh, Mesh, "mesh")
    require(bool(mesh.connected.any()), "mesh", mesh, "of several parts")
    found = dict[str, Mesh]()
    for name, part in parts(mesh).items():
        own, before = part.mesh, f"{name}/"
        boundaries = {other.removeprefix(before): of for other, of in own.boundaries.items()}
        regions = {other.removeprefix(before): of for other, of in own.regions.items() if other != name}
        found[name] = Mesh(own.nodes, own.elements, boundaries, regions)
    return found
