"""The seed paper's scheme as written, as one switch: for comparison, not for accuracy.

Strain and equilibrium on x_n (30), the continuum C^ep of (10), one penalised program (29) an increment with the
threshold and traction of the last one, the stress by radial return after it; nothing is iterated to equilibrium.
Total stress is carried, so what an increment leaves out of balance loads the next. The program is linearised at the
velocity of the last increment, which tells points that flow from points that do not.
"""

from __future__ import annotations

from dataclasses import replace

from bipot.certificate import Bounds
from bipot.fem.kinematics import Configuration
from bipot.forms import Penalty
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.march import Control
from bipot.response import StressUpdate, TangentKind
from bipot.scene import Scene


def as_written(
    scene: Scene, K_n: float, K_t: float, update: StressUpdate = StressUpdate.RETURN
) -> tuple[Scene, Control]:
    """Scene and control of the paper's scheme; ``StressUpdate.RATE`` leaves out the return to the yield surface.

    Raises:
        SceneError: a penalty that is not finite and positive.
    """
    form = Penalty(K_n, K_t, kind=TangentKind.CONTINUUM)
    control = Control(form, (), Limits(Bounds.none(), passes=1), update=update, integration=Integration.BACKWARD_EULER)
    return replace(scene, configuration=Configuration.PAPER), control
