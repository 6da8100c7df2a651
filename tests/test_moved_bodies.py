"""A body moved against a tool is a tool moved against a body; no increment strains by more than it can tell."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from bipot import (
    Control,
    Elasticity,
    FlatTool,
    Geometry,
    Linear,
    Newton,
    Perfect,
    Prescribed,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    VonMises,
    block,
    flat_punch,
    march,
)
from bipot.checks.refusals import MOST_STRAINED, refuse_motion
from bipot.errors import Refused
from bipot.iterate import Increment, Iterate
from bipot.marching import system_of
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from bipot.scene.translation import nearest, prescribed
from bipot.tools.revolved import sphere
from studies.fuzz.unfolded import unfolded

SOFT = Elasticity(1000.0, 0.3)
SOFT_METAL = VonMises(SOFT, Linear(3.0, 30.0))


def reached(mover: str, mu: float) -> Scene:
    """A punch and a block that come on 0.05 through the air, and aside, by the motion of one or of the other."""
    x, y = 0.08, -0.06
    held = (Prescribed("base", 0, -x), Prescribed("base", 1, -y))
    still = (Support("base", 0), Support("base", 1))
    way = (x, y) if mover == "tool" else (0.0, 0.0)
    tool = ShapedTool(flat_punch((1.0, 1.05), 0.5, 1.0, 0.1), way, ("top",), mu)
    material = VonMises(SOFT, Linear(3.0, 30.0))
    supports = still if mover == "tool" else held
    return Scene(block(2.0, 1.0, 8, 4), Geometry.PLANE_STRAIN, material, supports, tools=(tool,))


@pytest.mark.parametrize("mu", [0.3, 2.0])
@pytest.mark.parametrize("increments", [1, 3])
def test_slip_on_a_curved_tool_begins_where_a_body_that_supports_carry_touches_it(mu, increments):
    """Through the air nothing slips, whoever moves."""
    ends = [list(march(reached(mover, mu), Schedule(increments)))[-1] for mover in ("tool", "body")]
    by_tool, by_body = ((a.tool_force(0), a.energies.friction) for a in ends)
    np.testing.assert_allclose(by_body[0], by_tool[0], rtol=1e-7)
    assert by_body[1] == pytest.approx(by_tool[1], rel=1e-6, abs=1e-12)


def test_a_body_carried_in_space_slips_as_the_tool_does():
    def dented(mover):
        way = np.array([0.05, 0.03, -0.08])
        supports = tuple(Support("base", d) if mover == "tool" else Prescribed("base", d, -way[d]) for d in range(3))
        ball = ShapedTool(sphere((0.5, 0.5, 2.03), 1.0), tuple((way * (mover == "tool")).tolist()), ("top",), 0.4)
        material = VonMises(SOFT, Linear(3.0, 30.0))
        return Scene(brick(1.0, 1.0, 1.0, 3, 3, 2), Geometry.SOLID, material, supports, tools=(ball,))

    force = [list(march(dented(mover), Schedule(2)))[-1].tool_force(0) for mover in ("tool", "body")]
    np.testing.assert_allclose(force[1], force[0], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("squeeze", [1e-8, 1e-2])
@pytest.mark.parametrize("mu", [0.3, 2.0])
def test_slip_does_not_jump_where_supports_ask_for_more_than_a_translation(mu, squeeze):
    """Sides that are squeezed on the way, by next to nothing too: the tool may move, or the body against it."""

    def scene(mover):
        way = np.array([0.08, -0.06])
        gone = -way * (mover == "body")
        sides = Prescribed("left", 0, gone[0] + squeeze), Prescribed("right", 0, gone[0] - squeeze)
        path = tuple((way * (mover == "tool")).tolist())
        return Scene(
            block(2.0, 1.0, 8, 4),
            Geometry.PLANE_STRAIN,
            SOFT_METAL,
            (*sides, Prescribed("base", 1, float(gone[1]))),
            tools=(ShapedTool(flat_punch((1.0, 1.05), 0.5, 1.0, 0.1), path, ("top",), mu),),
        )

    last = [list(march(scene(mover), Schedule(2)))[-1] for mover in ("tool", "body")]
    np.testing.assert_allclose(last[1].tool_force(0), last[0].tool_force(0), rtol=1e-6, atol=1e-9)
    assert last[1].energies.friction == pytest.approx(last[0].energies.friction, rel=1e-5, abs=1e-10)


def test_where_supports_pull_apart_the_body_goes_by_what_is_nearest_to_all_of_them():
    """What they hold goes as they ask."""
    scene = Scene(
        block(2.0, 1.0, 4, 2),
        Geometry.PLANE_STRAIN,
        SOFT_METAL,
        (Support("base", 0), Support("base", 1), Prescribed("top", 0, 0.1)),
        tools=(ShapedTool(flat_punch((1.0, 1.05), 0.5, 1.0, 0.1), (0.0, -0.1), ("top",), 0.3),),
    )
    system = system_of(scene)
    along = Increment(system, system.rest(), 0.5).tools.along
    held = scene.holding.held
    np.testing.assert_allclose(along[held], scene.driven(0.5)[held], atol=1e-17)
    np.testing.assert_allclose(along[~held[:, 0], 0], 0.025)
    np.testing.assert_array_equal(along[:, 1], 0.0)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_half_a_body_goes_as_the_whole_does_where_supports_pull_apart(angle):
    """Its plane of symmetry holds: it is no support among others, which the whole body has twice."""
    way = np.array([np.cos(angle), np.sin(angle)])
    mirror = np.eye(2) - 2 * np.outer(way, way)
    others, asked, ones = np.array([[0.6, 0.8], [0.0, 1.0]]), np.array([0.1, 0.3]), np.ones(5)
    half = nearest(others, asked, ones[:2], way[None])
    whole = nearest(np.vstack([others, others @ mirror, way]), np.array([*asked, *asked, 0.0]), ones, [])
    np.testing.assert_allclose(half, whole, atol=1e-15)
    assert abs(half @ way) < 1e-16


def test_what_is_asked_for_across_planes_of_symmetry_alone_takes_nothing_along():
    slanted = np.array([0.36, 0.48, 0.8])
    np.testing.assert_allclose(nearest(slanted[None], np.ones(1), np.ones(1), slanted[None]), 0.0, atol=1e-12)


def test_half_a_support_within_a_plane_of_symmetry_is_its_image_s():
    """The whole body has one of it and two of the others: friction where a gap opens was 1 % off that of the whole."""
    mesh, far = block(2.0, 1.0, 4, 2), (0.6, 0.8)
    held = (Symmetry("base", 1), Support("base", 0), Prescribed("top", far, 0.1))
    half = Scene(mesh, Geometry.PLANE_STRAIN, SOFT_METAL, held, ())
    (whole,) = (variant.scene for variant in unfolded(half))
    moved = [prescribed(scene, scene.supports, 0.0, 1.0) for scene in (half, whole)]
    np.testing.assert_allclose(moved, [[0.1 * 0.6 / (0.5 + 0.6**2), 0.0]] * 2, atol=1e-15)


def test_a_support_counts_by_the_area_that_it_holds():
    """Whether its boundary is one or several."""
    mesh = block(2.0, 1.0, 4, 2)
    parts = {"low": mesh.boundaries["top"][:1], "high": mesh.boundaries["top"][1:]}
    mesh = replace(mesh, boundaries={**mesh.boundaries, **parts})
    moved, still = partial(Prescribed, direction=0, displacement=0.3), Support("base", 0)
    for names in (("top",), ("low", "high")):
        scene = Scene(mesh, Geometry.PLANE_STRAIN, SOFT_METAL, (still, *map(moved, names)), ())
        np.testing.assert_allclose(prescribed(scene, scene.supports, 0.0, 1.0), [0.15, 0.0])


def sheared(element: Element, n: int) -> Scene:
    """A block in simple shear, all its sides held: it flows freely at a constant stress."""
    held = (Support("base", 0), *(Support(side, 1) for side in ("base", "top", "left", "right")))
    mesh = block(1.0, 1.0, n, n, element=element)
    material = VonMises(SOFT, Perfect(3.0))
    return Scene(mesh, Geometry.PLANE_STRAIN, material, (*held, Prescribed("top", 0, 0.05)))


@pytest.mark.parametrize(("element", "n", "increments"), [(Element.Q4, 2, 10), (Element.T6, 2, 6), (Element.Q9, 2, 12)])
def test_a_body_that_flows_freely_does_not_shear_itself_to_and_fro(element, n, increments):
    """The midpoint's equations have solutions of 400 % of shear, which dissipate a hundred times the work."""
    top, force, work, spent, peeq = sheared(element, n).mesh.boundary_nodes("top"), 0.0, 0.0, 0.0, 0.0
    for a in march(sheared(element, n), Schedule(increments), Control(Newton())):
        now = a.solved.iterate.reactions(a.solved.r)[top, 0].sum()
        work += (now + force) / 2 * a.state.du[top[0], 0]
        spent += 3.0 * float((a.peeq - peeq).mean())
        force, peeq = now, a.peeq
        assert np.abs(a.state.du).max() < 0.05
    assert spent == pytest.approx(work, rel=0.05)


def test_more_strain_than_an_increment_can_tell_is_refused_by_element():
    scene = sheared(Element.Q4, 2)
    system = system_of(scene)
    increment = Increment(system, system.rest(), 1.0)

    def shorn(by):
        """Simple shear is an equivalent strain of ``by`` over the root of three."""
        u = np.column_stack([by * scene.mesh.nodes[:, 1], np.zeros(len(scene.mesh.nodes))])
        return Iterate(increment, system.body.respond(increment.start, np.zeros(increment.size), u))

    refuse_motion(shorn(1.7 * MOST_STRAINED), np.zeros((0, 2)))
    with pytest.raises(Refused, match=r"element \d is strained by 1\.04 in one increment"):
        refuse_motion(shorn(1.8 * MOST_STRAINED), np.zeros((0, 2)))


@pytest.mark.parametrize("turned", [False, True])
def test_a_body_that_supports_carry_by_more_than_an_element_is_solved_as_at_rest(turned):
    """It is pressed between ends that go along, both in the direction in which it is pressed or both across it."""

    def ends(way: float):
        across, down = (0, 1) if turned else (1, 0)
        driven = Prescribed("base", across, way), Prescribed("top", across, way - 0.1 * (not turned))
        rest = Support("base", down), Prescribed("top", down, -0.1 * turned)
        scene = Scene(block(1.5, 1.0, 3, 2), Geometry.PLANE_STRAIN, SOFT_METAL, (*driven, *rest))
        return next(march(scene, Schedule(4), Control(Newton(), ())))

    still, carried = ends(0.0), ends(12.0)
    assert carried.cuts == 0
    assert carried.unique
    np.testing.assert_allclose(carried.stress.matrix, still.stress.matrix, atol=3e-6 * 3.0)


def upset_brick(way: tuple[float, float, float], aside: float, mu: float) -> Scene:
    """A brick upset by a tenth, its lid going ``aside`` as well, while all goes by ``way`` with its supports."""
    held = tuple(Prescribed(name, d, way[d]) for d, name in enumerate(("left", "front", "base")))
    lid = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (way[0] + aside, way[1], way[2] - 0.1), ("top",), mu)
    material = VonMises(Elasticity(70_000.0, 0.33), Linear(100.0, 500.0))
    return Scene(brick(2.0, 2.0, 1.0, 3, 3, 2), Geometry.SOLID, material, held, tools=(lid,))


@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.1, 0.2, -0.3), (0.0, 0.0, 1.0)])
@pytest.mark.parametrize(("aside", "mu"), [(0.0, 0.0), (0.0, np.inf), (0.05, 0.2)])
def test_increments_by_accuracy_are_those_of_a_body_whose_supports_rest(way, aside, mu):
    """Ten to forty times as many were taken where all was carried along by half of the body's length."""
    still, carried = (
        list(march(upset_brick(along, aside, mu), Schedule(accuracy=1e-3), Control(Newton())))
        for along in ((0.0, 0.0, 0.0), way)
    )
    assert [a.passes for a in carried] == [a.passes for a in still]
    np.testing.assert_allclose([a.state.tau for a in carried], [a.state.tau for a in still], rtol=1e-6)
    force = np.array([a.tool_forces for a in still])
    np.testing.assert_allclose([a.tool_forces for a in carried], force, rtol=0, atol=1e-6 * np.abs(force).max())
