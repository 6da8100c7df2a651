"""bipot: elastoplastic bodies in large deformation with exact Coulomb friction, posed as conic programs.

Each pass of an increment is a conic program, solved by semismooth Newton steps on its optimality conditions or, where
these do not end exactly, by an interior-point solver. A scene describes the problem, a schedule its increments, a
control how they are solved; :func:`march` yields accepted increments, each with its results by name and its
certificate. These are the public names by subject; everything else is in the submodules, one subject each:

* scene: Scene, Support, Symmetry, Prescribed, Geometry, Configuration, Quadrature, VolumeChange, upsetting
* tools: FlatTool, ShapedTool, DeformableTool, Sampling, Force, Moment, Turn
* surfaces of tools: Plane, Circle, Profile, Union, wedge, flat_punch, Revolved, sphere, roll, cone, Extruded
* meshes: Mesh, Element, Layout, Fine, block, cylinder, ring, brick, cylinder_3d, ring_3d, together, apart
* loads: BodyForce, Traction, PointForce, Pressure, Amplitude
* material: Material, VonMises, Elastic, Elasticity
* hardening: Hardening, Perfect, Linear, Voce, Swift, Tabulated
* limit loads: limit_load, LimitLoad
* march: march, handed_on, transferred, Transfer, Course, Schedule, Control, Integration, Limits, Bounds, Locate
* change with parameters: sensitivities, Slope
* forms: Tangent, TangentKind, Dissipation, Newton, Delassus, Penalty, Uzawa, Optimiser, Safeguard
* linear algebra of Newton: SuperLU, Pardiso
* conic programs: conic_program, ConicProgram, ConicSolution, Accuracy, Clarabel, Qoco, Cvxpy
* contact problems: contact_problem, ContactProblem, export_fclib
* results: Accepted, State, Components, Certificate, Energies
* files: Recorder, Existing, History
* errors: BipotError, SceneError, ResultsError, IncrementFailed, LimitPassed
* errors of attempts: NotConverged, Refused, InvertedElement, FoldedAnswer
* errors of programs: ProgramError, StalledProgram, InfeasibleProgram, UnboundedProgram, UnsuitedForm
* errors of solvers and files: BrokenSolver, FileError

>>> accepted = next(march(upsetting(mu=0.1, elements=2), Schedule(45, first=0.001 / 0.45)))
>>> accepted.solved.certificate.relative_gap < 1e-7
True
"""

from bipot.certificate import Bounds, Certificate
from bipot.conic.clarabel import Clarabel
from bipot.conic.file import FileError
from bipot.conic.problem import ConicProgram, ConicSolution
from bipot.conic.qoco import Qoco
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import Cvxpy
from bipot.control.accepted import Accepted
from bipot.control.control import Control
from bipot.control.course import Course
from bipot.control.landing import Locate
from bipot.control.starting import handed_on
from bipot.energy import Energies
from bipot.errors import (
    BipotError,
    BrokenSolver,
    FoldedAnswer,
    IncrementFailed,
    InfeasibleProgram,
    InvertedElement,
    LimitPassed,
    NotConverged,
    ProgramError,
    Refused,
    ResultsError,
    SceneError,
    StalledProgram,
    UnboundedProgram,
    UnsuitedForm,
)
from bipot.exchange import ContactProblem, conic_program, contact_problem, export_fclib
from bipot.fem.elements import Quadrature
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Components, Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Delassus, Dissipation, Newton, Optimiser, Penalty, Tangent, Uzawa
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.laws.hardening import Hardening, Linear, Perfect, Swift, Tabulated, Voce
from bipot.laws.material import Elastic, Material
from bipot.laws.von_mises import Elasticity, TangentKind, VonMises
from bipot.limit_analysis import LimitLoad, limit_load
from bipot.marching import march
from bipot.meshes.cells import Fine
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder, ring
from bipot.meshes.solids import brick, cylinder_3d, ring_3d
from bipot.meshes.together import apart, together
from bipot.paper import upsetting
from bipot.paths import Amplitude
from bipot.programs.factors import Pardiso, SuperLU
from bipot.programs.fixed_point import Safeguard
from bipot.results import Existing, History, Recorder
from bipot.scene.loads import BodyForce, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.schedule import Schedule
from bipot.sensitivity import Slope, sensitivities
from bipot.state import State
from bipot.tools.circle import Circle
from bipot.tools.deformable import DeformableTool
from bipot.tools.extruded import Extruded
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.profiles import Profile, Union, flat_punch, wedge
from bipot.tools.revolved import Revolved, cone, roll, sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from bipot.transfer import Transfer, transferred

__version__ = "0.1.0"

__all__ = [
    "Accepted",
    "Accuracy",
    "Amplitude",
    "BipotError",
    "BodyForce",
    "Bounds",
    "BrokenSolver",
    "Certificate",
    "Circle",
    "Clarabel",
    "Components",
    "Configuration",
    "ConicProgram",
    "ConicSolution",
    "ContactProblem",
    "Control",
    "Course",
    "Cvxpy",
    "DeformableTool",
    "Delassus",
    "Dissipation",
    "Elastic",
    "Elasticity",
    "Element",
    "Energies",
    "Existing",
    "Extruded",
    "FileError",
    "Fine",
    "FlatTool",
    "FoldedAnswer",
    "Force",
    "Geometry",
    "Hardening",
    "History",
    "IncrementFailed",
    "InfeasibleProgram",
    "Integration",
    "InvertedElement",
    "Layout",
    "LimitLoad",
    "LimitPassed",
    "Limits",
    "Linear",
    "Locate",
    "Material",
    "Mesh",
    "Moment",
    "Newton",
    "NotConverged",
    "Optimiser",
    "Pardiso",
    "Penalty",
    "Perfect",
    "Plane",
    "PointForce",
    "Prescribed",
    "Pressure",
    "Profile",
    "ProgramError",
    "Qoco",
    "Quadrature",
    "Recorder",
    "Refused",
    "ResultsError",
    "Revolved",
    "Safeguard",
    "Sampling",
    "Scene",
    "SceneError",
    "Schedule",
    "ShapedTool",
    "Slope",
    "StalledProgram",
    "State",
    "SuperLU",
    "Support",
    "Swift",
    "Symmetry",
    "Tabulated",
    "Tangent",
    "TangentKind",
    "Traction",
    "Transfer",
    "Turn",
    "UnboundedProgram",
    "Union",
    "UnsuitedForm",
    "Uzawa",
    "Voce",
    "VolumeChange",
    "VonMises",
    "apart",
    "block",
    "brick",
    "cone",
    "conic_program",
    "contact_problem",
    "cylinder",
    "cylinder_3d",
    "export_fclib",
    "flat_punch",
    "handed_on",
    "limit_load",
    "march",
    "ring",
    "ring_3d",
    "roll",
    "sensitivities",
    "sphere",
    "together",
    "transferred",
    "upsetting",
    "wedge",
]
