"""The scene: body, material, supports, tools with friction, loading over pseudo-time, discretisation.

Everything here is a frozen dataclass that refuses bad input when it is made. The library is free of units: use any
consistent set (N, mm, MPa or N, m, Pa).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.errors import InvertedElement, SceneError, require, require_tuple, require_type
from bipot.fem.elements import RULES, Quadrature
from bipot.fem.orientation import AXIS, refuse_folded
from bipot.fem.projection import VOLUMES, VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.fem.strainless import Held
from bipot.laws.by_region import materials_of
from bipot.laws.material import Material, Materials
from bipot.meshes.mesh import Mesh
from bipot.paths import corners
from bipot.scene.between import Surroundings
from bipot.scene.between_faces import Skin
from bipot.scene.calipers import Calipers
from bipot.scene.deformable import require_facing, require_joined, require_nodes
from bipot.scene.drives import Drives
from bipot.scene.fitting import Fitted, require_coefficients, require_fitting
from bipot.scene.holding import Directions, Holding
from bipot.scene.itself import Itself
from bipot.scene.loads import Dead, Load, Pressure, Traction, magnitude
from bipot.scene.paces import Moved, Paces, paces_of
from bipot.scene.regions import checked, parts_of
from bipot.scene.supports import Prescribed, Support
from bipot.scene.symmetry import PLANAR, Mirror, planes_of, require_mirrored, require_outer
from bipot.tools.deformable import AnyTool, DeformableTool
from bipot.tools.poses import pose_size
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, FrozenMap, Ints

IN_SPACE = "of a base anticlockwise as seen from the top, and then that, as VTK does"
"""How the nodes of elements in space are numbered, in words."""

PARTS = {"supports": Support, "tools": Tool, "loads": Load}
"""What acts on a body, by the field of a scene that lists it."""


@dataclass(frozen=True)
class Scene:
    """One body with its supports, tools and loads. A ``Symmetry`` among the supports makes it a part of a larger body.

    The ``material`` is that of all elements but those in ``regions`` of the mesh that have one of their own.

    ``quadrature`` and the representation of the ``volume`` change are by default the element's own (:attr:`rule`,
    :attr:`volume_change`).

    Raises:
        SceneError: a wrong type, an unknown boundary, an inverted element, supports that hold every node or leave
            the axis free, a tool that can touch nothing, a coefficient at a node that is no candidate, anything that
            contradicts the planes of symmetry (:mod:`bipot.scene.symmetry`).
    """

    mesh: Mesh
    geometry: Geometry
    material: Material
    supports: tuple[Support, ...]
    tools: tuple[AnyTool, ...] = ()
    quadrature: Quadrature | None = None
    configuration: Configuration = Configuration.MIDPOINT
    loads: tuple[Load, ...] = ()
    volume: VolumeChange | None = None
    regions: Mapping[str, Material] = FrozenMap({})

    def __post_init__(self) -> None:
        self._check_types()
        self._check_boundaries()
        try:
            refuse_folded({"at rest": self.mesh.nodes}, self.mesh.elements, self.geometry)
        except InvertedElement as inverted:
            ordered = "anticlockwise, keep r > 0" if self.mesh.dimension == 2 else IN_SPACE
            raise SceneError(f"mesh: {inverted}: number nodes {ordered}") from inverted
        require_joined(self.mesh, self.tools)
        self.itself.require_apart()
        free = bool((~self.holding.held).any())
        require(free, "scene.supports", self.supports, "such that they leave a node free")
        self._check_axis()
        held = Held(self.mesh, self.geometry, self.holding.numbers, self.holding.axes)
        held.require_strained(self.rule, self.volume_change)
        for k, load in enumerate(self.loads):
            require(isinstance(load, Dead | Pressure), f"scene.loads[{k}]", load, "a load that gives its forces")
            load.check(self.mesh)
        fitted = Fitted(self.mesh, self.geometry, self.materials, self.holding, self.surroundings)
        require_nodes(self.mesh, self.tools)
        require_outer(self.mirrors, self.mesh, self.tools, self.loads)
        for k, tool in enumerate(self.tools):
            if isinstance(tool, DeformableTool):
                require_facing(self.mesh, self.ring, tool, f"tools[{k}]")
                require_coefficients(fitted, tool, f"tools[{k}]")
            else:
                require_fitting(fitted, tool, f"tools[{k}]")
        require_mirrored(self.planes, self.mesh, self.geometry, self.tools, self.loads)

    def _check_types(self) -> None:
        kinds = {"mesh": Mesh, "geometry": Geometry, "material": Material, "configuration": Configuration}
        for name, kind in kinds.items():
            require_type(getattr(self, name), kind, f"scene.{name}")
        object.__setattr__(self, "regions", checked(self.regions, self.material, self.mesh))
        require_type(self.quadrature, Quadrature, "scene.quadrature", optional=True)
        rules = RULES[self.mesh.element]
        allowed = f"a rule of {self.mesh.element.name}, one of {[rule.name for rule in rules]}"
        require(self.rule in rules, "scene.quadrature", self.rule, allowed)
        require_type(self.volume, VolumeChange, "scene.volume", optional=True)
        volumes = VOLUMES[self.mesh.element]
        allowed = f"one of {self.mesh.element.name}, of {[volume.name for volume in volumes]}"
        require(self.volume_change in volumes, "scene.volume", self.volume, allowed)
        same = self.geometry.reduction.dimension == self.mesh.dimension
        kind = "of a plane" if self.mesh.dimension == 2 else "SOLID"
        require(same, "scene.geometry", self.geometry, f"{kind}, as the nodes of the mesh have it")
        for name, kind in PARTS.items():
            field, given = f"scene.{name}", getattr(self, name)
            for k, part in enumerate(given if isinstance(given, tuple | list) else ()):
                place = next((other for other, its in PARTS.items() if isinstance(part, its)), name)
                require(place == name, f"{field}[{k}]", part, f"among the {place}")
            object.__setattr__(self, name, require_tuple(given, kind, field))

    def _check_boundaries(self) -> None:
        for k, tool in enumerate(self.tools):
            for field, names in tool.on_mesh.items():
                for name in names:
                    self.mesh.boundary(name, f"tools[{k}].{field}")
        for parts, given in (("supports", self.supports), ("loads", self.loads)):
            for k, part in enumerate(given):
                if isinstance(part, Support | Traction | Pressure):
                    self.mesh.boundary(part.boundary, f"{parts}[{k}].boundary")
        body = self.mesh, self.ring, self.mirrors
        tools = tuple(tool.of(*body) if isinstance(tool, DeformableTool) else tool for tool in self.tools)
        object.__setattr__(self, "tools", tools)

    @property
    def rule(self) -> Quadrature:
        """The chosen quadrature, or the element's own."""
        return self.quadrature or RULES[self.mesh.element][0]

    @property
    def volume_change(self) -> VolumeChange:
        """The chosen representation of the volume change, or the element's own."""
        return self.volume or VOLUMES[self.mesh.element][0]

    @cached_property
    def materials(self) -> Materials:
        """The material at all integration points (e, q): that of the body, or of its parts."""
        return materials_of([(self.regions.get(name, self.material), of) for name, of in self.parts.items()])

    @cached_property
    def parts(self) -> FrozenMap[str, Ints]:
        """The elements of each region with a material of its own, and by no name those of the others, if any."""
        return parts_of(self.regions, self.mesh)

    @property
    def ring(self) -> bool:
        """Whether the scene is the meridian of an axisymmetric body."""
        return self.geometry is Geometry.AXISYMMETRIC

    @cached_property
    def holding(self) -> Holding:
        """The displacements that all supports together hold or drive, node by node."""
        return Holding.of(self.supports, self.mesh)

    @cached_property
    def directions(self) -> Directions:
        """The directions along which supports and planes of symmetry keep the body as a whole, and those left free."""
        return Directions.of(self.supports, self.mesh.dimension, self.ring)

    @cached_property
    def planes(self) -> tuple[Mirror, ...]:
        """The planes of symmetry that cut the whole body."""
        return planes_of(self.mesh, self.geometry, self.supports)

    @cached_property
    def mirrors(self) -> tuple[Mirror, ...]:
        """The planes beyond which the body continues as its mirror image: those of symmetry, and a meridian's axis."""
        axis = Mirror((1.0, 0.0), 0.0, PLANAR * self.mesh.size)
        return (*self.planes, axis) if self.ring else self.planes

    @cached_property
    def surroundings(self) -> Surroundings | Skin:
        """The surface of the whole body, mirror images included."""
        if self.mesh.dimension == 3:
            return Skin.of(self.mesh, self.mirrors)
        return Surroundings.of(self.mesh, self.mirrors, self.ring)

    @cached_property
    def itself(self) -> Itself:
        """The test whether the body penetrates itself."""
        return Itself.of(self.mesh, self.mirrors, self._facing)

    @property
    def _facing(self) -> Ints:
        """Nodes (n,) on either side of deformable tools."""
        names = [name for t in self.tools if isinstance(t, DeformableTool) for name in (*t.candidates, *t.surface)]
        return self.mesh.boundary_nodes(*names) if names else np.empty(0, np.intp)

    @cached_property
    def size(self) -> float:
        """The largest extent of the whole body along an axis, with its images beyond planes of symmetry (length)."""
        return float(np.ptp(self._with_images(self.mesh.nodes), axis=0).max())

    @cached_property
    def calipers(self) -> Calipers:
        """The widths of the whole body across its facets, which do not depend on how it is turned."""
        x, outline = self.mesh.nodes, self.mesh.outline
        facets = x[outline[:, self.mesh.element.ends]]
        for plane in self.planes:
            facets = facets[~plane.holds(facets).all(axis=1)]
        return Calipers.of(self._with_images(facets), self._with_images(x[np.unique(outline)]))

    def _with_images(self, points: Floats) -> Floats:
        """Points (a, ..., d) and their images beyond planes of symmetry."""
        for plane in self.planes:
            points = np.vstack([points, plane.images(points)])
        return points

    @property
    def images(self) -> int:
        """The number of modelled parts in the whole body: a factor of 2 for each plane of symmetry."""
        return 2 ** len(self.planes)

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """Pseudo-times in (0, 1) at which a tool, a support or a load changes its rate."""
        return tuple(sorted({tau for path, _ in self._moved(self.tools) for tau in corners(path)}))

    def paces(self, near: Bools) -> Paces:
        """The kinks and the change of pace at each, with the tools (k,) that are ``near`` only."""
        return paces_of(self._moved([tool for tool, counts in zip(self.tools, near, strict=True) if counts]))

    def _moved(self, tools: Sequence[Tool]) -> tuple[Moved, ...]:
        """All paths and amplitudes, and what they multiply; tools, with their turns, are those given."""
        turns = [(turn.amplitude.points, (turn.angle,)) for tool in tools if (turn := tool.turn) is not None]
        moving = [(s.amplitude.points, (s.displacement,)) for s in self.supports if isinstance(s, Prescribed)]
        loads = [(load.amplitude.points, magnitude(load)) for load in self.loads]
        drives = [(drive.amplitude.points, (drive.size,)) for drive in self.drives.by]
        return (*moving, *loads, *drives, *turns, *((tool.path, tool.travel) for tool in tools))

    def origin(self, nodes: Floats) -> Floats:
        """The configuration (a, d) from which an increment is measured when the body is at ``nodes``."""
        return self.configuration.measure.origin(self.mesh.nodes, nodes)

    def balanced(self, nodes: Floats, du: Floats) -> Floats:
        """The configuration (a, d) in which an increment ``du`` from ``nodes`` is in equilibrium."""
        return self.configuration.measure.balanced(self.origin(nodes), du)

    @cached_property
    def turning(self) -> Bools:
        """Which tools (k,) turn."""
        return np.array([tool.turn is not None for tool in self.tools], dtype=bool)

    @cached_property
    def drives(self) -> Drives:
        """The forces and moments that drive tools, and the coordinates (m,) that they make unknown."""
        return Drives.of(self.tools, self.planes, self.mesh)

    def travel(self, tau: float, tau_end: float) -> Floats:
        """Displacement (k, d) of each tool along its path from pseudo-time ``tau`` to ``tau_end``."""
        return np.array([tool.moved(tau, tau_end) for tool in self.tools]).reshape(-1, self.mesh.dimension)

    @property
    def at_rest(self) -> Floats:
        """Pose (k, p) of each tool at rest: zeros."""
        return np.zeros((len(self.tools), pose_size(self.mesh.dimension)))

    def placed(self, tau: float, translation: Floats) -> Floats:
        """Pose (k, p) (:mod:`bipot.tools.poses`) of each tool at ``tau``, with coordinates (m,) of :attr:`drives`."""
        poses = np.array([tool.pose(tau) for tool in self.tools]).reshape(self.at_rest.shape)
        return poses + self.drives.poses(translation, len(poses))

    def driven(self, tau: float) -> Floats:
        """The prescribed displacement (a, d) since rest at pseudo-time ``tau``; zero where none is prescribed."""
        return self.holding.at(tau)

    @property
    def on_axis(self) -> Bools:
        """Which nodes (a,) of a meridian are on the axis."""
        r = self.mesh.nodes[:, 0]
        return r <= AXIS * r.max()

    def _check_axis(self) -> None:
        """Require that nodes on the axis stay there: a body that opens or folds there has no finite hoop strain."""
        if self.ring:
            nodes = np.flatnonzero(self.on_axis)
            loose = nodes[self.holding.free_along(nodes, np.tile((1.0, 0.0), (len(nodes), 1)))][:1]
            what = f"such that they hold node {loose.max(initial=0)} on the axis along 0"
            require(not loose.size, "scene.supports", self.supports, what)
            moving = [driven for driven in self.holding.driven if driven.support.displacement]
            driven = [d.support.boundary for d in moving if d.ways[self.on_axis[d.nodes], 0].any()]
            require(not driven, "scene.supports", driven, "none that moves the axis along 0")
