r"""A block in space that is a half-space to a contact of radius a: its mesh, and what is read off the contact.

Elements are equal near the contact, n of them to 1.2 a along the surface, n/2 to 0.6 a into the depth. Away from it
lines are at 1.2 a (1 - k/m)^-3 and half of that, m = 2 n: elements grow with the power 4/3 of their distance. The block
reaches 1.2 a m^3 to its free sides, and half as far down to its base, which is held: with the mesh elements become
smaller and the block larger. What a base at the depth L takes off the approach is of the order of a/L.
"""

from __future__ import annotations

import numpy as np

from bipot import Accepted, Elastic, Elasticity, Geometry, Mesh, Scene, ShapedTool, Support, Symmetry, brick
from bipot.fem.strain import Configuration
from bipot.typing import Floats
from studies.element_scenes import spaced

FINE = 1.2
"""Of the contact radius: how far equal elements reach along the surface."""

AWAY = 2
"""Lines beyond them, over those of equal elements along the surface."""


def lines(fine: float, count: int, away: int) -> Floats:
    """Ends of ``count`` equal elements to ``fine``, and of ``away`` - 1 that grow from there.

    >>> lines(1.0, 2, 4).round(3).tolist()
    [0.0, 0.5, 1.0, 2.37, 8.0, 64.0]
    """
    return np.append(np.linspace(0.0, fine, count + 1)[:-1], fine * (1 - np.arange(away) / away) ** -3.0)


def half_space(a: float, n: int, *, half: bool) -> Mesh:
    """The part y >= 0, or also x >= 0, of a block below z = 0, with ``n`` (even) equal elements to 1.2 ``a``.

    Its boundary ``near`` is the part of the top that has them.
    """
    along, down = lines(FINE * a, n, AWAY * n), -lines(FINE * a / 2, n // 2, AWAY * n)[::-1]
    x = np.append(-along[:0:-1], along) if half else along
    n_x, n_y, n_z = (len(ends) - 1 for ends in (x, along, down))
    mesh = spaced(brick(float(n_x), float(n_y), float(n_z), n_x, n_y, n_z), x, along, down)
    top = mesh.boundary("top")
    near = (np.abs(mesh.nodes[top]) < 1.001 * FINE * a).all(axis=(1, 2))
    return Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "near": top[near]})


def indented(mesh: Mesh, elasticity: Elasticity, tool: ShapedTool, *cut: Symmetry) -> Scene:
    """The elastic block under the tool, ``cut`` by planes of symmetry, in small strain."""
    return Scene(
        mesh=mesh,
        geometry=Geometry.SOLID,
        material=Elastic(elasticity),
        supports=(*(Support("base", axis) for axis in range(3)), *cut),
        tools=(tool,),
        configuration=Configuration.SMALL,
    )


def forces(accepted: Accepted) -> tuple[Floats, Floats]:
    """Normal forces (c,) of the candidates and what Coulomb's law leaves of friction there, mu r_n - |r_t|."""
    r, mu = accepted.solved.r, accepted.solved.iterate.increment.system.candidates.mu
    return r[:, 0], mu * r[:, 0] - np.linalg.norm(r[:, 1:], axis=1)


def radius(accepted: Accepted, weight: Floats, size: float) -> float:
    """Of the circle on which forces ``weight`` (c,) are spread as sqrt(1 - r^2/a^2): a^2 = 5/2 of their mean r^2.

    Nodes of equal elements of this ``size`` have forces that see r^2 as linear between them along x and y, which
    is larger by size^2/6 along each: that is taken off.
    """
    node = accepted.solved.iterate.increment.system.candidates.node
    square = (accepted.solved.iterate.increment.system.body.scene.mesh.nodes[node, :2] ** 2).sum(axis=1)
    return float(np.sqrt(2.5 * (weight @ square / weight.sum() - size**2 / 3)))


def peak(accepted: Accepted) -> float:
    """The largest pressure at a node."""
    return float(np.nanmax(accepted.traction.recovered_pressure))
