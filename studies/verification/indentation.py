r"""A rigid circle on a block that is a half-space to it: the mesh, the march, and what is read off the contact.

Lengths count from a nominal half-width a = 1. The block reaches 1000 of them and the circle has a radius of 1000: far
sides, and normals of the tool that turn, change the surface's tangential strain by some p0/E of 1/1000, which must be
small beside that of the half-space, 1 - 2 nu (0.1 at nu = 0.45). Strains are small ones, as those of the closed forms.

Elements are equal under the contact, and as high there; away from it they grow.
"""

from __future__ import annotations

import numpy as np

from bipot import (
    Accepted,
    Circle,
    Configuration,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Mesh,
    Scene,
    ShapedTool,
    Support,
    Symmetry,
)
from bipot.meshes.cells import graded
from bipot.typing import Floats
from studies.element_scenes import tensor

FAR = RADIUS = 1000.0
NEAR = 100.0
"""Size of a block on which `dissipation` finds contact forces to the law's bound. On the large one, whose rings differ
in volume by twelve powers of ten, its interior-point answers do not get there."""

FINE = 1.3
"""Of the half-width: how far equal elements reach along the surface; a quarter of it into the depth."""

GROWTH = 1.25
"""Of elements from one to the next beyond the equal ones."""

FITTED = 0.3
"""Of the largest pressure: above it pressures are fitted."""


def lines(fine: float, count: int, far: float = FAR) -> Floats:
    """Ends of ``count`` equal elements to ``fine``, and of elements that grow from there to ``far``."""
    size = fine / count
    away = int(np.ceil(np.log1p((far - fine) * (GROWTH - 1) / size) / np.log(GROWTH)))
    return np.append(np.linspace(0.0, fine, count + 1)[:-1], graded(fine, far, away, GROWTH ** (away - 1)))


def mesh(n: int, element: Element, far: float = FAR) -> Mesh:
    """The block with ``n`` (a multiple of 4) equal elements along the surface from its left, an axis, on."""
    return tensor(lines(FINE, n, far), far - lines(FINE / 4, n // 4, far)[::-1], element)


def pressed(
    geometry: Geometry, depth: float, elasticity: Elasticity, mu: float, n: int, element: Element, far: float = FAR
) -> Scene:
    """A cylinder (plane strain) or a sphere (axisymmetric) that goes ``depth`` into the block, held at its base."""
    left = Support("left", 0) if geometry is Geometry.AXISYMMETRIC else Symmetry("left", 0)
    punch = ShapedTool(Circle((0.0, far + RADIUS), RADIUS), (0.0, -depth), ("top",), mu)
    return Scene(
        mesh=mesh(n, element, far),
        geometry=geometry,
        material=Elastic(elasticity),
        supports=(Support("base", 0), Support("base", 1), left),
        tools=(punch,),
        configuration=Configuration.SMALL,
    )


def along(accepted: Accepted) -> tuple[Floats, Floats, Floats]:
    """Distances (c,) of the candidates from the axis, rising, recovered pressures (c,) and forces (c, d)."""
    nodes = accepted.solved.iterate.increment.system.candidates.node
    x = accepted.state.nodes[nodes, 0]
    order = np.argsort(x)
    return x[order], np.nan_to_num(accepted.traction.recovered_pressure)[order], accepted.solved.r[order]


def elliptic(x: Floats, pressure: Floats) -> tuple[float, float]:
    """Half-width and largest pressure of the ellipse p^2 = p0^2 (1 - x^2/a^2) that fits p^2 best over x^2.

    By least squares over the nodes whose pressure is above :data:`FITTED` of the largest.

    >>> x = np.linspace(0, 1, 9)
    >>> elliptic(x, 3 * np.sqrt(1 - x**2))
    (1.0, 3.0)
    """
    inside = pressure > FITTED * pressure.max()
    slope, square = np.polyfit(x[inside] ** 2, pressure[inside] ** 2, 1)
    return round(float(np.sqrt(-square / slope)), 12), round(float(np.sqrt(square)), 12)


def stick_radius(x: Floats, r: Floats, mu: float) -> float:
    """Halfway between the last node that sticks and the first beyond it, of forces r (c, 2) on Coulomb's cone.

    A node sticks where its force is inside the cone by more than 1e-6 of it.
    """
    stuck = (r[:, 0] > 0) & (np.abs(r[:, 1]) < (1 - 1e-6) * mu * r[:, 0])
    last = int(np.flatnonzero(stuck).max())
    return float(x[last : last + 2].mean())
