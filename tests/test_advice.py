"""What a march that ends advises where the scene has loads: the load is blamed only where it may be the cause."""

import pickle
from dataclasses import replace

import pytest

from bipot.control.control import Control
from bipot.errors import IncrementFailed, LimitPassed, Refused
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import march
from bipot.meshes.sections import block, ring
from bipot.paths import Amplitude
from bipot.scene.loads import Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Moment, Turn
from bipot.tools.profiles import Profile
from bipot.tools.tool import FlatTool, ShapedTool

METAL = VonMises(Elasticity(1000.0, 0.3), Linear(10.0, 20.0))
FAINT = Pressure("right", 1e-6, Amplitude(((0.0, 1.0), (1.0, 1.0))))
"""A millionth of the yield stress, all the time."""

WHOLE = Scene(
    mesh=block(4.0, 2.0, 4, 2),
    geometry=Geometry.PLANE_STRAIN,
    material=METAL,
    supports=(Symmetry("left", 0), Symmetry("base", 1)),
)


def ends(scene, schedule):
    """How the march ends."""
    with pytest.raises(IncrementFailed) as failed:
        list(march(scene, schedule, Control(Newton(), ())))
    return failed.value


def test_a_load_leaves_what_a_refusal_advises():
    """It said to drive the body by displacements, as a path-driven tool does, because some load was there."""
    mandrel = Profile(((2.2, 3.0), (1.8, 1.0), (1.8, -1.0)), 0.2)
    opened = Scene(
        mesh=ring(2.0, 4.0, 2.0, 4, 3),
        geometry=Geometry.AXISYMMETRIC,
        material=METAL,
        supports=(Support("base", 1),),
        tools=(ShapedTool(mandrel, (0.0, -1.5), ("bore",), 0.1),),
    )
    sharp = replace(WHOLE, tools=(ShapedTool(Circle((1.5, 2.3), 0.3), (0.0, -0.6), ("top",), 0.3),))
    for scene, words in ((opened, "Continue the surface of tools"), (sharp, "Refine the boundary there")):
        for loads in ((), (replace(FAINT, boundary="side" if scene is opened else "right"),)):
            assert words in str(ends(replace(scene, loads=loads), Schedule(6)))


def test_where_a_tool_folds_a_body_that_bears_a_load_a_new_mesh_is_advised_too():
    pressed = replace(WHOLE, tools=(FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -1.9), ("top",), 0.3),))
    steel = replace(pressed, material=VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 200.0)))
    assert "Remesh there: shorter increments fold the element too." in str(
        ends(steel, Schedule(20, first=0.01, settling=1, growth=4.0))
    )
    loaded = str(ends(replace(steel, loads=(FAINT,)), Schedule(20, first=0.01, settling=1, growth=4.0)))
    assert "Remesh there, or load the body less" in loaded


def test_a_roll_that_turns_freely_is_no_load():
    """Its moment is zero, and the advice was to drive the body by displacements."""
    centre = (1.0, 3.0)
    path = ((0.0, 0.0), (0.2, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    roll = ShapedTool(
        Circle(centre, 1.0), (1.5, -1.0), ("top",), 0.2, path, turn=Turn(0.0, centre, driven_by=Moment(0.0))
    )
    held = Support("base", 0), Support("base", 1)
    rolled = replace(WHOLE, mesh=block(4.0, 2.0, 8, 4), supports=held, tools=(roll,))
    assert "Remesh there: shorter increments fold the element too." in str(ends(rolled, Schedule(10)))


def test_a_body_that_loads_alone_strain_is_not_to_be_meshed_anew():
    pulled = replace(WHOLE, loads=(Traction("right", (100.0, 0.0)),))
    failed = ends(pulled, Schedule(4))
    assert isinstance(failed, LimitPassed) or "load" in str(failed)
    assert "Remesh" not in str(failed)
    held = replace(pulled, supports=(*pulled.supports, Prescribed("left", 1, 0.0)))
    assert "Remesh" not in str(ends(held, Schedule(4)))


@pytest.mark.parametrize("begins", [0.0, 1.0])
def test_more_increments_are_not_advised_where_the_load_comes_at_once(begins):
    """It is on at tau = 0, and however short the first increment, the whole load comes in it."""
    amplitude = Amplitude(((0.0, begins), (1.0, 1.0)))
    pulled = replace(WHOLE, loads=(Traction("right", (20.0, 0.0), amplitude),))
    words = str(ends(pulled, Schedule(1)))
    assert ("or use more increments: the load" in words) == (begins == 0)
    assert ("let amplitudes begin at zero" in words) == (begins == 1)


def test_errors_go_from_process_to_process_with_what_they_carry():
    """Pickled ones are made anew from their message alone; what else they have is added."""
    there = pickle.loads(pickle.dumps(Refused("too far", "Use more increments.", too_far=True)))
    assert (str(there), there.advice, there.too_far) == ("too far", "Use more increments.", True)
    passed = LimitPassed("past its limit", fraction=0.5, tau=0.25)
    there = pickle.loads(pickle.dumps(passed))
    assert (str(there), there.fraction, there.tau) == ("past its limit", 0.5, 0.25)
