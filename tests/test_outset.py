"""The first passes of an increment from rest far past first yield: soft flow, from where Newton is quick."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Control, FlatTool, Linear, Newton, Perfect, Pressure, Schedule, Support, VonMises, march, upsetting
from bipot.control.accepted import Accepted
from bipot.errors import BipotError, InvertedElement, NotConverged, ProgramError
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation
from bipot.forms.outset import flow_modulus
from bipot.iterate import Increment
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, RateVonMises
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, ring
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Symmetry
from bipot.system import system_of
from bipot.tools.poses import Force
from tests.deformable import pressed as parts

STEEL = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 1000.0))
PLANES = Symmetry("left", 0), Symmetry("front", 1), Support("base", 2)


def eighth(mu: float = 0.1, press: float = 0.05) -> Scene:
    """A cube in space beneath a flat tool."""
    tool = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -press), ("top",), mu)
    return Scene(brick(1.0, 1.0, 1.0, 2, 2, 2), Geometry.SOLID, STEEL, PLANES, (tool,))


def free(lower: float = 0.1) -> Scene:
    """A cube between two flat tools, which friction alone holds."""
    below = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), lower)
    scene = eighth(0.1)
    return replace(scene, supports=(), tools=(*scene.tools, below))


def pulled() -> Scene:
    """A round bar that supports pull: no tool."""
    held = Support("left", 0), Support("base", 1), Prescribed("top", 1, 0.05)
    return Scene(block(1.0, 1.0, 3, 3), Geometry.AXISYMMETRIC, STEEL, held)


def rubbed(mu: float) -> Scene:
    """A ring between two flat tools, which friction alone holds."""
    above = FlatTool((0.0, 0.5), (0.0, -1.0), (0.0, -0.025), ("top",), mu)
    below = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), mu)
    mesh = ring(0.7, 1.7, 0.5, 5, 2, element=Element.Q4)
    return Scene(mesh, Geometry.AXISYMMETRIC, STEEL, (), (above, below))


ALONE = Control(Newton(), ())


def first(scene: Scene, control: Control = ALONE) -> Accepted:
    """The only increment."""
    return next(march(scene, Schedule(1), control))


SHORT = {
    "a cylinder of quadratic elements": (lambda: upsetting(mu=0.1, reduction=0.05), 6),
    "one whose side comes near to the tool": (
        lambda: upsetting(mu=0.1, reduction=0.05, elements=20, element=Element.Q4),
        7,
    ),
    "a cube": (eighth, 6),
    "beneath a welded tool": (lambda: eighth(np.inf), 7),
    "held by friction alone": (free, 8),
    "pressed by a sixth under high friction": (lambda: eighth(0.5, 0.15), 6),
    "a ring to which tools stick": (lambda: rubbed(0.5), 6),
    "pulled by supports": (pulled, 7),
}


@pytest.mark.parametrize(("make", "most"), SHORT.values(), ids=SHORT)
def test_a_first_increment_far_past_yield_takes_few_passes(make, most, monkeypatch):
    """Fewer than from the elastic answer, and both reach one answer, which is that of the dissipation program."""
    quick = first(make())
    assert quick.passes <= most
    monkeypatch.setattr("bipot.forms.newton.flow_from_rest", lambda *given: None)
    slow = first(make(), Control(Newton(), (Dissipation(),)))
    assert quick.passes < slow.passes
    force = np.abs(slow.solved.response.element_forces).max()
    assert np.abs(quick.solved.response.element_forces - slow.solved.response.element_forces).max() < 1e-6 * force


def increment(scene: Scene, tau: float = 1.0) -> Increment:
    """The first increment, to the pseudo-time ``tau``."""
    system = system_of(scene)
    return Increment(system, system.rest(), tau)


def test_the_modulus_of_flow_is_the_secant_modulus_at_the_strain_by_which_the_tools_go():
    """sigma_Y(eps) / (3 eps), by hand."""
    found = flow_modulus(increment(eighth(press=0.04)))
    assert found is not None
    np.testing.assert_allclose(found, (300.0 + 1000.0 * 0.04) / (3 * 0.04), rtol=1e-12)


def squeezed() -> Scene:
    """The cube, with a tool beside it that a force drives."""
    force = Force((-1.0, 0.0, 0.0))
    beside = FlatTool((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), ("right",), 0.0, driven_by=force)
    return replace(eighth(), tools=(*eighth().tools, beside))


PLANE = Scene(
    block(1.0, 1.0, 2, 2),
    Geometry.PLANE_STRAIN,
    STEEL,
    (Symmetry("left", 0), Support("base", 1)),
    (FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.05), ("top",), 0.1),),
)
NONE = {
    "short": increment(eighth(), 0.2),
    "elastic": increment(replace(eighth(), material=Elastic(STEEL.elasticity))),
    "without a return map": increment(replace(eighth(), material=RateVonMises(STEEL.elasticity, STEEL.hardening))),
    "next to no yield stress": increment(replace(eighth(), material=VonMises(STEEL.elasticity, Perfect(1e-3)))),
    "loaded": increment(replace(eighth(), loads=(Pressure("right", 1.0),))),
    "driven by a force": increment(squeezed()),
    "plane strain": increment(PLANE),
}


@pytest.mark.parametrize("given", NONE.values(), ids=NONE)
def test_what_does_not_flow_from_rest_has_no_such_modulus(given):
    assert flow_modulus(given) is None


def test_what_has_begun_to_flow_does_not_begin_again():
    second = list(march(eighth(), Schedule(2)))[1].solved.iterate.increment
    assert flow_modulus(second) is None
    assert flow_modulus(replace(second, start=replace(second.start, length=0.0))) is None


class Failing:
    """A linearisation that raises ``error``."""

    def __init__(self, error: type[BipotError]) -> None:
        self.error, self.asked = error, 0

    def of(self, *given: object) -> None:
        self.asked += 1
        raise self.error("no flow")


@pytest.mark.parametrize("error", [InvertedElement, NotConverged, ProgramError])
def test_newton_begins_at_rest_where_flow_folds_an_element_or_nothing_holds_the_body(error, monkeypatch):
    failing = Failing(error)
    monkeypatch.setattr("bipot.forms.outset.Linearised", failing)
    with_flow = first(eighth())
    monkeypatch.setattr("bipot.forms.newton.flow_from_rest", lambda *given: None)
    assert failing.asked == 1
    assert np.array_equal(with_flow.state.nodes, first(eighth()).state.nodes)


def test_a_tool_that_comes_to_touch_a_body_goes_with_one_that_touches_it_already():
    """The cube rests on one tool; the other begins a tenth of its way above."""
    above = replace(free().tools[0], point=(0.0, 0.0, 1.005))
    assert first(replace(free(), tools=(above, free().tools[1]))).state.tau == 1.0


def test_in_the_next_configuration_of_deformable_tools_flow_goes_on():
    """Begun anew in each, it stayed as far from rest as an iterate is that shows where nodes end."""
    first = next(march(parts(press=2.5), Schedule(12), Control(Newton(), ())))
    assert first.passes <= 12
