"""The seed paper's case, and its scheme as written: that for comparison, not for accuracy.

Strain and equilibrium on x_n (30), the continuum C^ep of (10), one penalised program (29) an increment with the
threshold and traction of the last one, the stress by radial return after it; nothing is iterated to equilibrium.
Total stress is carried, so an imbalance left by an increment loads the next. The program is linearised at the
velocity of the last increment, which distinguishes points that flow from points that do not.
"""

from __future__ import annotations

from dataclasses import replace

from bipot.certificate import Bounds
from bipot.control.control import Control
from bipot.errors import require_count, require_type
from bipot.fem.elements import Quadrature
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Penalty
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.laws.hardening import Hardening, Perfect
from bipot.laws.von_mises import Elasticity, RateVonMises, TangentKind, VonMises
from bipot.meshes.cells import require_sides
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout, require_layout_room
from bipot.meshes.sections import cylinder
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.tool import FlatTool, Sampling
from bipot.typing import require_within


def upsetting(
    *,
    mu: float,
    reduction: float = 0.45,
    height: float = 10.0,
    diameter: float = 10.0,
    young: float = 210_000.0,
    poisson: float = 0.3,
    hardening: Hardening | None = None,
    elements: int = 10,
    element: Element = Element.Q8,
    quadrature: Quadrature | None = None,
    volume: VolumeChange | None = VolumeChange.AS_IS,
    configuration: Configuration = Configuration.MIDPOINT,
    layout: Layout = Layout.TENSOR,
    sampling: Sampling = Sampling.NODES,
) -> Scene:
    """The seed paper's cylinder between rigid flat punches, as the quarter r, z >= 0 of its meridian plane.

    The paper's data are the defaults (N, mm, MPa): 10 x 10 mm, E = 210000, nu = 0.3, sigma_Y = 300, perfect
    plasticity, 100 eight-node quads with seven points. At tau = 1 the height is (1 - reduction) times the initial one.
    Quadratic elements with a projected ``volume`` reach 45 % in the fanned ``layout`` only
    (:class:`~bipot.meshes.layout.Layout`).

    Raises:
        SceneError: naming the field, the value and the allowed range.

    >>> upsetting(mu=0.1).tools[0].travel
    (0.0, -2.25)
    """
    require_within(reduction, "reduction", "in (0, 1)")
    require_sides(height=height, diameter=diameter)
    require_count(elements, "elements")
    require_type(element, Element, "element")
    require_layout_room((elements, elements), element, layout, ("elements", "elements"))
    punch = FlatTool(
        point=(0.0, height / 2),
        normal=(0.0, -1.0),
        travel=(0.0, -reduction * height / 2),
        candidates=("top", "side"),
        mu=mu,
        sampling=sampling,
    )
    return Scene(
        mesh=cylinder(diameter / 2, height / 2, elements, elements, element=element, layout=layout),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(young, poisson), Perfect(300.0) if hardening is None else hardening),
        supports=(Support("axis", 0), Symmetry("base", 1)),
        tools=(punch,),
        quadrature=quadrature,
        volume=volume,
        configuration=configuration,
    )


def as_written(scene: Scene, K_n: float, K_t: float) -> tuple[Scene, Control]:
    """Scene and control of the paper's scheme; of an :func:`unreturned` scene without the return map."""
    form = Penalty(K_n, K_t, kind=TangentKind.CONTINUUM)
    control = Control(form, (), Limits(Bounds.none(), passes=1), integration=Integration.BACKWARD_EULER)
    return replace(scene, configuration=Configuration.PAPER), control


def unreturned(scene: Scene) -> Scene:
    """The scene, of a von Mises material, with the stress by (4) alone, not returned to the yield surface."""
    require_type(scene.material, VonMises, "scene.material")
    return replace(scene, material=RateVonMises(**vars(scene.material)))
