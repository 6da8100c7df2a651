"""Regions of a mesh with a material of their own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bipot.errors import require, require_type
from bipot.laws.material import Material
from bipot.meshes.mesh import Mesh
from bipot.typing import FrozenMap, Ints


def checked(regions: Mapping[str, Material], material: Material, mesh: Mesh) -> FrozenMap[str, Material]:
    """The materials of regions of the ``mesh``, beside the ``material`` of its other elements.

    Raises:
        SceneError: an unknown region, an element in two of them; a value that is no material; a material whose stress
            drifts off its yield surface.
    """
    require_type(regions, Mapping, "scene.regions")
    often = np.zeros(len(mesh.elements), dtype=int)
    for name, own in regions.items():
        often[mesh.region(name, "scene.regions, a name")] += 1
        require_type(own, Material, f"scene.regions[{name!r}]")
        require(not own.drifts, f"scene.regions[{name!r}]", own, "a material whose stress is returned")
    require(not (regions and material.drifts), "scene.material", material, "one whose stress is returned, with regions")
    twice = np.flatnonzero(often > 1)[:1]
    said = [name for name in regions if np.isin(twice, mesh.region(name)).any()]
    require(not twice.size, "scene.regions", f"{said} of element {twice.tolist()}", "one of each element")
    return FrozenMap(regions)


def parts_of(regions: Mapping[str, Material], mesh: Mesh) -> FrozenMap[str, Ints]:
    """The elements of each region and, by no name, those of none, if there are any."""
    own = {name: mesh.region(name) for name in regions}
    others = np.setdiff1d(np.arange(len(mesh.elements)), np.concatenate([*own.values(), np.empty(0, np.intp)]))
    return FrozenMap({"": others, **own} if len(others) else own)
