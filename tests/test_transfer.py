"""A body drawn anew: its fields are carried over, its stress comes into balance, and marches go on as without that."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import griddata

from bipot import (
    Control,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Linear,
    Mesh,
    Newton,
    PointForce,
    Prescribed,
    Sampling,
    Scene,
    Schedule,
    Support,
    Symmetry,
    VonMises,
    block,
    brick,
    handed_on,
    march,
    transferred,
)
from bipot.fem.elements import tabulated
from bipot.system import system_of
from bipot.tensors import deviator, equivalent_stress
from bipot.transfer import _mapped
from tests.scenes import refused

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))
DOWN_AND_UP = (0.0, 0.0), (0.9, 1.0), (1.0, 0.9)
NEWTON = Control(Newton())
FINE = Schedule(accuracy=2e-4)


def pressed(mesh, top=1.0, down=0.15, path=DOWN_AND_UP, mu=0.2, **changed):
    """A quarter of a bar in plane strain under a lid that is lifted again."""
    lid = FlatTool((0.0, top), (0.0, -1.0), (0.0, -down), ("top",), mu, path)
    supports = Symmetry("left", 0), Symmetry("base", 1)
    return replace(Scene(mesh, Geometry.PLANE_STRAIN, STEEL, supports, (lid,)), **changed)


def left_by(scene, schedule=FINE):
    *_, last = march(scene, schedule, NEWTON)
    return last.state


def points(scene, nodes):
    """Integration points (e, q, d)."""
    return tabulated(scene.mesh.element, scene.rule).values @ nodes[scene.mesh.elements]


def drawn(scene, nodes, grid):
    """A ``grid`` of the body at rest, deformed as the body whose nodes went to these ones is."""
    return replace(grid, nodes=griddata(scene.mesh.nodes, nodes, grid.nodes))


def bar_of(across, up, element=Element.Q4):
    return block(2.0, 1.0, across, up, element=element)


@pytest.fixture(scope="module")
def bar():
    scene = pressed(bar_of(12, 6))
    return scene, left_by(scene)


def test_on_its_own_mesh_nothing_changes(bar):
    scene, state = bar
    onto = pressed(replace(scene.mesh, nodes=state.nodes), top=0.9)
    found = transferred(state, scene, onto, NEWTON)
    assert abs(found.volume) < 1e-14
    assert abs(found.peeq) < 1e-9
    assert found.moved < 1e-12
    np.testing.assert_allclose(found.state.stress, state.stress, atol=1e-6)
    np.testing.assert_allclose(found.state.peeq, state.peeq, rtol=1e-9)
    np.testing.assert_allclose(found.state.plastic_strain, state.plastic_strain, atol=1e-9)


def test_a_march_goes_on_as_one_that_was_not_drawn_anew(bar):
    scene, state = bar
    again = {"top": 0.88, "down": 0.08, "path": ((0.0, 0.0), (1.0, 1.0))}
    same, onto = pressed(scene.mesh, **again), pressed(drawn(scene, state.nodes, bar_of(12, 6)), **again)
    found, taus = transferred(state, scene, onto, NEWTON), (0.4, 0.6, 0.8, 1.0)
    schedule = Schedule(accuracy=2e-4, landings=taus[:-1])
    kept, anew = (
        [step.tool_force(0) for step in march(to, schedule, NEWTON, start) if step.state.tau in taus]
        for to, start in ((same, handed_on(state, same)), (onto, found.state))
    )
    np.testing.assert_allclose(anew, kept, rtol=0.003)
    assert abs(found.peeq) < 2e-3
    assert found.moved < 1e-4


@pytest.mark.parametrize(
    ("geometry", "element", "other"),
    [
        (Geometry.PLANE_STRAIN, Element.Q4, Element.Q8),
        (Geometry.PLANE_STRAIN, Element.Q8, Element.T6),
        (Geometry.AXISYMMETRIC, Element.Q9, Element.Q4),
        (Geometry.SOLID, Element.H8, Element.T10),
        (Geometry.SOLID, Element.H20, Element.H8),
    ],
)
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_linear_fields_are_met_exactly_by_any_elements(geometry, element, other, unit):
    """Those of a body bent so that its stress balances no force: only the mapping is asked."""

    def scene(kind, *counts):
        d, sides = len(counts), np.array([2.0, 1.0, 1.5][: len(counts)]) * unit
        mesh = (block if d == 2 else brick)(*sides.tolist(), *counts, element=kind)
        return Scene(mesh, geometry, STEEL, (*(Support("base", k) for k in range(d)), Support("left", 0)))

    counts = ((4, 3), (3, 5)) if geometry is not Geometry.SOLID else ((3, 2, 2), (2, 3, 2))
    before, after = system_of(scene(element, *counts[0])), system_of(scene(other, *counts[1]))
    rest, d = before.rest(), len(counts[0])
    slopes = np.random.default_rng(1).normal(size=(d, 2 * rest.stress.shape[-1] + 1)) / unit

    def fields(system):
        return points(system.body.scene, system.body.scene.mesh.nodes) @ slopes + 5.0

    size = rest.stress.shape[-1]
    stress, plastic, peeq = np.split(fields(before), [size, 2 * size], axis=-1)
    state = replace(rest, stress=stress, plastic_strain=plastic, peeq=peeq[..., 0])
    mapped = _mapped(state, before, after)
    expected = fields(after)
    np.testing.assert_allclose(mapped.plastic_strain, expected[..., size : 2 * size], atol=1e-9)
    np.testing.assert_allclose(mapped.peeq, np.maximum(expected[..., -1], 0.0), atol=1e-9)
    np.testing.assert_allclose(deviator(mapped.stress), deviator(expected[..., :size]), atol=1e-9)


def test_what_comes_is_within_the_yield_surface_and_of_the_elements_pressures(bar):
    scene, state = bar
    onto = pressed(drawn(scene, state.nodes, bar_of(7, 9, Element.Q8)), top=0.9)
    after = transferred(state, scene, onto, NEWTON).state
    assert (equivalent_stress(after.stress) <= STEEL.yield_stress(after.peeq) * (1 + 1e-8)).all()
    x = points(onto, onto.mesh.nodes)
    for element, pressure in zip(x, after.pressure, strict=True):
        known = np.column_stack([np.ones(len(element)), element])
        assert np.abs(known @ np.linalg.lstsq(known, pressure)[0] - pressure).max() < 1e-5 * np.abs(pressure).max()
    first = next(march(onto, FINE, NEWTON, after))
    assert first.solved.certificate.equilibrium < 1e-7


def test_finer_meshes_lose_less(bar):
    """What the mean of peeq and the balance lose falls with the meshes of both."""
    lost = []
    for n in (4, 8, 16):
        scene = pressed(bar_of(2 * n, n))
        state = left_by(scene, Schedule(accuracy=1e-3))
        onto = pressed(drawn(scene, state.nodes, bar_of(2 * n - 1, n + 1)), top=0.9)
        found = transferred(state, scene, onto, NEWTON)
        lost.append((abs(found.peeq), found.moved))
    coarse, medium, fine = np.array(lost)
    assert (medium < 0.62 * coarse).all()
    assert (fine < 0.62 * medium).all()


def test_other_units_change_nothing(bar):
    scene, state = bar
    onto = pressed(drawn(scene, state.nodes, bar_of(9, 7)), top=0.9)
    there = transferred(state, scene, onto, NEWTON)
    scaled = VonMises(Elasticity(210e9, 0.3), Linear(300e6, 500e6))

    def smaller(one):
        (lid,) = one.tools
        other = replace(lid, point=tuple(1e-3 * np.array(lid.point)), travel=tuple(1e-3 * np.array(lid.travel)))
        return replace(one, mesh=replace(one.mesh, nodes=1e-3 * one.mesh.nodes), tools=(other,), material=scaled)

    in_metres = replace(
        state, nodes=1e-3 * state.nodes, stress=1e6 * state.stress, gap=1e-3 * state.gap, du=1e-3 * state.du
    )
    other = transferred(in_metres, smaller(scene), smaller(onto), NEWTON)
    np.testing.assert_allclose(other.state.stress / 1e6, there.state.stress, atol=1e-6)
    np.testing.assert_allclose([other.volume, other.peeq, other.moved], [there.volume, there.peeq, there.moved], 1e-6)


def test_supports_rest_and_loads_wait_while_the_stress_comes_into_balance(bar):
    scene, state = bar
    onto = pressed(drawn(scene, state.nodes, bar_of(12, 6)), top=0.9)
    far = int(onto.mesh.boundary_nodes("right")[3])
    moving = replace(
        onto,
        supports=(Symmetry("left", 0), Prescribed("base", 1, 0.01)),
        loads=(PointForce(far, (5.0, 0.0)),),
    )
    still = replace(onto, supports=(Symmetry("left", 0), Support("base", 1)))
    one, other = (transferred(state, scene, to, NEWTON).state for to in (moving, still))
    np.testing.assert_array_equal(one.stress, other.stress)
    np.testing.assert_array_equal(one.nodes, other.nodes)
    assert one.tau == 0


def test_a_block_in_space_by_other_elements():
    def cube(mesh, top, down):
        ways = (0.0, 0.0, top), (0.0, 0.0, -1.0), (0.0, 0.0, -down)
        lid = FlatTool(*ways, ("top",), 0.1, DOWN_AND_UP, sampling=Sampling.WEIGHTED)
        planes = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)
        return Scene(mesh, Geometry.SOLID, STEEL, planes, (lid,))

    scene = cube(brick(1.0, 1.0, 1.0, 3, 3, 3), 1.0, 0.1)
    state = left_by(scene, Schedule(accuracy=1e-3))
    grid = brick(1.0, 1.0, 1.0, 4, 5, 3, element=Element.H20)
    grid = drawn(scene, state.nodes, grid)
    high = float(grid.nodes[:, 2].max())
    onto = cube(grid, high + 0.01, 0.06)
    found = transferred(state, scene, onto, NEWTON)
    assert abs(found.volume) < 1e-3
    assert abs(found.peeq) < 0.01
    same = cube(scene.mesh, high + 0.01, 0.06)
    kept, anew = (
        list(march(to, Schedule(accuracy=1e-3), NEWTON, start))[-2].tool_force(0)[2]
        for to, start in ((same, handed_on(state, same)), (onto, found.state))
    )
    assert anew == pytest.approx(kept, rel=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s, a, b: (None, a, b), "state = None: must be a State"),
        (lambda s, a, b: (s, None, b), "scene = None: must be a Scene"),
        (lambda s, a, b: (s, a, None), "onto = None: must be a Scene"),
        (lambda s, a, b: (s, a, b, Newton()), "control = .*: must be a Control"),
        (lambda s, a, b: (replace(s, forces=s.forces + 1.0), a, b), "state.forces = 1.0: must be zero: lift"),
        (lambda s, a, b: (s, b, b), "state: must be of a march of the scene, .*: start.nodes = 'of shape"),
        (lambda s, a, b: (s, a, replace(b, material=Elastic(Elasticity(210e3, 0.3)))), "onto.material = Elastic"),
        (
            lambda s, a, b: (
                s,
                a,
                replace(b, geometry=Geometry.AXISYMMETRIC, supports=(Support("left", 0), *b.supports[1:])),
            ),
            "onto.geometry",
        ),
        (
            lambda s, a, b: (s, a, pressed(a.mesh)),
            "onto.mesh: its least and largest places = .*: must be the deformed body's",
        ),
        (
            lambda s, a, b: (s, a, pressed(stretched(b.mesh, 1.02), top=0.9)),
            "onto.mesh: its volume = 2.039.*: must be the deformed body's, 1.999",
        ),
        (lambda s, a, b: (s, a, pressed(b.mesh, top=0.8)), r"tools\[0\].*"),
    ],
)
def test_what_is_no_such_body_is_refused(bar, change, words):
    scene, state = bar
    onto = pressed(drawn(scene, state.nodes, bar_of(9, 6)), top=0.9)
    refused(lambda: transferred(*change(state, scene, onto)), words)


def stretched(mesh: Mesh, by: float) -> Mesh:
    return replace(mesh, nodes=mesh.nodes * (by, 1.0))


def test_another_shape_of_the_same_volume_and_extents_is_refused():
    """A slanted bar and its mirror image."""

    def slanted(by):
        mesh = bar_of(24, 12)
        return replace(mesh, nodes=mesh.nodes @ np.array([[1.0, 0.0], [by, 1.0]]))

    mirrored = slanted(-1.0)
    mirrored = replace(mirrored, nodes=np.add(mirrored.nodes, (1.0, 0.0)))
    supports = Support("base", 0), Support("base", 1)
    one, other = (Scene(mesh, Geometry.PLANE_STRAIN, STEEL, supports) for mesh in (slanted(1.0), mirrored))
    words = "onto.mesh: distance of a point from all of the deformed body's = .*: must be at most 0.1"
    refused(lambda: transferred(system_of(one).rest(), one, other), words)
    assert transferred(system_of(one).rest(), one, one, NEWTON).moved == 0
