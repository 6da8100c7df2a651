"""The description of a run in its file: the scene in plain numbers and words, and the versions used.

A run is resumed only with a scene, mesh, state and parameters that are the same by this description and their arrays,
to the last bit.
"""

from __future__ import annotations

import json
import platform
import re
import sys
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from bipot.errors import SceneError, require
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import VonMises
from bipot.meshes.mesh import Mesh
from bipot.scene.drives import lever
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.state import State
from bipot.tools.deformable import DeformableTool
from bipot.tools.poses import Turn
from bipot.tools.surfaces import Plane, Surface
from bipot.tools.tool import Tool
from bipot.typing import Ints

Parameters = Mapping[str, Any]
"""The parameters that identify a run: JSON values by name."""

PLACE = re.compile(r" at 0x[0-9a-fA-F]+>")
"""The end of a repr that identifies an object by its address in memory alone."""

PACKAGES = ("bipot", "numpy", "scipy", "cvxpy", "clarabel")


def versions() -> dict[str, str]:
    """Versions of this package, of its numerical dependencies, and of Python."""
    return {**{name: version(name) for name in PACKAGES}, "python": platform.python_version()}


@np.printoptions(threshold=sys.maxsize, floatmode="unique")
def describe(scene: Scene) -> dict[str, Any]:
    """The scene in plain numbers and words; arrays of materials and loads are whole and exact."""
    material = scene.material
    perfect = isinstance(material, VonMises) and isinstance(material.hardening, Perfect)
    return {
        "geometry": scene.geometry.value,
        "element": scene.mesh.element.value,
        "quadrature": scene.rule.value,
        "volume": scene.volume_change.value,
        "configuration": scene.configuration.value,
        "young": material.elasticity.young,
        "poisson": material.elasticity.poisson,
        "yield_stress": float(material.yield_stress(np.zeros(1))[0]),
        "material": repr(material),
        "regions": {name: repr(own) for name, own in scene.regions.items()},
        "perfectly_plastic": not scene.regions and perfect,
        "supports": [_support(s) for s in scene.supports],
        "loads": [repr(load) for load in scene.loads],
        "tools": [
            {
                **_surface(t),
                **{name: getattr(t, name) for name in ("travel", "path", "candidates", "mu", "shear")},
                "mu_at": {str(node): mu for node, mu in t.mu_at.items()},
                "shear_at": {str(node): shear for node, shear in t.shear_at.items()},
                "sampling": t.sampling.value,
                **({} if t.turn is None else _turn(scene, t.turn, t.face)),
                "driven_by": t.driven_by and {"vector": t.driven_by.vector, "amplitude": t.driven_by.amplitude.points},
            }
            for t in scene.tools
        ],
    }


def require_told(scene: Scene, **said: object) -> None:
    """Refuse values ``said`` that are no JSON, and objects of users' classes with a repr of only their address.

    An address differs from process to process.
    """
    for name, given in said.items():
        require_json(name, given)
    parts = {
        "material": (scene.material,),
        "regions": scene.regions.values(),
        "loads": scene.loads,
        "tools": [tool.face for tool in scene.tools],
    }
    for name, values in parts.items():
        for value in values:
            allowed = "told by a repr that holds the numbers of its classes, as that of a dataclass does"
            require(PLACE.search(repr(value)) is None, f"scene.{name}", value, allowed)


def _turn(scene: Scene, turn: Turn, surface: Surface) -> dict[str, Any]:
    """A turn in words; if a moment drives it, with the lever that multiplies its angle in ``translation``."""
    said = {"turn": repr(turn)}
    return said if turn.driven_by is None else {**said, "lever": lever(surface, turn, scene.mesh.size)}


def _surface(tool: Tool) -> dict[str, Any]:
    """A plane's numbers by name, boundaries of the mesh by theirs, any other surface in words."""
    surface = tool.face
    if isinstance(tool, DeformableTool):
        return {"boundaries": tool.surface}
    if isinstance(surface, Plane):
        return {"point": surface.point, "normal": surface.normal}
    return {"surface": repr(surface)}


def _support(support: Support) -> dict[str, Any]:
    """The boundary of a support, whether it is a plane of symmetry, and its motion if it is driven."""
    said = {"boundary": support.boundary, "direction": support.direction, "symmetry": isinstance(support, Symmetry)}
    if not isinstance(support, Prescribed):
        return said
    return {**said, "displacement": support.displacement, "amplitude": support.amplitude.points}


def as_json(value: object) -> str:
    """JSON text, by which values compare that are read back as another type, or are NaN."""
    return json.dumps(value, sort_keys=True)


def require_json(name: str, given: object) -> None:
    """Refuse anything but a mapping of JSON values by name."""
    require(isinstance(given, Mapping) and all(isinstance(key, str) for key in given), name, given, "values by name")
    try:
        as_json(dict(given))  # type: ignore[call-overload]
    except (TypeError, ValueError, RecursionError) as error:
        raise SceneError(f"{name}: must be JSON values ({error})") from error


def same_scene(one: Scene, other: Scene) -> bool:
    """Whether the descriptions of two scenes and their meshes are the same."""
    return one is other or (as_json(describe(one)) == as_json(describe(other)) and same_mesh(one.mesh, other.mesh))


def same_state(one: State, other: State) -> bool:
    """Whether two states are the same bit by bit, except for the flow that led there."""
    arrays = [name for name, value in vars(one).items() if isinstance(value, np.ndarray)]
    same = (np.array_equal(getattr(one, name), getattr(other, name)) for name in arrays)
    return one is other or (one.tau == other.tau and all(same))


def same_mesh(one: Mesh, other: Mesh) -> bool:
    """Whether two meshes are the same bit by bit, boundaries and regions included."""
    same = np.array_equal(one.nodes, other.nodes) and np.array_equal(one.elements, other.elements)
    return same and _same_named(one.boundaries, other.boundaries) and _same_named(one.regions, other.regions)


def _same_named(one: Mapping[str, Ints], other: Mapping[str, Ints]) -> bool:
    """Whether arrays by name are the same, in the same order."""
    return list(one) == list(other) and all(np.array_equal(one[name], other[name]) for name in one)
