"""Bodies that friction alone holds, under loads that begin together: statics by every form, up to Coulomb's limit."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.checks.diagnosis import diagnosis
from bipot.errors import IncrementFailed, LimitPassed
from bipot.fem.reduction import Geometry
from bipot.forms import Cache, Dissipation, Newton, Tangent
from bipot.iterate import Increment
from bipot.laws.hardening import Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.limit_analysis import collapse
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.programs.fixed_point import Frozen
from bipot.scene.loads import BodyForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool

METAL = VonMises(Elasticity(70_000.0, 0.33), Perfect(100.0))
FORMS = [Newton(), Tangent(), Dissipation()]


def pushed(part: float) -> Scene:
    """A block on a floor of mu = 0.1, pressed by 20 and pushed along by ``part`` of that."""
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.1)
    load = Traction("top", (part, -1.0))
    return Scene(block(20.0, 10.0, 8, 4), Geometry.PLANE_STRAIN, METAL, (), tools=(floor,), loads=(load,))


def pushed_brick(part: float) -> Scene:
    """The same in space, along a diagonal of a floor of mu = 0.1."""
    floor = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), 0.1)
    load = Traction("top", (0.8 * part, 0.6 * part, -1.0))
    return Scene(brick(2.0, 2.0, 1.0, 2, 2, 2), Geometry.SOLID, METAL, (), tools=(floor,), loads=(load,))


def gripped(part: float) -> Scene:
    """A block between jaws of mu = 0.3 that a force of 20 closes, with ``part`` of that as its weight."""
    left = FlatTool(
        (0.0, 0.0), (1.0, 0.0), travel=(0.0, 0.0), candidates=("left",), mu=0.3, driven_by=Force((20.0, 0.0))
    )
    right = FlatTool((20.0, 0.0), (-1.0, 0.0), travel=(0.0, 0.0), candidates=("right",), mu=0.3)
    load = BodyForce((0.0, -part * 20.0 / 200.0))
    return Scene(block(20.0, 10.0, 4, 4), Geometry.PLANE_STRAIN, METAL, (), tools=(left, right), loads=(load,))


def sloping(slope: float) -> Scene:
    """A block of the weight 20 on a floor of mu = 0.3 that falls by ``slope`` (tangent)."""
    angle, mesh = float(np.arctan(slope)), block(20.0, 10.0, 8, 4)
    along, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    floor = FlatTool((0.0, 0.0), (float(normal[0]), float(normal[1])), (0.0, 0.0), ("base",), 0.3)
    turned = Mesh(mesh.nodes @ np.array([along, normal]), mesh.elements, mesh.boundaries)
    return Scene(turned, Geometry.PLANE_STRAIN, METAL, (), tools=(floor,), loads=(BodyForce((0.0, -0.1)),))


HELD = {
    "pushed": (pushed, (0.001, 0.02, 0.099), lambda part: [[-20.0 * part, 20.0]]),
    "in space": (pushed_brick, (0.02, 0.098), lambda part: [[-3.2 * part, -2.4 * part, 4.0]]),
    "gripped": (gripped, (0.25, 0.55), lambda part: [[20.0, 10.0 * part], [-20.0, 10.0 * part]]),
    "sloping": (sloping, (-0.18, 0.29), lambda _: [[0.0, 20.0]]),
}
CASES = [(make, part, statics(part)) for make, parts, statics in HELD.values() for part in parts]


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name.value)
@pytest.mark.parametrize(("make", "part", "forces"), CASES)
@pytest.mark.parametrize(
    "schedule", [Schedule(1), Schedule(2, first=0.01, settling=1, growth=4.0)], ids=["at once", "from little"]
)
def test_what_friction_can_hold_is_held(make, part, forces, form, schedule):
    """From no force a frozen threshold holds nothing: the program had no minimum, and the march ended at once."""
    last = list(march(make(part), schedule, Control(form)))[-1]
    np.testing.assert_allclose(last.tool_forces, forces, rtol=0, atol=1e-6)
    assert last.cuts == 0


@pytest.mark.parametrize("form", [None, Tangent(), Dissipation()], ids=["default", "tangent", "dissipation"])
@pytest.mark.parametrize(("part", "shear"), [(0.02, 0.5), (0.09, 0.5), (0.05, 0.001)])
def test_capped_friction_holds_as_well(part, shear, form):
    """The last cap, 0.001 k = 0.058 of a pressure of 1, is less than mu = 0.1 of it, and enough."""
    made = pushed(part)
    made = replace(made, tools=(replace(made.tools[0], shear=shear),))
    control = Control() if form is None else Control(form, ())
    (only,) = march(made, Schedule(1), control)
    np.testing.assert_allclose(only.tool_forces, [[-20.0 * part, 20.0]], rtol=0, atol=1e-6)
    assert only.cuts == 0
    if shear == 0.001:
        cap, areas = shear * 100.0 / np.sqrt(3.0), 20.0 / 8
        assert (np.abs(only.solved.r[:, 1]) <= cap * areas * (1 + 1e-3)).all()


@pytest.mark.parametrize(("make", "part"), [(pushed, 0.099), (pushed_brick, 0.05), (gripped, 0.55), (sloping, 0.2)])
def test_forms_find_the_same_motion(make, part):
    ends = [
        list(march(make(part), Schedule(1), Control(form, fallbacks=tuple(FORMS))))[-1].state.nodes for form in FORMS
    ]
    moved = float(np.abs(ends[0] - make(part).mesh.nodes).max())
    for other in ends[1:]:
        np.testing.assert_allclose(other, ends[0], rtol=0, atol=1e-6 * moved)


@pytest.mark.parametrize(
    "form", [Tangent(coupled=False), Dissipation(polished=False)], ids=lambda form: form.name.value
)
def test_after_a_start_by_the_shift_caps_hold_what_they_can(form):
    """The shift knows none: passes went on with it, and each answer had more friction than the caps allow."""
    held = pushed(0.05)
    capped = replace(held, tools=(replace(held.tools[0], shear=0.0012),))
    *_, last = march(capped, Schedule(2, first=0.01, settling=1, growth=4.0), Control(form, ()))
    np.testing.assert_allclose(last.tool_forces, [[-1.0, 20.0]], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    "schedule", [Schedule(1), Schedule(2, first=0.001, settling=1, growth=4.0)], ids=["at once", "from little"]
)
@pytest.mark.parametrize(
    ("make", "part"), [(pushed, 0.101), (pushed, 0.2), (pushed_brick, 0.102), (gripped, 0.61), (sloping, 0.305)]
)
def test_beyond_it_is_said_that_the_body_slides(make, part, schedule):
    with pytest.raises(LimitPassed) as caught:
        list(march(make(part), schedule, Control(cuts=2)))
    assert "The load passes what friction holds" in str(caught.value)
    assert caught.value.fraction == 0.0


def test_an_elastic_body_slides_as_well():
    with pytest.raises(LimitPassed, match="contacts slide or open"):
        list(march(replace(pushed(0.2), material=Elastic(METAL.elasticity)), Schedule(2), Control(cuts=2)))


@pytest.mark.parametrize("turned", np.linspace(-3.0, 3.0, 13))
def test_what_friction_holds_is_not_said_to_be_free(turned):
    """A motion that opens a contact by less than mu times its slip is no cause, though loads push it."""
    c, s = np.cos(turned), np.sin(turned)
    mesh, turn = block(20.0, 10.0, 4, 2), np.array([[c, s], [-s, c]])
    up, along = (float(-s), float(c)), (float(c), float(s))
    floor = FlatTool((0.0, 0.0), up, (0.0, 0.0), ("base",), 1.0)
    wall = FlatTool((0.0, 0.0), along, (0.0, 0.0), ("left",), 1.0)
    body = Mesh(mesh.nodes @ turn, mesh.elements, mesh.boundaries)
    weight = (np.array([0.5, -1.0]) @ turn).tolist()
    below = replace(floor, point=(0.01 * up[0] * -1.0, 0.01 * up[1] * -1.0))
    for tools in ((floor,), (floor, wall), (below,)):
        loads = (BodyForce((weight[0], weight[1])),)
        system = system_of(Scene(body, Geometry.PLANE_STRAIN, METAL, (), tools=tools, loads=loads))
        assert diagnosis(Increment(system, system.rest(), 1.0)) is None


def on_edge(mu: float) -> Scene:
    """A slender block whose weight of 1 is pushed along at its top by 0.3: friction holds, and it tips over."""
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), mu)
    loads = (BodyForce((0.0, -1.0 / 40.0)), Traction("top", (0.3 / 2.0, 0.0)))
    return Scene(block(2.0, 20.0, 2, 8), Geometry.PLANE_STRAIN, METAL, (), tools=(floor,), loads=loads)


def pushed_back() -> Scene:
    """Jaws that a force of 20 closes, against a load of 30 on the jaw that it drives."""
    return replace(gripped(0.1), loads=(BodyForce((-30.0 / 200.0, 0.0)),))


ACROSS = replace(pushed_back(), supports=(Support("base", 1),))
"""The same where a support holds a node of each jaw across the motion: no friction acts there, and none would help."""

SMOOTH = replace(pushed_back(), tools=tuple(replace(tool, mu=0.0) for tool in pushed_back().tools))
"""The same without friction: nothing slips in the motion, so that none would help either."""


@pytest.mark.parametrize(
    "made",
    [on_edge(0.5), on_edge(5.0), pushed_back(), ACROSS, SMOOTH],
    ids=["tips", "rough", "pushed back", "held across", "smooth"],
)
def test_more_friction_is_not_advised_where_none_would_hold(made):
    with pytest.raises(LimitPassed) as caught:
        list(march(made, Schedule(1), Control(cuts=1)))
    assert "by any friction: without strain the body lifts off, tips over" in str(caught.value)
    assert "more friction" not in str(caught.value)
    assert caught.value.fraction == 0.0


def turned(scene: Scene, angle: float) -> Scene:
    """The same scene in another position."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])

    def along(vector):
        return tuple((turn @ vector).tolist())

    mesh = Mesh(scene.mesh.nodes @ turn.T, scene.mesh.elements, scene.mesh.boundaries)
    flat = (tool for tool in scene.tools if isinstance(tool, FlatTool))
    tools = tuple(replace(tool, point=along(tool.point), normal=along(tool.normal)) for tool in flat)
    pushing = (load for load in scene.loads if isinstance(load, Traction | BodyForce))
    loads = tuple(replace(load, vector=along(load.vector)) for load in pushing)
    return replace(scene, mesh=mesh, tools=tools, loads=loads)


def cornered(load: tuple[float, float], mu: float = 0.0) -> Scene:
    """A block on a floor of ``mu`` and by a smooth wall at its left side, under a ``load`` on its top."""
    return replace(
        pushed(0.0),
        tools=tuple(
            FlatTool((0.0, 0.0), normal, (0.0, 0.0), (side,), rubs)
            for normal, side, rubs in (((0.0, 1.0), "base", mu), ((1.0, 0.0), "left", 0.0))
        ),
        loads=(Traction("top", load),),
    )


@pytest.mark.parametrize("angle", [-3.0, -1.75, -1.0, 0.25, 1.5, 2.25, 2.75])
@pytest.mark.parametrize(
    ("made", "kind", "words"),
    [
        (pushed(0.2), LimitPassed, "contacts slide or open"),
        (pushed(5.0), LimitPassed, "by any friction"),
        (on_edge(0.5), LimitPassed, "by any friction"),
        (cornered((1.0, -5.0)), IncrementFailed, "Nothing holds the body"),
        (cornered((-1.0, 1.0)), IncrementFailed, "Nothing holds the body"),
        (cornered((0.0, 1.0), 0.3), IncrementFailed, "Nothing holds the body"),
    ],
    ids=["slides", "pushed over", "tips", "leaves a wall", "lifts off", "off a rough floor"],
)
def test_what_is_claimed_does_not_depend_on_the_position_of_the_scene(made, kind, words, angle):
    """A motion of many that open contacts was asked whether loads push it, another one in each position."""
    with pytest.raises(IncrementFailed) as caught:
        list(march(turned(made, angle), Schedule(1), Control(cuts=1)))
    assert type(caught.value) is kind
    assert words in str(caught.value)


@pytest.mark.parametrize(("part", "slides"), [(0.05, False), (0.2, True)])
def test_of_a_body_that_is_still_to_land_only_what_holds_there_is_claimed(part, slides):
    """Above its floor of mu = 0.1 nothing holds it yet, which says nothing of what friction will hold on it."""
    above = pushed(part)
    above = replace(above, tools=(replace(above.tools[0], point=(0.0, -1e-4)),))
    system = system_of(above)
    assert (collapse(Increment(system, system.rest(), 1.0)) is not None) == slides


@pytest.mark.parametrize("form", [Tangent(), Dissipation()], ids=lambda form: form.name.value)
def test_the_shift_comes_first_only_where_loads_push_the_body(form):
    """Squeezed by pressures in balance it needs no contact, and cones would leave noise of their forces."""
    squeezed = replace(pushed(0.05), loads=(Pressure("left", 8.0), Pressure("right", 8.0)))
    for made, first in ((squeezed, Frozen.THRESHOLD), (pushed(0.05), Frozen.SHIFT)):
        system = system_of(made)
        iterate = Increment(system, system.rest(), 1.0).at(np.zeros(system.body.space.size))
        posed = form.init(iterate, system.rest().forces, Cache())
        assert posed.coupling.frozen is first
