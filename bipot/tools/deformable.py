"""Deformable tools: a boundary of the mesh itself, of another part of the body or of the same.

Where it is, is known of a configuration only (:mod:`bipot.tools.facing`). Beside the candidates nothing is told of it:
for all other points it is out of reach.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bipot.errors import require, require_tuple, require_type
from bipot.meshes.mesh import Mesh
from bipot.tools.facing import Plane, Sides
from bipot.tools.pieces import LEAST, Near
from bipot.tools.seeming import seeming
from bipot.tools.surfaces import Distance, Surface, Tips, frames
from bipot.tools.tool import STRAIGHT_ON, FlatTool, Sampling, ShapedTool, Tool
from bipot.typing import Bools, Floats, Vector


@dataclass(frozen=True, eq=False)
class Nowhere(Surface):
    """What points meet that are no candidates: nothing. The contact has these ``sides``, ``one`` of the candidates.

    Those of a ``ring`` are on a meridian. The body continues beyond ``planes`` as its mirror image.
    """

    sides: Sides
    ring: bool
    planes: tuple[Plane, ...]

    @cached_property
    def seeming(self) -> Floats:
        """Gaps (p,) of the points at rest that are none (:mod:`bipot.tools.seeming`)."""
        return seeming(self.sides, self.ring, self.planes)

    @property
    def dimension(self) -> int:
        """Number d of coordinates."""
        return int(self.sides.nodes.shape[1])

    def distance(self, x: Floats) -> Distance:
        """As :meth:`Surface.distance`: out of reach."""
        return Distance.flat(self.gap(x, x), np.eye(x.shape[-1])[-1])

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.gap`: out of reach."""
        return np.full(x.shape[:-1], np.inf)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.size`."""
        return np.abs(x).max(axis=-1)

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`Surface.passed`: none."""
        return np.zeros_like(by) if by.shape[-1] == 2 else np.zeros_like(by[..., :1])

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`Surface.crossed`: never."""
        return np.zeros(x.shape[:-1], dtype=bool)

    def tips(self) -> Tips:
        """As :meth:`Surface.tips`: none."""
        return Tips(np.empty((0, self.dimension)), np.empty(0), np.inf)

    def mirrored(self, normal: Vector, position: float, roundoff: float) -> bool:
        """As :meth:`Surface.mirrored`: where both sides of the contact have nodes in the plane."""
        along = self.sides.nodes @ np.array(normal) - position
        return all(bool((np.abs(along[of]) <= roundoff).any()) for of in (self.sides.one, self.sides.other))

    def image(self, normal: Vector, position: float) -> Surface:
        """As :meth:`Surface.image`."""
        return self

    def same(self, other: Surface, roundoff: float) -> bool:
        """As :meth:`Surface.same`."""
        return other is self

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """As :meth:`Surface.lines`: none, as it is drawn with the body."""
        return []


@dataclass(frozen=True, eq=False)
class Faced(Nowhere):
    """What candidates face, point by point: gaps n . z + ``apart`` - ``none`` (m,) of their mean vectors z (m, d).

    ``normals`` n (m, d) are those of the points, ``places`` (m,) the size of the numbers of which z are differences,
    ``none`` gaps at rest that are none. Of the area around a point the fraction ``part`` (m,) faces the tool, of that
    on each flat part of the side ``shares`` (l, k).
    """

    normals: Floats
    places: Floats
    apart: Floats
    none: Floats
    part: Floats
    shares: Floats

    @property
    def farther(self) -> Floats:
        """How much farther off (m,) than it is the tool is felt, as its end is rounded; inf where it is not faced."""
        return np.where(self.part > LEAST, self.apart, np.inf)

    def distance(self, x: Floats) -> Distance:
        """As :meth:`Surface.distance`."""
        return Distance.flat(self.gap(x, x), self.normals)

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.gap`."""
        return np.vecdot(x, self.normals) + self.apart - self.none

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.size`."""
        return np.broadcast_to(self.places, x.shape[:-1])

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`Surface.passed`."""
        along = frames(self.normals)[:, : 2 if by.shape[-1] == 2 else 1]
        return np.vecdot(along, by[..., None, :])


NONE = np.empty((0, 2), np.intp)
UNKNOWN = Nowhere(Sides(np.empty((0, 2)), NONE, NONE, NONE, NONE, NONE[:, 0]), ring=False, planes=())
"""What a tool meets of which the mesh is not known yet."""


@dataclass(frozen=True)
class DeformableTool(Tool):
    """The boundaries ``surface`` of the mesh as a tool, e.g. of a part that stands for a punch.

    Nodes of the boundaries ``candidates``, which have no node in common with these, may touch them, with the Coulomb
    coefficient ``mu``, or ``mu_at`` of the node where given; ``mu = inf`` welds, also where curved sides only seem to
    be apart (:mod:`bipot.tools.seeming`). The law is posed in the means of :mod:`bipot.tools.facing`, of the
    configuration at the end of the increment. Friction is capped by ``shear`` times the shear yield stress on the side
    of the candidates, or ``shear_at`` of the node (:mod:`bipot.contact.shear`). Forces are those on the side of the
    candidates; the nodes of the surface bear the opposite ones.

    Raises:
        SceneError: no boundary, one that is in both fields, a coefficient below zero.
    """

    surface: tuple[str, ...]
    candidates: tuple[str, ...]
    mu: float
    mu_at: Mapping[int, float] = field(default_factory=dict)
    shear: float = math.inf
    shear_at: Mapping[int, float] = field(default_factory=dict)
    met: Nowhere = field(default=UNKNOWN, repr=False, compare=False)

    path = STRAIGHT_ON
    driven_by = None
    sampling = Sampling.NODES

    def __post_init__(self) -> None:
        require_type(self.met, Nowhere, "tool.met")
        object.__setattr__(self, "travel", (0.0,) * self.met.dimension)
        object.__setattr__(self, "surface", require_tuple(self.surface, str, "tool.surface"))
        require(len(self.surface) > 0, "tool.surface", self.surface, "at least one mesh boundary")
        self._check()
        both = sorted({*self.surface} & {*self.candidates})
        require(not both, "tool.candidates", both, "other boundaries than those of the surface")

    @property
    def on_mesh(self) -> dict[str, tuple[str, ...]]:
        """Those of both sides."""
        return {"surface": self.surface, "candidates": self.candidates}

    @property
    def face(self) -> Surface:  # type: ignore[override]
        """What its candidates, or all other points, meet."""
        return self.met

    @property
    def flat(self) -> bool:
        """Always: normals are those of a configuration, and constant in an increment."""
        return True

    def of(self, mesh: Mesh, ring: bool = False, planes: tuple[Plane, ...] = ()) -> DeformableTool:
        """The same as one of a body with this ``mesh``; ``ring`` and ``planes`` as of :class:`Nowhere`."""
        both = (mesh.around(*names) for names in (self.candidates, self.surface))
        return replace(self, met=Nowhere(Sides.of(mesh.nodes, *both), ring, planes))

    @property
    def sides(self) -> Sides:
        """Both sides of the contact, of a tool that knows its mesh (:meth:`of`)."""
        return self.met.sides

    @property
    def near(self) -> Near:
        """How high what leans away is faced."""
        return Near.WELDED if self.welded else Near.OWN

    @property
    def seeming(self) -> Floats:
        """Gaps (p,) at rest across which it welds, as they are none; zero without a weld."""
        return self.met.seeming if self.welded else np.zeros(len(self.sides.node))


AnyTool = FlatTool | ShapedTool | DeformableTool
"""All kinds of tools."""
