"""Whether two scenes, meshes, states or parameters are the same, to the last bit: a run is resumed with no others."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from bipot.errors import SceneError, require
from bipot.meshes.mesh import Mesh
from bipot.response import State
from bipot.results.description import describe
from bipot.scene.scene import Scene


def as_json(value: object) -> str:
    """JSON text, for comparing values that read back as another type, or are no numbers."""
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
    """Whether two meshes are the same bit by bit, boundaries included."""
    same = np.array_equal(one.nodes, other.nodes) and np.array_equal(one.elements, other.elements)
    names = list(one.boundaries) == list(other.boundaries)
    return same and names and all(np.array_equal(one.boundary(name), other.boundary(name)) for name in one.boundaries)
