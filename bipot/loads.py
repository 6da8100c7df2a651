r"""Loads (1)-(3): what acts on the body from outside but the tools, each a magnitude times an amplitude of pseudo-time.

Body forces and tractions are given for the volume and area at rest and keep their direction: their nodal forces are
found once. A pressure acts on the surface where equilibrium is asked, along its normal there, so it follows the body.
On a meridian nodal forces are those of the full ring; a body force or traction along the radius is one all around.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from bipot.errors import LARGEST_STRESS, require, require_count, require_magnitude, require_number, require_type
from bipot.fem.elements import Reference
from bipot.fem.kinematics import gradients
from bipot.fem.reduction import Geometry
from bipot.fem.surface import edge_mass, outward_area, outward_area_by_nodes
from bipot.mesh import Mesh
from bipot.typing import Floats, Ints, as_numbers

LARGEST_MULTIPLE = 1e12


@dataclass(frozen=True)
class Amplitude:
    """A multiple of pseudo-time, piecewise linear through the ``points`` (tau, multiple), tau rising from 0 to 1.

    >>> Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 0.2))).at(0.75)
    0.6
    """

    points: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 1.0))

    def __post_init__(self) -> None:
        allowed = "pairs (tau, multiple) with tau increasing from 0 to 1"
        table = as_numbers(self.points, "amplitude.points")
        require(table.ndim == 2 and table.shape[1] == 2 and len(table) > 1, "amplitude.points", self.points, allowed)
        tau = table[:, 0]
        rising = bool(np.isfinite(table).all() and (np.diff(tau) > 0).all() and tau[0] == 0 and tau[-1] == 1)
        require(rising, "amplitude.points", self.points, allowed)
        for multiple in table[:, 1].tolist():
            require_magnitude(multiple, "amplitude.points, a multiple", LARGEST_MULTIPLE)
        object.__setattr__(self, "points", tuple((float(t), float(m)) for t, m in table))

    def at(self, tau: float) -> float:
        """The multiple at ``tau``."""
        taus, multiples = zip(*self.points, strict=True)
        return float(np.interp(tau, taus, multiples))


RAMP = Amplitude()


@dataclass(frozen=True)
class Place:
    """The body at rest that loads act on."""

    mesh: Mesh
    geometry: Geometry
    reference: Reference


@runtime_checkable
class Load(Protocol):
    """Something that acts on the body."""

    @property
    def amplitude(self) -> Amplitude:
        """Times what it is at its full magnitude."""
        ...

    def check(self, mesh: Mesh) -> None:
        """Raise SceneError where the mesh has no such place."""
        ...


@runtime_checkable
class Dead(Load, Protocol):
    """A load whose nodal forces the motion of the body leaves alone."""

    def forces(self, place: Place) -> Floats:
        """Nodal forces (a, d) at multiple one."""
        ...


@dataclass(frozen=True)
class BodyForce:
    """A force ``vector`` (d,) a unit of volume at rest, on the whole body: weight is density times gravity."""

    vector: tuple[float, float]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        _check(self, "body force")

    def check(self, mesh: Mesh) -> None:
        """It acts everywhere."""

    def forces(self, place: Place) -> Floats:
        """int N_a b dV."""
        mesh = place.mesh
        volume = gradients(mesh.nodes, mesh.elements, place.reference, place.geometry).volume
        share = np.bincount(mesh.elements.ravel(), (volume @ place.reference.values).ravel())
        return np.outer(share, self.vector)


@dataclass(frozen=True)
class Traction:
    """A force ``vector`` (d,) a unit of area at rest, on the mesh boundary ``boundary``; it keeps its direction."""

    boundary: str
    vector: tuple[float, float]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        _check(self, "traction")

    def check(self, mesh: Mesh) -> None:
        """The boundary is one of the mesh's surface."""
        _surface(self.boundary, mesh, "traction.boundary")

    def forces(self, place: Place) -> Floats:
        """int N_a t dA."""
        edges, out = place.mesh.boundary(self.boundary), np.zeros(place.mesh.nodes.shape)
        share = edge_mass(place.mesh.nodes, edges, place.geometry).sum(axis=2)
        np.add.at(out, edges, share[..., None] * np.array(self.vector))
        return out


@dataclass(frozen=True)
class PointForce:
    """A force ``vector`` (d,) on a ``node``; on a meridian that of the full ring."""

    node: int
    vector: tuple[float, float]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        require_count(self.node, "point force.node", 0)
        object.__setattr__(self, "node", int(self.node))
        _check(self, "point force")

    def check(self, mesh: Mesh) -> None:
        """The node exists."""
        require(self.node < len(mesh.nodes), "point force.node", self.node, f"in [0, {len(mesh.nodes)})")

    def forces(self, place: Place) -> Floats:
        """The vector at the node."""
        out = np.zeros(place.mesh.nodes.shape)
        out[self.node] = self.vector
        return out


@dataclass(frozen=True)
class Pressure:
    """A pressure on the mesh boundary ``boundary``, into the body along its normal where equilibrium is asked."""

    boundary: str
    pressure: float
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        require_number(self.pressure, "pressure.pressure")
        object.__setattr__(self, "pressure", float(self.pressure))
        require_magnitude(self.pressure, "pressure.pressure", LARGEST_STRESS)
        _check(self, "pressure")

    def check(self, mesh: Mesh) -> None:
        """The boundary is one of the mesh's surface."""
        _surface(self.boundary, mesh, "pressure.boundary")


@dataclass(frozen=True)
class Loading:
    """The loads of a body, ready to be asked for nodal forces."""

    place: Place
    loads: Sequence[Load] = field(default=())

    def forces(self, nodes: Floats, tau: float) -> Floats:
        """Nodal forces (a, d) on the configuration ``nodes`` (a, d) at ``tau``."""
        out = np.zeros(nodes.shape)
        for load, dead in self._dead:
            out += load.amplitude.at(tau) * dead
        for load, edges, _ in self._followers:
            area = outward_area(nodes, edges, self.place.geometry)
            np.add.at(out, edges, -load.amplitude.at(tau) * load.pressure * area)
        return out

    def add_stiffness(self, K: Floats, nodes: Floats, tau: float) -> None:
        """Add minus the derivative of the forces with respect to ``nodes`` to element matrices K (e, dk, dk)."""
        for load, edges, owner in self._followers:
            slopes = outward_area_by_nodes(nodes, edges, self.place.geometry)
            number = np.argmax(self.place.mesh.elements[owner][:, None, :] == edges[:, :, None], axis=2)
            dofs = (2 * number[:, :, None] + np.arange(2)).reshape(len(edges), -1)
            at = owner[:, None, None], dofs[:, :, None], dofs[:, None, :]
            np.add.at(K, at, load.amplitude.at(tau) * load.pressure * slopes)

    @cached_property
    def _dead(self) -> list[tuple[Dead, Floats]]:
        return [(load, load.forces(self.place)) for load in self.loads if isinstance(load, Dead)]

    @cached_property
    def _followers(self) -> list[tuple[Pressure, Ints, Ints]]:
        """Pressures with their edges (f, 3), run anticlockwise, and whose elements they are (f,)."""
        return [(load, *self.place.mesh.surface(load.boundary)) for load in self.loads if isinstance(load, Pressure)]


def _check(load: BodyForce | Traction | PointForce | Pressure, what: str) -> None:
    require_type(load.amplitude, Amplitude, f"{what}.amplitude")
    if not isinstance(load, Pressure):
        vector = as_numbers(load.vector, f"{what}.vector")
        finite = vector.shape == (2,) and bool(np.isfinite(vector).all())
        require(finite, f"{what}.vector", load.vector, "two finite numbers")
        require_magnitude(float(np.abs(vector).max()), f"{what}.vector", LARGEST_STRESS)
        object.__setattr__(load, "vector", (float(vector[0]), float(vector[1])))
    if not isinstance(load, BodyForce | PointForce):
        require_type(load.boundary, str, f"{what}.boundary")


def _surface(boundary: str, mesh: Mesh, label: str) -> None:
    inner = mesh.inner_edges(boundary)[:1].tolist()
    require(not inner, label, boundary, f"edges of one element each; {inner} lies between two")
