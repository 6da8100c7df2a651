"""bipot: elastoplastic bodies in large deformation with exact Coulomb friction, every increment a conic program.

A scene says what is asked, a schedule when, a control how; :func:`march` yields accepted increments, each with its
certificate. Public names by subject; everything else is in the submodules, one subject each:

* scene: Scene, FlatTool, Support, Prescribed, Geometry, Configuration, Quadrature, upsetting
* meshes: Mesh, Element, block, cylinder, ring
* loads: BodyForce, Traction, PointForce, Pressure, Amplitude
* material: Material, VonMises, Elastic, Elasticity
* hardening: Perfect, Linear, Voce, Swift, Tabulated
* march: march, Schedule, Control, Accepted, Certificate
* forms: Tangent, Dissipation, Newton
* solvers: Clarabel, Qoco, Cvxpy
* results: Recorder, load
* errors: BipotError, IncrementFailed

>>> accepted = next(march(upsetting(mu=0.1, elements=2), Schedule(45, first=0.001 / 0.45)))
>>> accepted.solved.certificate.relative_gap < 1e-7
True
"""

from bipot.certificate import Certificate
from bipot.conic.clarabel import Clarabel
from bipot.conic.qoco import Qoco
from bipot.conic.through_cvxpy import Cvxpy
from bipot.elements import Element
from bipot.errors import BipotError, IncrementFailed
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, Newton, Tangent
from bipot.history import Recorder, load
from bipot.laws.hardening import Linear, Perfect, Swift, Tabulated, Voce
from bipot.laws.material import Elastic, Material
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.loads import BodyForce, PointForce, Pressure, Traction
from bipot.march import Accepted, Control, march
from bipot.mesh import Mesh, block, cylinder, ring
from bipot.paths import Amplitude
from bipot.scene import Prescribed, Scene, Support, upsetting
from bipot.schedule import Schedule
from bipot.tools import FlatTool

__version__ = "0.1.0"

__all__ = [
    "Accepted",
    "Amplitude",
    "BipotError",
    "BodyForce",
    "Certificate",
    "Clarabel",
    "Configuration",
    "Control",
    "Cvxpy",
    "Dissipation",
    "Elastic",
    "Elasticity",
    "Element",
    "FlatTool",
    "Geometry",
    "IncrementFailed",
    "Linear",
    "Material",
    "Mesh",
    "Newton",
    "Perfect",
    "PointForce",
    "Prescribed",
    "Pressure",
    "Qoco",
    "Quadrature",
    "Recorder",
    "Scene",
    "Schedule",
    "Support",
    "Swift",
    "Tabulated",
    "Tangent",
    "Traction",
    "Voce",
    "VonMises",
    "block",
    "cylinder",
    "load",
    "march",
    "ring",
    "upsetting",
]
