"""A body between tools that move together goes with them: its increments and passes are those between tools at rest."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.advance import shortest
from bipot.control.accepted import Accepted
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton
from bipot.iterate import Increment
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool, ShapedTool
from bipot.yielding import strain_of

METAL = VonMises(Elasticity(70_000.0, 0.33), Linear(100.0, 500.0))
STILL = Support("left", 0)


def upset(way: tuple[float, float], mu: float = 0.2, force: float = 0.0) -> Scene:
    """A block on a floor, upset by a lid by a tenth or by a ``force``, while both go by ``way``."""
    closing, driven_by = (0.0, Force((0.0, -force))) if force else (-0.1 + way[1], None)
    lid = FlatTool((0.0, 1.0), (0.0, -1.0), (way[0], closing), ("top",), mu, driven_by=driven_by)
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), way, ("base",), mu)
    return Scene(block(2.0, 1.0, 6, 3), Geometry.PLANE_STRAIN, METAL, (), tools=(lid, floor))


def upset_brick(way: tuple[float, float, float]) -> Scene:
    """The same in space, the lid going aside as well."""
    lid = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (way[0] + 0.03, way[1], way[2] - 0.1), ("top",), 0.2)
    floor = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), way, ("base",), 0.2)
    return Scene(brick(2.0, 2.0, 1.0, 3, 3, 2), Geometry.SOLID, METAL, (), tools=(lid, floor))


def held(scene: Scene, way: float) -> Scene:
    """Its left side goes along by a support."""
    return replace(scene, supports=(Prescribed("left", 0, way),))


MOVED = [
    (upset((0.0, 0.0)), upset((0.0, -0.5))),
    (upset((0.0, 0.0)), upset((-0.3, 0.4))),
    (held(upset((0.0, 0.0)), 0.0), held(upset((0.0, -0.5)), 0.0)),
    (held(upset((0.0, 0.0)), 0.0), held(upset((30.0, 20.0)), 30.0)),
    (upset((0.0, 0.0), 0.2, 60.0), upset((0.2, -0.5), 0.2, 60.0)),
    (upset_brick((0.0, 0.0, 0.0)), upset_brick((0.3, 0.2, -0.4))),
]


@pytest.mark.parametrize(("still", "moved"), MOVED)
@pytest.mark.parametrize("schedule", [Schedule(accuracy=1e-3), Schedule(3)], ids=["by accuracy", "fixed"])
def test_increments_between_tools_that_move_together_are_those_between_tools_at_rest(still, moved, schedule):
    """By accuracy two to five times as many were taken where all went down by half of the block's height."""
    ends = [list(march(scene, schedule, Control(Newton(), ()))) for scene in (still, moved)]
    taus, forces, passes = (
        [[part(a) for a in end] for end in ends]
        for part in (lambda a: a.state.tau, lambda a: a.tool_forces, lambda a: a.passes)
    )
    assert passes[1] == passes[0]
    np.testing.assert_allclose(taus[1], taus[0], rtol=1e-6)
    np.testing.assert_allclose(forces[1], forces[0], rtol=0, atol=1e-6 * float(np.abs(forces[0]).max()))


@pytest.mark.parametrize("way", [(0.2, -0.5), (0.0, 0.4)])
def test_increments_under_a_force_are_as_long_where_supports_carry_the_body(way):
    """The lid goes with the body: how far is no strain, which let the body yield in a fifth of the increments."""
    base = (Support("left", 0), Support("base", 1))
    carried = (Prescribed("left", 0, way[0]), Prescribed("base", 1, way[1]))
    still, moved = (
        [a.state.tau for a in march(replace(scene, supports=by, tools=scene.tools[:1]), Schedule(accuracy=1e-3))]
        for scene, by in ((upset((0.0, 0.0), 0.2, 300.0), base), (upset(way, 0.2, 300.0), carried))
    )
    np.testing.assert_allclose(moved, still, rtol=1e-6)


def test_the_shortest_mean_is_that_of_the_hull():
    """All ways are beyond the plane through it that is across it."""
    rng = np.random.default_rng(5)
    for size in (1, 2, 3):
        ways = rng.normal(size=(5, size)) + 2 * rng.normal(size=size)
        mean = shortest(ways)
        assert ((ways - mean) @ mean).min() > -1e-12
    np.testing.assert_array_equal(shortest(np.array([[0.05, 0.0], [-0.03, 0.0], [0.0, 0.0]])), 0.0)


def gone(scene: Scene) -> np.ndarray:
    """The way of a body from rest."""
    system = system_of(scene)
    return Increment(system, system.rest(), 1.0).tools.gone


def test_a_body_goes_as_tools_that_touch_it_go_together():
    """Without friction they do not drag it along, and what recedes alone takes nothing with it."""
    both, lid, floor = upset((0.5, -0.4)), *upset((0.5, -0.4)).tools
    np.testing.assert_allclose(gone(both), (0.5, -0.4), atol=1e-12)
    np.testing.assert_allclose(gone(held(both, 0.2)), (0.2, -0.4), atol=1e-12)
    np.testing.assert_allclose(gone(upset((0.5, -0.4), 0.0)), (0.0, -0.4), atol=1e-12)
    np.testing.assert_allclose(gone(upset((0.5, -0.4), 0.2, 60.0)), (0.5, -0.4), atol=1e-12)
    np.testing.assert_array_equal(gone(replace(both, tools=(floor,))), 0.0)
    above = replace(lid, point=(0.0, 1.01))
    np.testing.assert_array_equal(gone(replace(both, tools=(above, floor))), 0.0)
    rests = replace(floor, travel=(0.0, 0.0))
    np.testing.assert_array_equal(gone(replace(both, tools=(lid, rests))), 0.0)


@pytest.mark.parametrize("way", [0.6, -0.6])
def test_a_roll_that_dents_a_body_on_a_floor_does_not_carry_it(way):
    """Of both ways the shorter one is that of the roll where all goes up, and increments were a third fewer."""
    roll = ShapedTool(Circle((1.0, 2.5), 1.5), (0.0, way - 0.02), ("top",), 0.3)
    floor = upset((0.0, way)).tools[1]
    np.testing.assert_allclose(gone(replace(upset((0.0, way)), tools=(roll, floor))), (0.0, way), atol=1e-12)


@pytest.mark.parametrize("way", [0.05, 0.03])
def test_a_body_that_tools_squeeze_from_both_sides_stays(way):
    both = upset((0.0, way))
    np.testing.assert_array_equal(gone(both), 0.0)


@pytest.mark.parametrize("way", [(0.1, -0.4), (0.0, -0.5), (-0.7, 1.3), (1e-5, 1e-7)])
def test_what_goes_along_together_strains_nothing(way):
    """Strains of round-off made the first increment one of a hundred times the whole way, or not."""
    lid, floor = upset(way).tools
    closes = replace(lid, travel=way)
    slanted = (Prescribed("left", (0.6, 0.8), 0.6 * way[0] + 0.8 * way[1]), Prescribed("right", 0, way[0]))
    for supports, tools in (((), (closes, floor)), (slanted, (closes,)), (slanted, (closes, floor))):
        system = system_of(replace(upset(way), supports=supports, tools=tools))
        assert strain_of(Increment(system, system.rest(), 1.0)) == 0.0


def test_how_far_all_goes_is_no_unit_of_a_program():
    """Four thousand times as far as the lid comes down: the program stalled, and 281 passes were taken for 2."""
    material = VonMises(Elasticity(70_000.0, 0.45), Perfect(210.0))

    def landed(way: float) -> Accepted:
        lid = FlatTool((0.0, 1.00003), (0.0, -1.0), (0.0, way - 0.00013), ("top",), 0.1)
        held = (Prescribed("base", 1, way),)
        scene = Scene(block(1.0, 1.0, 3, 2), Geometry.PLANE_STRAIN, material, held, tools=(lid,))
        return next(march(scene, Schedule(1), Control(Dissipation(), ())))

    still, moved = landed(0.0), landed(0.6)
    assert moved.cuts == 0
    assert moved.passes <= still.passes + 8
    lengths = [a.solved.iterate.increment.units.length for a in (still, moved)]
    assert lengths[1] == pytest.approx(lengths[0], rel=1e-9)
    np.testing.assert_allclose(moved.tool_forces, still.tool_forces, rtol=0, atol=1e-6 * 9.0)


@pytest.mark.parametrize("way", [(1e-6, -2e-7), (0.0, -0.004), (0.0024, 0.0017)])
def test_little_travel_is_as_much_as_none_for_a_body_that_rests_on_it(way):
    """The iteration began where the body was left behind: its last motion, none, was taken for another start."""
    still, moved = (list(march(upset(by, 0.2, 150.0), Schedule(3), Control(Newton(), ()))) for by in ((0.0, 0.0), way))
    assert [a.passes for a in moved] == [a.passes for a in still]


@pytest.mark.parametrize(
    ("lid", "mu", "force", "gone"),
    [
        ((0.3, -0.4), 0.2, 0.0, (0.3, -0.4)),
        ((0.3, -0.4), 0.0, 0.0, (0.0, -0.4)),  # without friction along normals alone
        ((0.1, -0.4), 0.2, 0.0, (0.1, -0.4)),  # the shortest mean of both ways
        ((0.3, 0.0), 0.2, 60.0, (0.3, -0.4)),  # what a force drives goes with the body
        ((0.0, 0.0), 0.2, 0.0, (0.0, 0.0)),  # one rests
    ],
)
def test_tools_take_a_body_along_by_what_they_have_in_common(lid, mu, force, gone):
    """The floor goes by (0.3, -0.4)."""
    by = Force((0.0, -force)) if force else None
    scene = upset((0.3, -0.4), mu)
    scene = replace(scene, tools=(replace(scene.tools[0], travel=lid, driven_by=by), scene.tools[1]))
    system = system_of(scene)
    np.testing.assert_allclose(Increment(system, system.rest(), 1.0).tools.gone, gone, atol=1e-12)


def test_slips_on_flat_tools_begin_at_once_also_beside_curved_ones():
    """On a roll they begin where it lands."""
    lid = FlatTool((0.0, 1.05), (0.0, -1.0), (0.0, -0.1), ("top",), 0.2)
    roll = ShapedTool(Circle((3.05, 0.5), 1.0), (-0.1, 0.0), ("right",), 0.2)
    scene = Scene(block(2.0, 1.0, 6, 2), Geometry.PLANE_STRAIN, METAL, (STILL, Support("base", 1)), tools=(lid, roll))
    system = system_of(scene)
    tools, flat = Increment(system, system.rest(), 1.0).tools, system.candidates.tool == 0
    left = tools.left(tools.path)
    np.testing.assert_array_equal(left[flat], system.rest().gap[flat])
    assert left[flat] == pytest.approx(np.full(flat.sum(), 0.05))
    assert left[~flat].min() == pytest.approx(0.0, abs=1e-9)
