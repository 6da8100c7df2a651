"""Deformable tools in space: patch tests, beside rigid tools, turned, halved, dragged."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bipot import (
    Amplitude,
    Control,
    DeformableTool,
    Dissipation,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    Support,
    Symmetry,
    Tangent,
    brick,
    march,
    together,
)
from bipot.tools.flats import outward
from bipot.tools.passing import crossed, deep
from bipot.tools.polygons import polygons
from tests.deformable import ELASTIC, STEEL, shifted

NEWTON = Control(Newton(), ())
TURNS = {"straight": np.eye(3), "turned": Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix()}
SIDES = "right", "back"


ONE, FEW = Schedule(1), Schedule(2, first=0.02, settling=1, growth=4.0)


def last(scene, control=NEWTON, schedule=ONE):
    *_, accepted = march(scene, schedule, control)
    return accepted


def stack(R, mu=0.0, element=Element.H8, off=0.0, kind=Support):
    """Two cubes of 2 x 2 and 3 x 3 elements on each other, of which inner nodes of the lower one are moved ``off``."""
    low, up = (brick(1.0, 1.0, 1.0, n, n, 1, element=element) for n in (2, 3))
    nodes = low.nodes.copy()
    nodes[(np.abs(low.nodes[:, :2] - 0.5) < 0.1).all(axis=1), :2] += off
    mesh = together({"low": replace(low, nodes=nodes), "up": shifted(up, 0.0, 0.0, 1.0)})
    x, y, z = (tuple(R[:, k]) for k in range(3))
    supports = (
        Support("low/base", z),
        *(kind(f"{part}/{side}", way) for part in ("low", "up") for side, way in (("left", x), ("front", y))),
        Prescribed("up/top", z, -0.01),
    )
    tool = DeformableTool(("low/top",), ("up/base",), mu)
    return Scene(replace(mesh, nodes=mesh.nodes @ R.T), Geometry.SOLID, ELASTIC, supports, (tool,))


def pressed(mu=0.2, press=0.4, punch=ELASTIC, wide=7.0, n=2, quarter=True, element=Element.H8):
    """An eighth, or the upper half, of a block beneath a wider punch onto which its sides may fold."""
    sizes, count = ((5.0, wide), n) if quarter else ((10.0, 2 * wide), 2 * n)
    extra = 1 if quarter else 2
    billet, above = (
        brick(sizes[0], sizes[0], 5.0, count, count, n, element=element),
        shifted(brick(sizes[1], sizes[1], 3.0, count + extra, count + extra, 1, element=element), 0.0, 0.0, 5.0),
    )
    if not quarter:
        billet, above = (
            shifted(mesh, -size / 2, -size / 2, 0.0) for mesh, size in ((billet, sizes[0]), (above, sizes[1]))
        )
    planes = [Symmetry("billet/base", 2)]
    if quarter:
        planes += [Symmetry(f"{part}/{b}", k) for part in ("billet", "punch") for b, k in (("left", 0), ("front", 1))]
    held = Prescribed("punch/top", 2, -press), Support("punch/top", 0), Support("punch/top", 1)
    sides = ("top", *SIDES) if quarter else ("top", *SIDES, "left", "front")
    tool = DeformableTool(("punch/base",), tuple(f"billet/{side}" for side in sides), mu)
    mesh = together({"billet": billet, "punch": above})
    return Scene(mesh, Geometry.SOLID, STEEL, (*planes, *held), (tool,), regions={"punch": punch})


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("element", [Element.H8, Element.T4])
@pytest.mark.parametrize("form", [Newton(), Dissipation()])
def test_a_uniform_pressure_passes_meshes_that_do_not_match(element, turn, form):
    """Also one of which squares are no parallelograms."""
    off = 0.07 if element is Element.H8 else 0.0
    accepted = last(stack(TURNS[turn], mu=0.3, element=element, off=off), Control(form, ()))
    stress = accepted.state.stress
    assert np.ptp(stress, axis=(0, 1)).max() < 1e-5 * np.abs(stress).max()
    along = accepted.tool_force(0) @ TURNS[turn][:, 2]
    assert along == pytest.approx(210e3 * 0.01 / 2, rel=0.01)
    np.testing.assert_allclose(accepted.tool_force(0), along * TURNS[turn][:, 2], atol=2e-4 * along)


def bent(nodes, side, rng):
    """Nodes of which those inside the unit square on a ``side`` are moved in its plane."""
    out, inner = nodes.copy(), side[(np.abs(nodes[side, :2] - 0.5) < 0.4).all(axis=1)]
    out[inner, :2] += rng.uniform(-0.05, 0.05, (len(inner), 2))
    return out


def test_polygons_cover_the_smaller_face_and_lead_to_places_before_each_other():
    rng = np.random.default_rng(1)
    one, other = (
        bent(mesh.nodes, mesh.boundary_nodes(side), rng)[mesh.around(side)]
        for mesh, side in (
            (brick(1.0, 1.0, 1.0, 3, 3, 1), "top"),
            (shifted(brick(1.3, 1.2, 1.0, 2, 4, 1), -0.1, -0.1, 1.2), "base"),
        )
    )
    for mine, its, sign in ((one, other, 1.0), (other, one, -1.0)):
        found = polygons(mine, its)
        x, y = found.mine @ mine[found.one], found.its @ its[found.other]
        np.testing.assert_allclose(y - x, np.broadcast_to([0.0, 0.0, 0.2 * sign], x.shape), atol=1e-14)
        assert found.weight.sum() == pytest.approx(1.0, rel=1e-13)
        np.testing.assert_allclose(found.lowest, 0.2)
        # Of degree two in both directions.
        assert (found.weight * x[..., 0] ** 2 * x[..., 1] ** 2).sum() == pytest.approx(1 / 9, rel=1e-12)
    # Nothing faces what looks the same way.
    assert not polygons(one, one).one.size


def test_of_two_faces_before_one_place_the_nearer_counts():
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    near, far = (square[::-1] * size + [0.0, 0.0, height] for size, height in ((1.0, 0.1), (3.0, 0.5)))
    found = polygons(square[None], np.stack([far, near]))
    assert set(found.other.tolist()) == {1}
    assert found.weight.sum() == pytest.approx(1.0)
    np.testing.assert_array_equal(outward(square[None]), [[0.0, 0.0, 1.0]])


def test_nodes_that_go_through_faces_and_faces_deep_in_each_other_are_found():
    nodes = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 1, 0], [0.0, 1, 0], [0.4, 0.6, 0.3], [2.0, 2.0, 0.3]])
    faces, points = np.array([[0, 1, 2, 3]]), np.array([4, 5])
    for down, found in ((0.4, None), (0.7, (4, [0, 1, 2, 3])), (9.0, (4, [0, 1, 2, 3]))):
        moved = nodes.copy()
        moved[4:, 2] -= down
        assert crossed(nodes, moved, points, faces, np.array([np.inf])) == found
    above = np.vstack([nodes[:4], nodes[[3, 2, 1, 0]] - [0.0, 0.0, 0.1]])
    assert deep(above, np.array([[0, 1, 2, 3]]), np.array([[4, 5, 6, 7]]), False) == 0.0
    above[4:, 2] -= 0.3
    assert deep(above, np.array([[0, 1, 2, 3]]), np.array([[4, 5, 6, 7]]), False) == pytest.approx(0.4)


def test_forms_agree_and_work_is_kept():
    scene = pressed(press=0.2)
    first = last(scene, schedule=FEW)
    other = last(scene, Control(Tangent(), ()), FEW)
    np.testing.assert_allclose(other.tool_force(0), first.tool_force(0), rtol=1e-5)
    assert abs(first.energies.energy_error) < 1e-3
    assert first.energies.friction > 0.01 * first.energies.work
    r = first.state.forces
    assert r[:, 0].min() >= 0
    assert (np.hypot(*r[:, 1:].T) <= 0.2 * r[:, 0] * (1 + 1e-8)).all()


@pytest.mark.slow
def test_a_part_stands_for_the_whole():
    part, whole = (last(pressed(press=0.2, quarter=quarter), schedule=FEW) for quarter in (True, False))
    np.testing.assert_allclose(whole.tool_force(0), (0.0, 0.0, part.tool_force(0)[2]), rtol=1e-7, atol=1e-3)
    assert part.energies.work == pytest.approx(whole.energies.work, rel=1e-6)
    assert part.energies.friction == pytest.approx(whole.energies.friction, rel=1e-5)


@pytest.mark.slow
def test_conic_forms_agree_with_newton():
    scene = pressed(press=0.2)
    first, other = (last(scene, Control(form, ()), FEW) for form in (Newton(), Dissipation()))
    np.testing.assert_allclose(other.tool_force(0), first.tool_force(0), rtol=1e-5)


def test_a_stiff_punch_is_a_rigid_one():
    scene = pressed(press=0.2, punch=Elastic(Elasticity(1e9, 0.0)))
    billet = brick(5.0, 5.0, 5.0, 2, 2, 2)
    supports = tuple(Symmetry(name, k) for k, name in enumerate(("left", "front", "base")))
    rigid = FlatTool((0.0, 0.0, 5.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.2), ("top", *SIDES), 0.2)
    alone = Scene(billet, Geometry.SOLID, STEEL, supports, (rigid,))
    one, other = (last(of, schedule=FEW).tool_force(0)[2] for of in (scene, alone))
    # At a rigid tool the law is posed at nodes, at this one in means of them.
    assert one == pytest.approx(other, rel=5e-3)


def test_friction_turns_with_the_slip():
    """A cube is pressed on a plate and dragged along x, then along y: friction is mu times the force, against it."""
    mesh = together({"low": brick(3.0, 3.0, 0.5, 4, 4, 1), "up": shifted(brick(1.0, 1.0, 0.5, 2, 2, 1), 0.5, 0.5, 0.5)})
    path = Amplitude(((0.0, 0.0), (0.2, 0.0), (0.6, 1.0), (1.0, 1.0))), Amplitude(((0.0, 0.0), (0.6, 0.0), (1.0, 1.0)))
    supports = (
        *(Support("low/base", k) for k in range(3)),
        *(Prescribed("up/top", k, 0.6, path[k]) for k in range(2)),
        Prescribed("up/top", 2, -0.002, Amplitude(((0.0, 0.0), (0.2, 1.0), (1.0, 1.0)))),
    )
    tool = DeformableTool(("low/top",), ("up/base",), 0.25)
    scene = Scene(mesh, Geometry.SOLID, ELASTIC, supports, (tool,))
    forces = {round(a.state.tau, 6): a.tool_force(0) for a in march(scene, Schedule(10), NEWTON)}
    for tau, along in ((0.6, (-1.0, 0.0)), (1.0, (0.0, -1.0))):
        force = forces[tau]
        assert force[2] > 100.0
        np.testing.assert_allclose(force[:2] / (0.25 * force[2]), along, atol=0.02)
