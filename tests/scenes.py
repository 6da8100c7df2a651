"""Small ready-made scenes and increments for tests: a block under a tool, a system, the program of one pass."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import touches
from bipot.control.accepted import Accepted
from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Form, Newton, Tangent
from bipot.laws.hardening import Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.paper import upsetting
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block, ContactRows, Units
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.terms import ContactTerms
from bipot.response import TangentKind
from bipot.scene.loads import Load
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.system import System
from bipot.tools.tool import FlatTool
from bipot.typing import Floats

FIRST = 0.001
DIRECT = Tangent()

PLANES = (Geometry.AXISYMMETRIC, Geometry.PLANE_STRAIN)


def path(reduction: float, increments: int) -> Schedule:
    """Start-up of 0.1 % of the height, then uniform."""
    return Schedule(increments, first=FIRST / reduction)


@cache
def run(mu: float, elements: int = 4, reduction: float = 0.1, increments: int = 5) -> tuple[Accepted, ...]:
    """A short upsetting, shared by tests."""
    scene = upsetting(mu=mu, reduction=reduction, elements=elements)
    return tuple(march(scene, path(reduction, increments), Control(DIRECT)))


@dataclass(frozen=True)
class Posed:
    """One pass of one increment as programs, with a threshold that is neither zero nor converged."""

    tangent: TangentProgram
    dissipation: DissipationProgram
    rows: ContactRows
    units: Units


@cache
def posed(mu: float = 0.3, after: int = 6) -> Posed:
    """The dimensionless programs of the pass that follows the ``after``-th increment of :func:`run`."""
    accepted = run(mu)[after - 1]
    system = system_of(upsetting(mu=mu, reduction=0.1, elements=4))
    state, dtau = accepted.state, accepted.state.tau - accepted.start.tau
    rows = rows_between(system.candidates, state.gap, state.tau, state.tau + dtau)
    rows = rows.take(rows.gap < 0.2)
    x = (state.velocity * dtau).ravel()[system.body.space.free]
    response = system.body.respond(state, x)
    threshold = rows.threshold(state.forces[: rows.count])
    K = system.body.stiffness(response, TangentKind.CONSISTENT)
    units = Units(0.5 * dtau, 5.0, 300.0, 125.0)
    tangent = TangentProgram(K, K @ x - response.internal, ContactTerms(rows, threshold)).scaled(units)
    model = system.body.plastic_model(response)
    dissipation = DissipationProgram(model, np.zeros(len(x)), ContactTerms(rows, threshold)).scaled(units)
    return Posed(tangent, dissipation, rows, units)


def fresh(mu: float, **options) -> System:
    """A system at rest."""
    return system_of(upsetting(mu=mu, **options))


STEEL = VonMises(Elasticity(210e3, 0.3), Perfect(300.0))


def tool(**changes):
    """A punch that presses a block of unit height by a twentieth."""
    given = {"point": (0.0, 1.0), "normal": (0.0, -1.0), "travel": (0.0, -0.05), "candidates": ("top",), "mu": 0.1}
    return FlatTool(**(given | changes))


def scene(**changes):
    """A block of four elements under that punch."""
    given = {
        "mesh": block(1.0, 1.0, 2, 2, element=Element.Q8),
        "geometry": Geometry.PLANE_STRAIN,
        "material": STEEL,
        "supports": (Support("base", 1), Support("left", 0)),
        "tools": (tool(),),
    }
    return Scene(**(given | changes))


FORMS = (Newton(), Tangent(), Dissipation())


def named(form: Form) -> str:
    """What a test calls a form."""
    return form.name.value


def last(scene: Scene, schedule: Schedule, form: Form) -> Accepted:
    """The last increment of a march by one form alone."""
    return list(march(scene, schedule, Control(form, fallbacks=())))[-1]


def bar(loads: tuple[Load, ...] = (), supports: tuple[Support, ...] = (), length: float = 4.0) -> Scene:
    """A bar along the second axis, its base on rollers, elastic with nu = 0."""
    mesh = block(1.0, length, 2, 8, element=Element.Q8)
    rollers = (Support("base", 1), Support("left", 0))
    return Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1e6, 0.0)), (*rollers, *supports), loads=loads)


def refused(make, words):
    """What is made is refused, and the message has these words (a pattern)."""
    with pytest.raises(SceneError, match=words):
        make()


def rows_between(candidates: Candidates, gap: Floats, tau: float, end: float) -> ContactRows:
    """Contact rows of the increment from ``tau`` to ``end`` that starts with the gaps (c,)."""
    scene = candidates.scene
    return candidates.rows(gap, touches(gap, scene.size), scene.travel(tau, end), scene.driven(end) - scene.driven(tau))


def with_course(accepted, **changes):
    """The increment, told to have ended elsewhere: its state, energies or number changed."""
    course = accepted.course
    forces = changes.get("state", course.state).forces
    largest = max(course.largest, float(np.abs(forces).max(initial=0.0)))
    return replace(accepted, course=replace(course, largest=largest, **changes))


@dataclass(frozen=True)
class Listed(Schedule):
    """A schedule that ends its increments where it is told."""

    ends: tuple[float, ...] = ()

    def times(self):
        return list(self.ends)


def plastic_strain(program, solution):
    """e_p (g, m) of a dissipation program's answer, in coordinates of the basis: dev e - d."""
    m = program.model
    deviator = m.deviatoric @ solution.block(Block.DISPLACEMENT) - solution.block(Block.ELASTIC_DEVIATOR)
    return m.deviator_0 + deviator.reshape(m.stress.shape)
