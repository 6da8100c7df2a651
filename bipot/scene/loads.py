r"""Loads (1)-(3) on the body, apart from tools, each a magnitude times an amplitude over pseudo-time.

Body forces and tractions are given per volume and area at rest and keep their direction, so their nodal forces are
computed once. A pressure acts on the surface in the configuration of equilibrium, along its normal, so it follows the
body. On a meridian nodal forces are those of the full ring; a radial body force or traction is axisymmetric.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from bipot.errors import LARGEST_STRESS, require, require_count, require_type
from bipot.fem.assembly import Space
from bipot.fem.surface import facet_mass, outward_area, outward_area_by_nodes
from bipot.meshes.mesh import Mesh
from bipot.paths import RAMP, Amplitude, require_bounded, require_components, vector
from bipot.typing import Floats, Ints, Vector, make_floats


@runtime_checkable
class Load(Protocol):
    """A load on the body."""

    @property
    def amplitude(self) -> Amplitude:
        """The multiple of its full magnitude over pseudo-time."""
        ...

    def check(self, mesh: Mesh) -> None:
        """Raise SceneError if the mesh has no such place."""
        ...


@runtime_checkable
class Dead(Load, Protocol):
    """A load whose nodal forces do not depend on the motion of the body."""

    def forces(self, space: Space) -> Floats:
        """Nodal forces (a, d) at multiple one."""
        ...


@dataclass(frozen=True)
class BodyForce:
    """A force ``vector`` (d,) per unit of volume at rest, on the whole body: weight is density times gravity."""

    vector: tuple[float, ...]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        _take_vector(self, "body force")

    def check(self, mesh: Mesh) -> None:
        """Require as many components as there are axes."""
        require_components(self.vector, mesh.dimension, "body force.vector")

    def forces(self, space: Space) -> Floats:
        """int N_a b dV."""
        mesh = space.mesh
        volume = space.gradients(mesh.nodes).volume
        share = np.bincount(mesh.elements.ravel(), (volume @ space.reference.values).ravel())
        return np.outer(share, self.vector)


@dataclass(frozen=True)
class Traction:
    """A force ``vector`` (d,) per unit of area at rest, on the mesh boundary ``boundary``; it keeps its direction."""

    boundary: str
    vector: tuple[float, ...]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        require_type(self.boundary, str, "traction.boundary")
        _take_vector(self, "traction")

    def check(self, mesh: Mesh) -> None:
        """Require as many components as there are axes, and a boundary on the mesh's surface."""
        require_components(self.vector, mesh.dimension, "traction.vector")
        mesh.require_outer("traction.boundary", self.boundary)

    def forces(self, space: Space) -> Floats:
        """int N_a t dA."""
        facets, out = space.mesh.boundary(self.boundary), np.zeros(space.mesh.nodes.shape)
        share = facet_mass(space.mesh.nodes, facets, space.geometry).sum(axis=2)
        np.add.at(out, facets, share[..., None] * np.array(self.vector))
        return out


@dataclass(frozen=True)
class PointForce:
    """A force ``vector`` (d,) on a ``node``; on a meridian that of the full ring."""

    node: int
    vector: tuple[float, ...]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        require_count(self.node, "point force.node", 0)
        object.__setattr__(self, "node", int(self.node))
        _take_vector(self, "point force")

    def check(self, mesh: Mesh) -> None:
        """Require as many components as there are axes, and a node of the mesh."""
        require_components(self.vector, mesh.dimension, "point force.vector")
        require(self.node < len(mesh.nodes), "point force.node", self.node, f"in [0, {len(mesh.nodes)})")

    def forces(self, space: Space) -> Floats:
        """The vector at the node."""
        out = np.zeros(space.mesh.nodes.shape)
        out[self.node] = self.vector
        return out


@dataclass(frozen=True)
class Pressure:
    """A pressure on the mesh boundary ``boundary``, into the body along its normal in equilibrium's configuration."""

    boundary: str
    pressure: float
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        require_type(self.boundary, str, "pressure.boundary")
        make_floats(self, "pressure", of="pressure.")
        require_bounded(self.pressure, self.amplitude, "pressure.pressure", LARGEST_STRESS)

    def check(self, mesh: Mesh) -> None:
        """Require a boundary on the mesh's surface."""
        mesh.require_outer("pressure.boundary", self.boundary)


def magnitude(load: Load) -> Vector:
    """The components that a load's amplitude multiplies, in the load's own units; (1,) for a load of another kind."""
    match load:
        case BodyForce() | Traction() | PointForce():
            return load.vector
        case Pressure():
            return (load.pressure,)
        case _:
            return (1.0,)


@dataclass(frozen=True)
class Loading:
    """The loads of a body, prepared to give nodal forces."""

    space: Space
    loads: Sequence[Load] = field(default=())

    def forces(self, nodes: Floats, tau: float) -> Floats:
        """Nodal forces (a, d) on the configuration ``nodes`` (a, d) at ``tau``."""
        out = np.zeros(nodes.shape)
        for load, dead in self._dead:
            out += load.amplitude.at(tau) * dead
        for load, facets, _ in self._followers:
            area = outward_area(nodes, facets, self.space.geometry)
            np.add.at(out, facets, -load.amplitude.at(tau) * load.pressure * area)
        return out

    def add_stiffness(self, K: Floats, nodes: Floats, tau: float) -> None:
        """Add minus the derivative of the forces with respect to ``nodes`` to element matrices K (e, dk, dk)."""
        d = nodes.shape[1]
        for load, facets, owner in self._followers:
            slopes = outward_area_by_nodes(nodes, facets, self.space.geometry)
            number = np.argmax(self.space.mesh.elements[owner][:, None, :] == facets[:, :, None], axis=2)
            dofs = (d * number[:, :, None] + np.arange(d)).reshape(len(facets), -1)
            at = owner[:, None, None], dofs[:, :, None], dofs[:, None, :]
            np.add.at(K, at, load.amplitude.at(tau) * load.pressure * slopes)

    @cached_property
    def _dead(self) -> list[tuple[Dead, Floats]]:
        dead = [(load, load.forces(self.space)) for load in self.loads if isinstance(load, Dead)]
        for load, forces in dead:
            shape = self.space.mesh.nodes.shape
            right = np.shape(forces) == shape and bool(np.isfinite(forces).all())
            allowed = f"finite, and of shape {shape}: those of nodes"
            require(right, f"forces of {type(load).__name__}", str(np.shape(forces)), allowed)
        return dead

    @cached_property
    def _followers(self) -> list[tuple[Pressure, Ints, Ints]]:
        """Pressures with their facets (f, n), anticlockwise, and the facets' elements (f,)."""
        return [(load, *self.space.mesh.surface(load.boundary)) for load in self.loads if isinstance(load, Pressure)]


def _take_vector(load: BodyForce | Traction | PointForce, what: str) -> None:
    """Convert the load's vector to plain numbers and check their magnitude; ``what`` names the load."""
    components = vector(load.vector, f"{what}.vector")
    object.__setattr__(load, "vector", components)
    require_bounded(max(map(abs, components)), load.amplitude, f"{what}.vector", LARGEST_STRESS)
