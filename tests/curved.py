"""Scenes under a circular punch, which tests share."""

from dataclasses import replace
from functools import cache

import numpy as np

from bipot.certificate import Bounds
from bipot.control.accepted import Accepted
from bipot.fem.reduction import Geometry
from bipot.forms import Form, Newton
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.laws.hardening import Linear
from bipot.laws.material import Material
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.surfaces import Surface
from bipot.tools.tool import ShapedTool

TIGHT = Bounds(equilibrium=1e-11, law=1e-9, relative_gap=1e-11)

RADIUS = 2.0
PUNCH = Circle((0.0, 1.0 + RADIUS), RADIUS)
STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))


def pressed(
    geometry: Geometry = Geometry.PLANE_STRAIN,
    surface: Surface = PUNCH,
    travel: tuple[float, float] = (0.0, -0.1),
    mu: float = 0.2,
    elements: int = 4,
    material: Material = STEEL,
    **tool,
) -> Scene:
    """A unit block, its left side a plane of symmetry or the axis, under a punch that begins where they touch."""
    left = Support("left", 0) if geometry is Geometry.AXISYMMETRIC else Symmetry("left", 0)
    return Scene(
        block(1.0, 1.0, elements, elements, element=Element.Q8),
        geometry,
        material,
        (Support("base", 1), left),
        (ShapedTool(surface, travel, ("top",), mu, **tool),),
    )


def dragged(**changes) -> Scene:
    """The whole block, held at its base, under a punch that presses and then goes aside."""
    scene = pressed(surface=Circle((0.4, 1.0 + RADIUS), RADIUS), travel=(0.1, -0.05), **changes)
    path = ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    held = Support("base", 0), Support("base", 1)
    return replace(scene, supports=held, tools=(replace(scene.tools[0], path=path),))


def marched(scene: Scene, form: Form | None = None, increments: int = 10, **limits) -> list[Accepted]:
    """Every increment of a march by one form alone, of order one: what order two carries on where is a choice."""
    control = Control(form or Newton(), fallbacks=(), limits=Limits(**limits), integration=Integration.BACKWARD_EULER)
    return list(march(scene, Schedule(increments, first=0.01, settling=1, growth=4.0), control))


@cache
def pushed(geometry: Geometry) -> tuple[Accepted, ...]:
    """The march of :func:`pressed` by Newton."""
    return tuple(marched(pressed(geometry)))


def forces(accepted) -> np.ndarray:
    """Force (increments, d) of the punch on the modelled part."""
    return np.array([a.tool_forces[0] for a in accepted])


def apart(one, other):
    """Largest difference of two histories over the largest of their numbers."""
    one, other = np.asarray(one), np.asarray(other)
    return np.abs(one - other).max() / np.abs(other).max()


def check_differences(increment, x, r) -> np.ndarray:
    """The tangent K (n, n) and the rows of gaps against differences by every unknown x (n,), at frozen forces r."""

    def of(y):
        there = increment.at(y)
        return there.residual - there.rows.forces(r), there.motion[:, 0]

    here, h = increment.at(x), 1e-6
    K = increment.system.body.space.matrix(here.tangent(r)).toarray()
    ways = [[(a - b) / (2 * h) for a, b in zip(of(x + e), of(x - e), strict=True)] for e in h * np.eye(len(x))]
    np.testing.assert_allclose(K, np.array([balance for balance, _ in ways]).T, atol=1e-6 * np.abs(K).max())
    np.testing.assert_allclose(here.rows.G_n.toarray(), np.array([gap for _, gap in ways]).T, atol=1e-8)
    return K
