"""Loads whose parts balance each other: what round-off leaves of them proves no collapse and has no limit load."""

import numpy as np
import pytest

from bipot import (
    Circle,
    Control,
    Elasticity,
    Element,
    FlatTool,
    Force,
    Geometry,
    IncrementFailed,
    LimitPassed,
    Limits,
    Mesh,
    Moment,
    Newton,
    Perfect,
    Pressure,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Traction,
    Turn,
    VolumeChange,
    VonMises,
    block,
    brick,
    limit_load,
    march,
)
from bipot.errors import InfeasibleProgram
from bipot.iterate import Increment
from bipot.limit_analysis import collapse
from bipot.system import system_of

STEEL, SOFT = Elasticity(200_000.0, 0.3), Perfect(100.0)


def pulled(angle=0.0, far=0.0, along=1.0):
    """A block that nothing holds along its smooth base, pulled by tractions on its ends that balance each other."""
    c, s = np.cos(angle), np.sin(angle)
    straight = block(2.0, 1.0, 3, 2)
    mesh = Mesh(straight.nodes @ np.array([[c, s], [-s, c]]) + far, straight.elements, straight.boundaries)
    floor = FlatTool(tuple(mesh.nodes[mesh.boundary_nodes("base")[0]]), (-s, c), (0.0, 0.0), ("base",), 0.0)
    loads = Traction("left", (-c, -s)), Traction("right", (along * c, along * s))
    perfect = VonMises(STEEL, SOFT)
    return Scene(mesh, Geometry.PLANE_STRAIN, perfect, (), (floor,), loads=loads)


@pytest.mark.parametrize("far", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1, 2.0])
def test_what_round_off_leaves_of_balanced_loads_proves_no_collapse(angle, far):
    system = system_of(pulled(angle, far))
    assert collapse(Increment(system, system.rest(), 1.0)) is None
    assert limit_load(pulled(angle, far)).multiple == pytest.approx(200.0 / np.sqrt(3.0), rel=1e-6)


@pytest.mark.parametrize("along", [0.99, 1.01])
def test_a_hundredth_of_the_load_that_is_not_balanced_does(along):
    system = system_of(pulled(0.3, along=along))
    found = collapse(Increment(system, system.rest(), 1.0))
    assert found is not None
    assert found.carried == 0


def test_a_march_that_fails_does_not_lay_it_on_balanced_loads():
    control = Control(Newton(), fallbacks=(), limits=Limits(passes=1), cuts=1)
    with pytest.raises(IncrementFailed, match="newton") as caught:
        list(march(pulled(1.1), Schedule(4), control))
    assert not isinstance(caught.value, LimitPassed)


@pytest.mark.parametrize("element", [Element.H8, Element.T10])
@pytest.mark.parametrize("size", [1e-5, 0.3, 700.0])
def test_a_brick_on_rollers_that_is_pressed_evenly_carries_its_yield_stress(size, element):
    """Across the load its parts are round-off alone, and nothing holds the brick there."""
    straight = brick(1.0, 1.2, 0.9, 2, 2, 2, element=element)
    lean = np.array([[1.0, 0.1, 0.0], [-0.1, 0.9, 0.0], [0.0, 0.0, 1.1]])
    mesh = Mesh(size * straight.nodes @ lean, straight.elements, straight.boundaries)
    steel, load = VonMises(STEEL, SOFT), (Pressure("top", 1.0),)
    scene = Scene(mesh, Geometry.SOLID, steel, (Support("base", 2),), loads=load)
    assert limit_load(scene).multiple == pytest.approx(100.0, rel=1e-6)


@pytest.mark.parametrize("size", [1e-5, 1.0, 700.0])
def test_a_gain_by_round_off_is_none_where_a_turned_brick_locks(size):
    """Two elements that keep the volume at every point keep that under the pressed face."""
    straight, turn = brick(1.0, 1.2, 0.9, 1, 1, 2), np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    mesh = Mesh(size * straight.nodes @ turn.T, straight.elements, straight.boundaries)
    held = tuple(Support("base", tuple(way)) for way in turn.T)
    steel, load = VonMises(STEEL, SOFT), (Pressure("top", 1.0),)
    with pytest.raises(InfeasibleProgram, match="elements that lock"):
        limit_load(Scene(mesh, Geometry.SOLID, steel, held, loads=load, volume=VolumeChange.AS_IS))


def test_a_roll_that_spins_on_a_body_at_rest_collapses_without_motion_of_it():
    """Friction bears moments up to mu times the force and the radius, 0.03."""
    turn = Turn(0.0, (1.0, 1.3), driven_by=Moment(0.05))
    circle, force = Circle((1.0, 1.3), 0.3), Force((0.0, -1.0))
    roll = ShapedTool(circle, (0.0, 0.0), ("top",), 0.1, turn=turn, driven_by=force)
    held = Support("base", 0), Support("base", 1)
    scene = Scene(block(2.0, 1.0, 8, 4), Geometry.PLANE_STRAIN, VonMises(STEEL, SOFT), held, (roll,))
    found = limit_load(scene)
    assert found.multiple == 0
    assert not found.motion.any()
