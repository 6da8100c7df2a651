r"""What problem a run poses, whatever its mesh, and what refined meshes of that problem tend to.

The limits are those of ``docs/results/limits.csv`` (:mod:`studies.accuracy.limits`), which lies in the repository as
the studies do; the library is installed without either. They are of the seed's cylinder at two coefficients: a run of
anything else has none.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bipot.errors import SceneError
from bipot.meshes.mesh import Mesh
from bipot.paper import upsetting
from bipot.results import History
from bipot.results.description import describe
from bipot.scene.scene import Scene
from studies.accuracy.limits import Limit
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results" / "limits.csv"
FORCE = "force_N"

OF_THE_MESH = {"element", "quadrature", "volume", "configuration"}
"""What a description says of the discretisation, beside the sampling of tools."""

DIGITS = 9
"""Of lengths over the size of the body: what is the same shape."""


def problem_of(mesh: Mesh, description: Mapping[str, Any]) -> dict[str, Any]:
    """Shape, material, supports, loads and tools: what is the same in two runs that differ by their meshes alone.

    The shape is told by the extents of the named boundaries, which is enough for rectangles.
    """
    kept = {name: value for name, value in description.items() if name not in OF_THE_MESH}
    size = float(np.abs(mesh.nodes).max())
    kept["tools"] = [_tool(tool, size) for tool in kept["tools"]]
    corners = {name: mesh.nodes[mesh.boundary_nodes(name)] for name in sorted(mesh.boundaries)}
    extents = {name: _in_sizes([x.min(axis=0), x.max(axis=0)], size) for name, x in corners.items()}
    return json.loads(json.dumps({**kept, "size": float(f"{size:.{DIGITS}g}"), "extents": extents}))


def _tool(tool: Mapping[str, Any], size: float) -> dict[str, Any]:
    lengths = {name: _in_sizes(tool[name], size) for name in ("point", "travel")}
    return {name: value for name, value in tool.items() if name != "sampling"} | lengths


def _in_sizes(lengths: Any, size: float) -> list[Any]:
    return np.round(np.asarray(lengths) / size, DIGITS).tolist()


def of_run(run: History) -> dict[str, Any]:
    """The problem of a run."""
    return problem_of(run.mesh, run.scene)


def of_scene(scene: Scene) -> dict[str, Any]:
    """The problem of a scene."""
    return problem_of(scene.mesh, describe(scene))


def is_upsetting(run: History, **data: Any) -> bool:
    """Whether it is a run of :func:`~bipot.paper.upsetting` with ``data``, at its own friction and reduction."""
    if len(run.scene["tools"]) != 1:
        return False
    (tool,), height = run.scene["tools"], float(run.mesh.nodes[:, 1].max())
    try:
        scene = upsetting(mu=tool["mu"], reduction=-tool["travel"][1] / height, elements=1, **data)
    except SceneError:
        return False
    return of_scene(scene) == of_run(run)


def limits_of(run: History, path: Path = KEPT) -> list[Limit]:
    """Limits of the force by rising reduction: none where the run is not of the seed's cylinder, or not of a known mu.

    Raises:
        ResultsError: the table cannot be read.
    """
    if not is_upsetting(run):
        return []
    (tool,) = run.scene["tools"]
    known = [one for one in read_rows(path, Limit) if one.quantity == FORCE and one.mu == tool["mu"]]
    return sorted(known, key=lambda one: one.reduction)
