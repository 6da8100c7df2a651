r"""Motions without strain: what few integration points leave beside the rigid ones.

Eight points of an H20 see six of its motions as none. Elements beside each other stop them where they share faces along
two of their three axes; in a row of single ones each keeps a motion of its own, of which an answer may have any amount.
One element of a volume change that is projected on constants has motions like that, too.

With K the stiffness as it is integrated and projected and K_f that by the fullest rule as it is, both of one elastic
material, a motion v is without strain where v'K v < LEAST v'K_f v. There are such motions where

    K - LEAST K_f + SHIFT diag K_f

is not positive definite: a rigid one, of which both are zero, has the last alone. Rows of even elements have motions of
v'K v = 0, rows bent to a ring of eight elements a quarter of 1e-7 v'K_f v, and nodes moved by a hundredth of an element
leave 6e-6. Where elements are thin and curved the fullest rule is too stiff for bending as well: a slice of a ring as
thick as a two-hundredth of its radius, of two elements a quarter, has 6e-5.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from bipot.basics.definite import definite
from bipot.errors import require
from bipot.fem.assembly import Space, element_stiffness, space
from bipot.fem.axes import Axes
from bipot.fem.elements import RULES, Quadrature, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VOLUMES, Projection, VolumeChange
from bipot.fem.reduction import Geometry
from bipot.meshes.mesh import Mesh
from bipot.tensors import identity
from bipot.typing import Bools, Floats, Ints

LEAST, SHIFT = 1e-5, 1e-11


def alone(mesh: Mesh) -> Bools:
    """Which elements (e,) share faces with others along less than two of their three axes; of other elements with none.

    >>> from bipot.meshes.solids import brick
    >>> alone(brick(1.0, 1.0, 1.0, 1, 1, 3)).all(), alone(brick(1.0, 1.0, 1.0, 2, 2, 1)).any()
    (np.True_, np.False_)
    """
    shared = mesh.shared
    opposite = mesh.element.opposite
    if opposite is None:
        return np.asarray(~shared.any(axis=1))
    return np.asarray(shared[:, opposite].any(axis=2).sum(axis=1) < 2)


def require_strained(
    mesh: Mesh, geometry: Geometry, rule: Quadrature, volume: VolumeChange, held: Ints, axes: Axes
) -> None:
    """Refuse a rule and a volume change that leave motions without strain to a mesh so held: any amount would do.

    Raises:
        SceneError: it says which do not, and where.
    """

    def loose(rule: Quadrature, volume: VolumeChange) -> Ints:
        return strainless(mesh, geometry, rule, volume, held, axes)

    found = loose(rule, volume)
    if not found.size:
        return
    ways = [(rule, volume) for rule in RULES[mesh.element] for volume in VOLUMES[mesh.element]]
    known = [f"{rule.name} with {volume.name}" for rule, volume in ways if not loose(rule, volume).size]
    place = tuple(np.round(mesh.nodes[mesh.elements[found[0]]].mean(axis=0), 6).tolist())
    where = f"where elements stand alone or in a row of single ones, as element {found[0]} at {place}"
    allowed = f"of {known}, or have more elements beside each other: {where}, it leaves motions without strain"
    require(False, "scene.quadrature, scene.volume", f"{rule.name} with {volume.name}", allowed)


def strainless(mesh: Mesh, geometry: Geometry, rule: Quadrature, volume: VolumeChange, held: Ints, axes: Axes) -> Ints:
    """Elements (n,) with motions without strain, unknowns ``held`` along ``axes`` at rest; none where none has any."""
    # Constants hold quadratic elements so weakly that those beside each other may have such motions, too.
    weak = volume is VolumeChange.P0 is not VOLUMES[mesh.element][0]
    loose = np.arange(len(mesh.elements)) if weak else np.flatnonzero(alone(mesh))
    if not (mesh.element.quadratic and loose.size) or all_strained(mesh, geometry, rule, volume, held, axes):
        return loose[:0]
    return loose


def all_strained(
    mesh: Mesh, geometry: Geometry, rule: Quadrature, volume: VolumeChange, held: Ints, axes: Axes
) -> bool:
    """Whether no motion is without strain but rigid ones; where that is not known, by a factorisation."""
    fullest = max(RULES[mesh.element], key=lambda other: len(tabulated(mesh.element, other).weights))
    if rule is fullest and volume is VolumeChange.AS_IS:
        return True
    free = space(mesh, geometry, rule, held, axes=axes)
    full = _stiffness(free, fullest, VolumeChange.AS_IS)
    shifted = _stiffness(free, rule, volume) - LEAST * full + SHIFT * sp.diags(full.diagonal())
    return definite(sp.csc_matrix(shifted))


def _stiffness(free: Space, rule: Quadrature, volume: VolumeChange) -> sp.csc_matrix:
    """That of the mesh at rest, of a material with a Poisson's ratio of a quarter."""
    mesh, table = free.mesh, tabulated(free.mesh.element, rule)
    projection = Projection.of(volume, mesh.nodes, mesh.elements, table)
    placed = gradients(mesh.nodes, mesh.elements, table, free.geometry, projection)
    size = placed.reduction.mandel
    moduli: Floats = 2 * np.eye(size) + np.outer(identity(size), identity(size))
    return free.matrix(element_stiffness(placed, moduli))
