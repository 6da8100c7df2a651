"""Several meshes as one, whose parts only touch: bodies and deformable tools."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bipot.errors import require, require_type
from bipot.meshes.mesh import Mesh


def together(meshes: Mapping[str, Mesh]) -> Mesh:
    """One mesh of several parts, of one kind of element, each of which is a region of its name.

    Boundaries and regions of a part keep their names after its own: ``punch/base``.

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
        regions |= {part: of + np.arange(len(mesh.elements)), **members}
        nodes.append(mesh.nodes)
        elements.append(mesh.elements + at)
        at, of = at + len(mesh.nodes), of + len(mesh.elements)
    require(len(set(kinds)) == 1, "meshes", kinds, "of one kind of element: mesh.to(element) changes it")
    return Mesh(np.concatenate(nodes[1:]), np.concatenate(elements[1:]), boundaries, regions)
