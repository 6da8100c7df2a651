"""A body in space with its mirror image in a plane of symmetry, meshed on both sides, without that plane.

Nothing here asks the library what a plane of symmetry does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.deformable import AnyTool
from bipot.typing import Floats, Ints
from studies.fuzz.solid_held import direction_of, nodes_of
from studies.fuzz.solid_surfaces import cut
from studies.fuzz.solid_turned import Turned
from studies.fuzz.solid_variants import SolidVariant
from studies.fuzz.unfolded import HELD, IMAGE, SYMMETRIC


@dataclass(frozen=True, kw_only=True)
class Unfolded(SolidVariant):
    """The whole body: ``image`` (a,) is the original nodes' mirror image, ``across`` the normal of the plane."""

    image: Ints
    across: Floats

    def comparable(self, forces: Floats) -> Floats:
        """As :meth:`SolidVariant.comparable`: on nodes in the plane the image takes what goes across it."""
        in_plane = (self.weight == 2) * (forces @ self.across)[..., None]
        return forces - in_plane * self.across

    def tells(self, nodes: Floats) -> bool:
        """Whether the answer is symmetric: in a long increment a whole body has others too, and may well take one."""
        moved = nodes - self.scene.mesh.nodes
        mine, theirs = moved[self.number], Turned.mirrored(self.across, 0.0).turn @ moved[self.image].T
        blur = 8 * float(np.finfo(np.float64).eps) * float(np.abs(nodes).max())
        return bool(np.abs(mine - theirs.T).max() <= SYMMETRIC * np.abs(moved).max() + blur)


def unfolded(scene: Scene, plane: Symmetry) -> Unfolded:
    """The scene unfolded about one plane; nodes, tools, loads and supports that it had come first, by their numbers."""
    mesh, way = scene.mesh, direction_of(plane)
    on, count = nodes_of(scene, plane), len(mesh.nodes)
    at = float((mesh.nodes[on] @ way).mean())
    seen, image = Turned.mirrored(way, at), np.arange(count)
    off = np.setdiff1d(image, on)
    image[off] = count + np.arange(len(off))
    whole = [_tools(tool, cut(tool, way, at), seen, image) for tool in scene.tools]
    kept = [own for own in scene.supports if own != plane]
    other = replace(
        scene,
        mesh=_mesh(mesh, plane, seen, image),
        supports=(
            Support(HELD, plane.direction),
            *(s for own in kept for s in (own, replace(seen.support(own), boundary=own.boundary + IMAGE))),
        ),
        tools=(*(tools[0] for tools in whole), *(tool for tools in whole for tool in tools[1:])),
        loads=tuple(part for load in scene.loads for part in _loads(load, seen, image)),
    )
    # A tool that the plane cuts pushes the nodes in it from both sides.
    weight = np.ones((len(whole), count, 1))
    for k, tools in enumerate(whole):
        weight[k, on] = 3 - len(tools)
    own = np.arange(count)
    return Unfolded("unfolded", other, own, np.eye(3), weight=weight, image=image, across=way)


def _mesh(mesh: Mesh, plane: Symmetry, seen: Turned, image: Ints) -> Mesh:
    """Both sides; every boundary and its image, and one face of the plane."""
    added = np.flatnonzero(image >= len(mesh.nodes))
    beyond = mesh.nodes[added] @ seen.turn.T + seen.shift
    images = {name + IMAGE: image[faces] for name, faces in mesh.boundaries.items()}
    return Mesh(
        np.vstack([mesh.nodes, beyond]),
        np.vstack([mesh.elements, image[mesh.elements][:, mesh.element.mirrored]]),
        {**mesh.boundaries, **images, HELD: mesh.boundaries[plane.boundary][:1]},
        {name: np.concatenate([own, own + len(mesh.elements)]) for name, own in mesh.regions.items()},
    )


def _tools(tool: AnyTool, whole: bool, seen: Turned, image: Ints) -> tuple[AnyTool, ...]:
    """The ``whole`` of a tool that the plane cuts, with the force that drives it whole, or the tool and its image."""
    names = tuple(name + IMAGE for name in tool.candidates)
    mu_at, shear_at = (
        {int(image[a]): value for a, value in by_node.items()} for by_node in (tool.mu_at, tool.shear_at)
    )
    if whole:
        both = {"mu_at": {**tool.mu_at, **mu_at}, "shear_at": {**tool.shear_at, **shear_at}}
        return (replace(tool, candidates=(*tool.candidates, *names), **both),)
    return tool, replace(seen.tool(tool), candidates=names, mu_at=mu_at, shear_at=shear_at)


def _loads(load: Load, seen: Turned, image: Ints) -> tuple[Load, ...]:
    """A load and its image; of a point force in the plane their sum."""
    if isinstance(load, BodyForce):
        return (load,)
    if isinstance(load, PointForce):
        if image[load.node] == load.node:
            return (replace(load, vector=tuple((2 * np.array(load.vector)).tolist())),)
        vector = seen.way(load.vector)
        return load, replace(load, node=int(image[load.node]), vector=vector)
    other = seen.load(load)
    assert isinstance(other, Traction | Pressure)
    return load, replace(other, boundary=other.boundary + IMAGE)
