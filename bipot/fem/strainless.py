r"""Motions without strain: what few integration points leave beside the rigid ones.

Eight points of an H20 do not see the strain of six of its motions. Neighbours stop these if the element shares faces
along two of its three axes; in a row of single elements each keeps a motion of its own, of which an answer may have any
amount. A single element whose volume change is projected on constants also has such motions, and so have triangles and
tetrahedra with middles in one plane (:func:`kept_by_means`). In a row with nodes out of line these motions are a little
stiff, in proportion to the square of the offset: if that is a twentieth of an element, a force at a node still moves it
many times as far as it should.

With K the stiffness as integrated and projected and K_f a fuller one, both of one elastic material, a motion v is
without strain, or nearly so, if v'K v < least v'K_f v. There are such motions if

    K - least K_f + SHIFT diag K

is not positive definite. (For rigid motions only the last term is not zero.) K_f has the volume change as it is. It has
three points along those axes of an element along which it has no neighbour, where such motions vary. Along the others
it has the points of the rule, because three are too stiff for elements that are thin and bent or curved, by a factor
that such motions need not reach. Elements that cannot have such motions do not count in K_f. Rows of even elements have
v'K v = 0, with nodes moved by up to 15 % of an element 0.015 v'K_f v at most. Two elements between clamped faces have
0.003 to 0.007 with nodes moved by 5 %, where a force at a node is answered 14 to 25 times as far as by three points,
0.01 to 0.025 with 10 %, where it is 5 to 8 times, and at most 0.041 with 15 %. A single one between such faces has 0.5,
a frame of one between its corners 0.095, where it is 1.5 times.

Quadratic elements whose volume change is projected on constants are softer, and have bounds of their own. Hexahedra of
H20 in a slab of one layer have 0.025 and less, and 2 x 2 x 2 of them with eight points 0.027, where tractions that are
linear on each face move them 9 to 25 times as far as they should; 3 x 3 x 3 have 0.037, where it is 3.5 times.
Tetrahedra that make a row of single cubes have 0.06 (7 to 15 times), rows of two beside each other 0.09 to 0.11 (4 to 6
times, and 2 to 3 times under tractions that are the same all over a face), a layer of single cubes on a plane 0.14 and
2 x 2 x 2 cubes 0.15 (twice). No load moves a body farther than 1/least times as far as K_f lets it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.basics.definite import definite
from bipot.errors import require
from bipot.fem.assembly import Space, element_stiffness, space
from bipot.fem.axes import Axes
from bipot.fem.elements import RULES, Quadrature, Reference, tabulated, tabulated_along
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VOLUMES, Projection, VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.surface import outward_area
from bipot.meshes.mesh import Mesh
from bipot.tensors import identity, norm
from bipot.typing import Bools, Floats, Ints, einsum

LEAST, LEAST_LEVEL, LEAST_WEAK = 0.05, 0.12, 0.033
"""The ``least`` of the module docstring: of elements alone or in a row, of tetrahedra with middles nearly in one plane,
and of all elements whose volume change is projected on constants."""

SHIFT = 1e-11
"""Share of the diagonal of K that makes K definite for rigid motions."""

LEVEL = 0.55
"""Part of conformal motions kept by elements, below which other elements or supports must hold these."""

ASKEW = 1e-3
"""Largest part of a facet's normal along which nodes that count as held along it may still move."""

WAYS = {Geometry.SOLID: slice(None), Geometry.AXISYMMETRIC: slice(1, 2), Geometry.PLANE_STRAIN: slice(0)}
"""The coordinates along which the b of :func:`kept_by_means` may be."""

FLAT = 1e-14
"""Round-off of second moments, over the largest of the same body."""

NONE = np.empty(0, dtype=np.intp)


@dataclass(frozen=True)
class Held:
    """A ``mesh`` of a body of a ``geometry``, whose unknowns ``numbers`` (n,) along ``axes`` are held."""

    mesh: Mesh
    geometry: Geometry
    numbers: Ints
    axes: Axes

    @cached_property
    def alone(self) -> Bools:
        """Whether hexahedra (e,) have neighbours along fewer than two of their axes, other elements along none.

        A face that is held along its normal has the element's mirror image beside it.

        >>> from bipot.meshes.solids import brick
        >>> from bipot.fem.axes import STRAIGHT
        >>> of = Geometry.SOLID, NONE, STRAIGHT
        >>> row, slab = Held(brick(1.0, 1.0, 1.0, 1, 1, 3), *of), Held(brick(1.0, 1.0, 1.0, 2, 2, 1), *of)
        >>> row.alone.all(), slab.alone.any()
        (np.True_, np.False_)
        """
        return np.asarray(self._beside.sum(axis=1) < max(self._beside.shape[1] - 1, 1))

    @cached_property
    def _beside(self) -> Bools:
        """Whether squares and cubes have neighbours along each axis (e, d); other shapes, whether any at all (e, 1)."""
        opposite = self.mesh.element.opposite
        if opposite is None:
            return np.atleast_2d(self.mesh.shared.any(axis=1)).T
        return np.asarray(np.logical_or(self.mesh.shared, self._mirrored())[:, opposite].any(axis=2))

    def _mirrored(self) -> Bools:
        """Whether all nodes of facets (e, m) of squares or cubes are held along the facet's normal."""
        free = np.ones(self.mesh.nodes.shape, dtype=bool)
        free.flat[self.numbers] = False
        facets = self.mesh.elements[:, self.mesh.element.facets]
        some = np.asarray(~free.all(axis=1))
        out = np.asarray(some[facets].all(axis=2))
        own = facets[out]
        normals = outward_area(self.mesh.nodes, own, Geometry.SOLID).sum(axis=1)
        every = np.repeat(normals / norm(normals)[:, None], own.shape[1], axis=0)
        moves = free[own.ravel()] & (np.abs(self.axes.at(own.ravel(), every)) > ASKEW)
        out[out] = (moves.sum(axis=1) == 0).reshape(own.shape).all(axis=1)
        return out

    def require_strained(self, rule: Quadrature, volume: VolumeChange) -> None:
        """Refuse a rule and a volume change that leave motions without strain."""
        found = self.strainless(rule, volume)
        if not found.size:
            return
        ways = [(rule, volume) for rule in RULES[self.mesh.element] for volume in VOLUMES[self.mesh.element]]
        known = [f"{way[0].name} with {way[1].name}" for way in ways if not self.strainless(*way).size]
        place = tuple(np.round(self.mesh.nodes[self.mesh.elements[found[0]]].mean(axis=0), 6).tolist())
        why = "volume changes of few elements beside each other are projected on constants"
        if found[0] in self._level(volume):
            why = "the middles of elements beside each other are nearly in one plane"
        elif self.alone[found[0]]:
            why = "elements stand alone or in a row of single ones"
        left = f"where {why}, as element {found[0]} at {place}, it leaves motions without strain, or nearly so"
        allowed = f"of {known}, or have more elements beside each other: {left}"
        require(False, "scene.quadrature, scene.volume", f"{rule.name} with {volume.name}", allowed)

    def strainless(self, rule: Quadrature, volume: VolumeChange) -> Ints:
        """Elements (n,) that have motions without strain; empty if none has."""
        if not self.mesh.element.quadratic:
            return NONE
        # Constants hold quadratic elements so weakly that those beside each other may have such motions, too.
        weak = volume is VolumeChange.P0 is not VOLUMES[self.mesh.element][0]
        every = np.arange(len(self.mesh.elements)) if weak else NONE
        level = self._level(volume), LEAST_LEVEL if self.geometry is Geometry.SOLID else LEAST
        for loose, least in ((np.flatnonzero(self.alone), LEAST), level, (every, LEAST_WEAK)):
            if loose.size and not self.all_strained(rule, volume, loose, least):
                return loose
        return NONE

    def _level(self, volume: VolumeChange) -> Ints:
        """Triangles or tetrahedra (n,), middles nearly in one plane, to which constants may leave conformal motions."""
        if volume is not VolumeChange.P0 or self.mesh.element.shape.cube:
            return NONE
        return np.flatnonzero(kept_by_means(self.mesh, self.geometry) < LEVEL)

    def all_strained(self, rule: Quadrature, volume: VolumeChange, loose: Ints, least: float) -> bool:
        """Whether all motions of the elements ``loose`` (n,) but rigid ones have v'K v > ``least`` v'K_f v.

        This is found by a factorisation, unless the rule alone decides.
        """
        mesh = self.mesh
        fullest = max(RULES[mesh.element], key=lambda other: len(tabulated(mesh.element, other).weights))
        if rule is fullest and volume is VolumeChange.AS_IS:
            return True
        free = space(mesh, self.geometry, rule, self.numbers, axes=self.axes)
        own = _stiffness(free, tabulated(mesh.element, rule), volume)
        shift = SHIFT * sp.diags(free.matrix(own).diagonal())
        for some, fuller in _fuller(mesh, rule, fullest, loose, self._beside[loose]):
            own[some] -= least * _stiffness(free, fuller, VolumeChange.AS_IS, some)
        return definite(sp.csc_matrix(free.matrix(own) + shift))


def _fuller(
    mesh: Mesh, rule: Quadrature, fullest: Quadrature, loose: Ints, shared: Bools
) -> Iterator[tuple[Ints, Reference]]:
    """The elements ``loose`` (n,) in groups with K_f's points, by the axes (n, d) along which faces are ``shared``."""
    if rule is not Quadrature.GAUSS2:
        yield loose, tabulated(mesh.element, fullest)
        return
    kinds, kind = np.unique(shared, axis=0, return_inverse=True)
    for k, along in enumerate(kinds):
        yield loose[kind.ravel() == k], tabulated_along(mesh.element, tuple(np.where(along, 2, 3).tolist()))


def _stiffness(free: Space, table: Reference, volume: VolumeChange, some: slice | Ints = slice(None)) -> Floats:
    """Stiffness (e, dk, dk) of ``some`` elements at rest, of a material with a Poisson's ratio of a quarter."""
    mesh, elements = free.mesh, free.mesh.elements[some]
    projection = Projection.of(volume, mesh.nodes, elements, table)
    placed = gradients(mesh.nodes, elements, table, free.geometry, projection)
    size = placed.reduction.mandel
    moduli: Floats = 2 * np.eye(size) + np.outer(identity(size), identity(size))
    return element_stiffness(placed, moduli)


def kept_by_means(mesh: Mesh, geometry: Geometry) -> Floats:
    r"""The parts (e,) of conformal motions that triangles or tetrahedra keep, by straight sides; one without a b.

    Conformal are those whose strain is a change of volume alone, of which means over elements may see none. In space

        v = (b . x) x - (x . x) b/2,    e = (b . x) 1,

    is one for any b. It is quadratic, and the volume change tr e = 3 b . x is linear. Where it is projected on
    constants its mean over an element is that in the element's middle, and with the origin in a plane that has the
    middles of all elements and the normal b there is none. So one to three tetrahedra have such motions, and so have
    the six of a cube. Of what the volume change of these motions costs, elements of volumes V with middles c keep at
    least the part

        min over b of  sum V (b . (c - o))^2 / int (b . (x - o))^2 dx,    o the middle of all.

    It is found for an element with those that share a corner with it: a row of single cubes on a large body has such
    motions by itself. On a meridian b is along the axis, and in a plane the strain e = (b . x) 1 has a component
    across it, which is none.

    >>> from bipot.meshes.elements import Element
    >>> from bipot.meshes.solids import brick
    >>> cubes = (brick(1.0, 1.0, n, 1, 1, n, element=Element.T10) for n in (1, 2))
    >>> [abs(round(float(kept_by_means(cube, Geometry.SOLID).min()), 3)) for cube in cubes]
    [0.0, 0.203]
    """
    ways = range(mesh.dimension)[WAYS[geometry]]
    corners = mesh.elements[:, : mesh.element.corners]
    if not ways:
        return np.ones(len(corners))
    x = (mesh.nodes[corners] - mesh.nodes.mean(axis=0)) / mesh.size
    middle = x.mean(axis=1)
    volume = np.abs(np.linalg.det(x[:, 1:] - x[:, :1]))
    if geometry is Geometry.AXISYMMETRIC:
        volume = volume * mesh.nodes[corners, 0].mean(axis=1)
    x, middle = x[..., list(ways)], middle[:, list(ways)]
    off, count = x - middle[:, None], corners.shape[1]
    inside = einsum("e,eki,ekj->eij", volume / (count * (count + 1)), off, off)
    own = sp.csr_matrix((np.ones(corners.size), corners.ravel(), count * np.arange(len(corners) + 1)))
    # Elements that share a corner, each with itself.
    beside = (own @ own.T > 0).astype(float)
    whole, first = beside @ volume, beside @ (volume[:, None] * middle)
    second = beside @ einsum("e,ei,ej->eij", volume, middle, middle).reshape(len(middle), -1)
    between = second.reshape(inside.shape) - einsum("ei,ej,e->eij", first, first, 1 / whole)
    every = between + (beside @ inside.reshape(len(inside), -1)).reshape(inside.shape)
    part, along = np.linalg.eigh(every)
    # Of a body so flat that round-off decides, what it keeps across its plane comes out as too little.
    over = along / np.sqrt(np.maximum(part, FLAT * part[:, -1:]))[:, None]
    least: Floats = np.linalg.eigh(over.transpose(0, 2, 1) @ between @ over)[0]
    return least[:, 0]
