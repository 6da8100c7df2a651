"""A drawn scene turned about the origin, whose supports and planes of symmetry are along no axis, and its results.

What it finds is turned back, and judged as what the scene finds that it is made of.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.typing import Floats
from studies.fuzz.placed import drives
from studies.fuzz.surfaces import Seen
from studies.fuzz.variants import Variant, loads_seen
from studies.independent.data import mandel_to_full


@dataclass(frozen=True, kw_only=True)
class Turned(Variant):
    """The scene of which the ``original`` is turned."""

    original: Scene

    @property
    def read_in(self) -> Scene:
        """As :attr:`Variant.read_in`: the original."""
        return self.original

    def read_vectors(self, vectors: Floats) -> Floats:
        """As :meth:`Variant.read_vectors`."""
        return self.back(vectors)

    def nodal(self, vectors: Floats) -> Floats:
        """As :meth:`Variant.nodal`: what is read is turned back."""
        return vectors

    def read(self, state: State) -> State:
        """As :meth:`Variant.read`."""
        flow = state.flow
        return replace(
            state,
            nodes=self.back(state.nodes),
            du=self.back(state.du),
            stress=self._tensors(state.stress),
            plastic_strain=self._tensors(state.plastic_strain),
            flow=None if flow is None else replace(flow, strain=self._tensors(flow.strain)),
            translation=self.ways(state.translation),
            translated=self.ways(state.translated),
        )

    def ways(self, ways: Floats) -> Floats:
        """As :meth:`Variant.ways`: the sides of the body, which levers are measured by, are others."""
        pairs = zip(drives(self.scene), drives(self.original), strict=True)
        return ways * np.array([one.spin / other.spin if one.spin else 1.0 for one, other in pairs])

    def _tensors(self, mandel: Floats) -> Floats:
        """Tensors (..., 4) turned back."""
        Q = np.eye(3)
        Q[:2, :2] = self.seen.matrix
        full = Q.T @ mandel_to_full(mandel) @ Q
        return np.concatenate([np.diagonal(full, axis1=-2, axis2=-1), np.sqrt(2) * full[..., 0, 1, None]], axis=-1)


def turned(scene: Scene, angle: float) -> Turned:
    """By an ``angle`` anticlockwise about the origin."""
    seen, mesh = Seen.turned(angle), scene.mesh
    other = replace(
        scene,
        mesh=Mesh(seen.points(mesh.nodes), mesh.elements, mesh.boundaries, mesh.regions),
        tools=tuple(map(seen.tool, scene.tools)),
        supports=tuple(map(seen.support, scene.supports)),
        loads=loads_seen(scene, seen),
    )
    return Turned("turned", other, np.arange(len(mesh.nodes)), seen, 1.0, 1.0, original=scene)
