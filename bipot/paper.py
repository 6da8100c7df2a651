"""The seed paper's scheme as written, in one function: for comparison, not for accuracy.

Strain and equilibrium on x_n (30), the continuum C^ep of (10), one penalised program (29) an increment with the
threshold and traction of the last one, the stress by radial return after it; nothing is iterated to equilibrium.
Total stress is carried, so an imbalance left by an increment loads the next. The program is linearised at the
velocity of the last increment, which distinguishes points that flow from points that do not.
"""

from __future__ import annotations

from dataclasses import replace

from bipot.certificate import Bounds
from bipot.control.control import Control
from bipot.errors import require_type
from bipot.fem.strain import Configuration
from bipot.forms import Penalty
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.laws.rate import RateVonMises
from bipot.laws.von_mises import TangentKind, VonMises
from bipot.scene.scene import Scene


def as_written(scene: Scene, K_n: float, K_t: float) -> tuple[Scene, Control]:
    """Scene and control of the paper's scheme; of an :func:`unreturned` scene without the return map.

    Raises:
        SceneError: a penalty that is not finite and positive.
    """
    form = Penalty(K_n, K_t, kind=TangentKind.CONTINUUM)
    control = Control(form, (), Limits(Bounds.none(), passes=1), integration=Integration.BACKWARD_EULER)
    return replace(scene, configuration=Configuration.PAPER), control


def unreturned(scene: Scene) -> Scene:
    """The scene with the stress of its von Mises material by (4) alone, not returned to the yield surface.

    Raises:
        SceneError: another material.
    """
    require_type(scene.material, VonMises, "scene.material")
    return replace(scene, material=RateVonMises(**vars(scene.material)))
