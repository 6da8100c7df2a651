"""A scene with a plane of symmetry, and its mirror image meshed: the body on both sides, without that plane.

Nothing here asks the library what a plane of symmetry does.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.deformable import AnyTool
from bipot.typing import Floats, Ints
from studies.flat import axis_of
from studies.fuzz.surfaces import Seen, cut, pair
from studies.fuzz.variants import Variant, reflected

IMAGE = "'"
"""Ends the names of mirrored boundaries."""

HELD = "held in the plane"
"""The edge of the plane that is still held along its normal: nothing else need keep the whole body in its place."""

SYMMETRIC = 1e-7
"""Of the largest displacement: less than this off its mirror image, a displacement is symmetric."""


@dataclass(frozen=True)
class Unfolded(Variant):
    """The whole body: ``image`` (a,) is the original nodes' mirror image ``across`` a direction."""

    image: Ints = field(default_factory=lambda: np.empty(0, np.intp))
    across: int = 0

    def tells(self, nodes: Floats) -> bool:
        """Whether the answer is symmetric: in a long increment a whole body has others too, and may well take one."""
        moved = nodes - self.scene.mesh.nodes
        mine, theirs = moved[self.number], moved[self.image] * np.where(np.arange(2) == self.across, -1, 1)
        blur = 8 * float(np.finfo(np.float64).eps) * float(np.abs(nodes).max())
        return bool(np.abs(mine - theirs).max() <= SYMMETRIC * np.abs(moved).max() + blur)


def unfolded(scene: Scene) -> list[Unfolded]:
    """The scene unfolded about each of its planes of symmetry, one at a time."""
    return [about(scene, plane) for plane in scene.supports if isinstance(plane, Symmetry)]


def about(scene: Scene, plane: Symmetry) -> Unfolded:
    """The scene unfolded about one plane; nodes, tools, loads and supports that it had come first, by their numbers."""
    mesh, d = scene.mesh, axis_of(plane)
    on = np.unique(mesh.boundaries[plane.boundary])
    at = float(mesh.nodes[on, d].mean())
    off = np.setdiff1d(np.arange(len(mesh.nodes)), on)
    image = np.arange(len(mesh.nodes))
    image[off] = len(mesh.nodes) + np.arange(len(off))
    whole = [_tools(tool, d, at, image) for tool in scene.tools]
    other = replace(
        scene,
        mesh=_mesh(mesh, plane, at, image),
        supports=(
            Support(HELD, d),
            *(support for own in scene.supports if own != plane for support in _supports(own, plane)),
        ),
        tools=(*(tools[0] for tools in whole), *(tool for tools in whole for tool in tools[1:])),
        loads=tuple(part for load in scene.loads for part in _loads(load, d, image)),
    )
    # A tool that the plane cuts pushes the nodes in it from both sides.
    weight = np.ones((len(scene.tools), len(mesh.nodes), 1))
    for k, tools in enumerate(whole):
        weight[k, on] = 3 - len(tools)
    own = np.arange(len(mesh.nodes))
    return Unfolded("unfolded", other, own, Seen.scaled(1.0), 1.0, 1.0, weight, image, d)


def _mesh(mesh: Mesh, plane: Symmetry, at: float, image: Ints) -> Mesh:
    """Both sides; every boundary and its image, and one edge of the plane."""
    d, added = axis_of(plane), np.flatnonzero(image >= len(mesh.nodes))
    beyond = mesh.nodes[added].copy()
    beyond[:, d] = 2 * at - beyond[:, d]
    images = {name + IMAGE: image[edges] for name, edges in mesh.boundaries.items()}
    return Mesh(
        np.vstack([mesh.nodes, beyond]),
        np.vstack([mesh.elements, image[mesh.elements][:, reflected(mesh, d)]]),
        {**mesh.boundaries, **images, HELD: mesh.boundaries[plane.boundary][:1]},
        {name: np.concatenate([own, own + len(mesh.elements)]) for name, own in mesh.regions.items()},
    )


def _supports(support: Support, plane: Symmetry) -> tuple[Support, ...]:
    """A support and its image, which is itself in the plane."""
    if support.boundary == plane.boundary:
        return (support,)
    return support, replace(Seen.mirrored(axis_of(plane)).support(support), boundary=support.boundary + IMAGE)


def _tools(tool: AnyTool, d: int, at: float, image: Ints) -> tuple[AnyTool, ...]:
    """The whole of a tool that the plane cuts, with the force that drives it whole, or the tool and its image."""
    names = tuple(name + IMAGE for name in tool.candidates)
    mu_at, shear_at = (
        {int(image[a]): value for a, value in by_node.items()} for by_node in (tool.mu_at, tool.shear_at)
    )
    if cut(tool, d, at):
        both = {**tool.mu_at, **mu_at}, {**tool.shear_at, **shear_at}
        return (replace(tool, candidates=(*tool.candidates, *names), mu_at=both[0], shear_at=both[1]),)
    other = replace(tool, candidates=names, mu_at=mu_at, shear_at=shear_at)
    return tool, Seen.mirrored(d, at).tool(other)


def _loads(load: Load, d: int, image: Ints) -> tuple[Load, ...]:
    """A load and its image; of a point force in the plane their sum."""
    if isinstance(load, BodyForce):
        return (load,)
    if isinstance(load, Pressure):
        return load, replace(load, boundary=load.boundary + IMAGE)
    if isinstance(load, Traction):
        return load, replace(load, boundary=load.boundary + IMAGE, vector=_reversed(load.vector, d))
    if isinstance(load, PointForce):
        if image[load.node] == load.node:
            return (replace(load, vector=pair(2 * np.array(load.vector))),)
        return load, replace(load, node=int(image[load.node]), vector=_reversed(load.vector, d))
    raise TypeError(f"no mirror image known for {load!r}")


def _reversed(vector: tuple[float, ...], along: int) -> tuple[float, float]:
    """A vector with one of its components reversed."""
    return pair(np.where(np.arange(2) == along, -1.0, 1.0) * vector)
