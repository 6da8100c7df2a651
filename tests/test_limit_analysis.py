"""Limit loads without a march: closed forms, the same program in another writing, marches that end there, refusals."""

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest

from bipot import (
    Amplitude,
    Elastic,
    Elasticity,
    FlatTool,
    Force,
    Geometry,
    Linear,
    Perfect,
    Pressure,
    Quadrature,
    Sampling,
    Scene,
    SceneError,
    Schedule,
    Support,
    Swift,
    Symmetry,
    Traction,
    Voce,
    VonMises,
    block,
    brick,
    limit_load,
    march,
    ring,
)
from bipot.errors import InfeasibleProgram, ProgramError
from bipot.fem.elements import tabulated
from bipot.fem.projection import VolumeChange
from bipot.iterate import Increment
from bipot.limit_analysis import collapse
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.programs.limit import LimitProgram
from bipot.system import system_of
from studies.element_scenes import Choice, notched
from studies.element_types import ElementType

STEEL = Elasticity(200_000.0, 0.3)
SOFT = Perfect(100.0)


def strip(hardening=SOFT, **changes):
    """A quarter of a block 8 x 2 in plane strain, pressed on its top."""
    given = {
        "mesh": block(4.0, 1.0, 4, 2, element=Element.Q8),
        "geometry": Geometry.PLANE_STRAIN,
        "material": VonMises(STEEL, hardening),
        "supports": (Symmetry("left", 0), Symmetry("base", 1)),
        "loads": (Traction("top", (0.0, -1.0)),),
    }
    return Scene(**(given | changes))


def pressed(mu, force=1.0):
    platen = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), mu, driven_by=Force((0.0, -force)))
    return strip(loads=(), tools=(platen,), quadrature=Quadrature.GAUSS2)


@pytest.mark.parametrize("quadrature", [Quadrature.RADON7, Quadrature.GAUSS2])
def test_a_strip_pressed_evenly_carries_two_over_root_three_of_its_yield_stress(quadrature):
    found = limit_load(strip(quadrature=quadrature))
    assert found.multiple == pytest.approx(200.0 / np.sqrt(3.0), rel=1e-7)
    assert np.abs(found.motion).max() == 1.0


def test_the_saturated_yield_stress_counts():
    assert limit_load(strip(Voce(100.0, 50.0, 8.0))).multiple == pytest.approx(300.0 / np.sqrt(3.0), rel=1e-7)


def test_a_tube_bursts_at_twice_its_shear_yield_stress_times_the_logarithm():
    tube = Scene(
        mesh=ring(100.0, 200.0, 10.0, 12, 1, grading=(2.0, 1.0), element=Element.Q8),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(STEEL, Perfect(240.0)),
        supports=(Support("base", 1), Support("top", 1)),
        loads=(Pressure("bore", 1.0),),
        quadrature=Quadrature.GAUSS2,
    )
    assert limit_load(tube).multiple == pytest.approx(240.0 * 2 / np.sqrt(3.0) * np.log(2.0), rel=1e-3)


@pytest.mark.parametrize("mu", [0.0, 0.2, np.inf])
def test_the_program_is_that_of_another_writing(mu):
    """The same by cvxpy, from the shapes of the elements: least dissipation over motions with a gain of one."""
    scene = replace(pressed(mu), volume=VolumeChange.AS_IS)
    x, rule = scene.mesh.nodes, tabulated(scene.mesh.element, scene.rule)
    v, cost, rigid = cp.Variable(x.shape), 0.0, []
    for cell in scene.mesh.elements:
        for weight, slope in zip(rule.weights, rule.gradients, strict=True):
            jacobian = x[cell].T @ slope
            gradient = v[cell].T @ (slope @ np.linalg.inv(jacobian))
            shear = (gradient[0, 1] + gradient[1, 0]) / np.sqrt(2.0)
            rigid.append(gradient[0, 0] + gradient[1, 1] == 0)
            size = cp.norm(cp.hstack([gradient[0, 0], gradient[1, 1], shear]))
            cost += weight * np.linalg.det(jacobian) * np.sqrt(2 / 3) * 100.0 * size
    top, left, base = (scene.mesh.boundary_nodes(name) for name in ("top", "left", "base"))
    # The platen comes down by one, and n points down: gaps grow as nodes go down faster.
    opening = -v[top, 1] - 1.0
    contact = [v[top, 0] == 0, opening == 0] if mu == np.inf else [opening >= mu * cp.abs(v[top, 0])]
    least = cp.Problem(cp.Minimize(cost), [*rigid, v[left, 0] == 0, v[base, 1] == 0, *contact])
    least.solve(solver=cp.CLARABEL)
    # The force is that on the whole platen, of which the plane on the left cuts half away.
    assert limit_load(scene).multiple == pytest.approx(2.0 * least.value, rel=1e-6)


def refused_before_the_basis(program):
    """As :meth:`LimitProgram.motion`, which does not take rows of volumes."""
    if program.model.volumetric.shape[0]:
        raise ProgramError("not today")
    return SPARSE(program)


SPARSE = LimitProgram.motion
AS_IS = {
    "strip of T3": lambda: strip(mesh=block(4.0, 1.0, 4, 2, element=Element.T3)),
    "strip of Q8": lambda: strip(volume=VolumeChange.AS_IS),
    "pressed Q8": lambda: replace(pressed(0.2), quadrature=Quadrature.RADON7, volume=VolumeChange.AS_IS),
    # Rows of these repeat each other nearly: the sparse answer alone would be 0.2 % too low.
    "notch of Q9": lambda: notched(Choice(ElementType.Q9, Quadrature.GAUSS3), 6),
}


@pytest.mark.parametrize("make", AS_IS.values(), ids=AS_IS)
def test_a_basis_of_motions_that_keep_the_volume_has_the_same_limit_load(make, monkeypatch):
    found = limit_load(make()).multiple
    monkeypatch.setattr(LimitProgram, "motion", refused_before_the_basis)
    assert limit_load(make()).multiple == pytest.approx(found, rel=1e-7)


@pytest.mark.parametrize("volume", [VolumeChange.AS_IS, VolumeChange.P0])
def test_an_answer_that_changes_the_volume_a_little_is_corrected(volume, monkeypatch):
    """Interior points may end a little outside the bound: the nearest motion that keeps the volume is as good."""

    def disturbed(program):
        v = SPARSE(program)
        return v + 1e-8 * np.abs(v).max() * np.random.default_rng(1).standard_normal(v.shape)

    scene = strip(mesh=block(4.0, 1.0, 8, 4, element=Element.Q8), quadrature=Quadrature.GAUSS2, volume=volume)
    found = limit_load(scene).multiple
    monkeypatch.setattr(LimitProgram, "motion", disturbed)
    assert limit_load(scene).multiple == pytest.approx(found, rel=1e-6)
    monkeypatch.setattr(LimitProgram, "nearest", lambda program, v: v)
    monkeypatch.setattr("bipot.programs.limit.isochoric", lambda volumes: [])
    with pytest.raises(ProgramError, match="changes volume"):
        limit_load(scene)


def test_where_volumes_are_projected_a_basis_is_asked_for_too(monkeypatch):
    found = limit_load(strip()).multiple
    monkeypatch.setattr(LimitProgram, "motion", refused_before_the_basis)
    assert limit_load(strip()).multiple == pytest.approx(found, rel=1e-7)


def test_the_size_of_the_load_does_not_matter():
    whole = limit_load(pressed(0.2)).multiple
    assert limit_load(pressed(0.2, 1e9)).multiple == pytest.approx(whole / 1e9, rel=1e-7)
    assert limit_load(pressed(0.2, 1e-9)).multiple == pytest.approx(whole * 1e9, rel=1e-7)


@pytest.mark.parametrize(("size", "stress"), [(1e3, 1e-6), (1e9, 1e-12), (1e-9, 1.0), (1e-12, 1e9)])
def test_units_do_not_matter(size, stress):
    """In plane strain volumes are areas of a unit of thickness."""

    def platen(size, stress):
        tool = FlatTool((0.0, size), (0.0, -1.0), (0.0, 0.0), ("top",), 0.3, driven_by=Force((0.0, -size * stress)))
        mesh, material = block(4.0 * size, size, 4, 2), VonMises(Elasticity(1e3 * stress, 0.3), Perfect(3.0 * stress))
        return strip(mesh=mesh, material=material, loads=(), tools=(tool,))

    assert limit_load(platen(size, stress)).multiple == pytest.approx(limit_load(platen(1.0, 1.0)).multiple, rel=1e-7)


@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("length", [20.0, 2e4])
def test_a_slender_strip_pressed_evenly_carries_two_over_root_three_of_its_yield_stress(length, angle):
    c, s = np.cos(angle), np.sin(angle)
    straight = block(length, 1.0, 40, 2)
    mesh = Mesh(straight.nodes @ np.array([[c, s], [-s, c]]), straight.elements, straight.boundaries)
    supports = (Support("left", (c, s)), Support("base", (-s, c)))
    pressed = strip(mesh=mesh, supports=supports, loads=(Traction("top", (s, -c)),))
    assert limit_load(pressed).multiple == pytest.approx(200.0 / np.sqrt(3.0), rel=1e-5)


def test_a_quarter_of_the_load_is_carried_four_times():
    ramp = replace(strip().loads[0], amplitude=Amplitude(((0.0, 0.0), (0.5, 0.25), (1.0, 1.0))))
    scene = strip(loads=(ramp,))
    assert limit_load(scene, 0.5).multiple == pytest.approx(4 * limit_load(scene).multiple, rel=1e-7)


def test_a_march_reaches_what_is_just_below():
    multiple = limit_load(pressed(np.inf)).multiple
    *_, last = march(pressed(np.inf, 0.99 * multiple), Schedule(4))
    assert -last.tool_force(0)[1] == pytest.approx(0.99 * multiple, rel=1e-7)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: limit_load("scene"), "scene"),
        (lambda: limit_load(strip(), 2.0), r"tau = 2.0: must be in \[0, 1\]"),
        (lambda: limit_load(strip(), "end"), "tau"),
        (lambda: limit_load(strip(), 0.0), r"largest nodal load at tau = .*: must be above round-off"),
        (lambda: limit_load(strip(loads=())), r"largest nodal load at tau = .*: must be above round-off"),
        (
            lambda: limit_load(strip(loads=(Traction("top", (0.0, 1.0)), Pressure("top", 1.0)))),
            "loads must not cancel",
        ),
        (lambda: limit_load(strip(material=Elastic(STEEL))), "scene.material"),
        (lambda: limit_load(strip(Linear(100.0, 50.0))), "scene.material"),
        (lambda: limit_load(strip(Swift(500.0, 0.01, 0.2))), "scene.material"),
    ],
)
def test_what_has_no_limit_load_is_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def locked():
    """A tube of elements that hold their volume at every point: bilinear ones have no such motion around an axis."""
    return Scene(
        mesh=ring(100.0, 200.0, 10.0, 6, 1),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(STEEL, Perfect(240.0)),
        supports=(Support("base", 1), Support("top", 1)),
        loads=(Pressure("bore", 1.0),),
        volume=VolumeChange.AS_IS,
    )


def test_a_mesh_that_locks_is_said_to_carry_whatever_it_is_given(monkeypatch):
    with pytest.raises(InfeasibleProgram, match="elements that lock, supports or tools carry any multiple"):
        limit_load(locked())
    # where interior points end without an answer there is no motion to choose among
    monkeypatch.setattr(LimitProgram, "motion", refused_before_the_basis)
    with pytest.raises(InfeasibleProgram, match="elements that lock"):
        limit_load(locked())


@pytest.mark.parametrize("far", [(0.0, 0.0), (3e5, 2e5)])
def test_loads_that_cancel_are_refused_far_from_the_origin_too(far):
    c, s = np.cos(0.5), np.sin(0.5)
    straight = block(4.0, 1.0, 7, 3)
    mesh = Mesh(straight.nodes @ np.array([[c, s], [-s, c]]) + far, straight.elements, straight.boundaries)
    held = Support("left", (c, s)), Support("base", (-s, c))
    perfect = VonMises(Elasticity(2e5, 0.3), Perfect(100.0))
    scene = Scene(mesh, Geometry.PLANE_STRAIN, perfect, held, loads=(Pressure("top", 1.0), Traction("top", (-s, c))))
    with pytest.raises(SceneError, match="loads must not cancel"):
        limit_load(scene)


def test_one_element_whose_volume_rows_defeat_interior_points_has_its_limit_load():
    """Evenly pressed, frictionless: a third of the load is the yield stress."""
    tool = FlatTool(
        (0.0, 0.0, 1.0),
        (0.0, 0.0, -1.0),
        (0.0, 0.0, 0.0),
        ("top",),
        0.0,
        driven_by=Force((0.0, 0.0, -3600.0)),
        sampling=Sampling.WEIGHTED,
    )
    planes = Symmetry("left", 0), Symmetry("front", 1), Support("base", 2)
    cube = brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.H20)
    scene = Scene(cube, Geometry.SOLID, VonMises(Elasticity(210e3, 0.3), Perfect(300.0)), planes, (tool,))
    assert limit_load(scene).multiple == pytest.approx(1 / 3, rel=1e-6)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3])
def test_a_collapse_is_proved_just_above_the_limit_load_with_friction_and_not_below(mu):
    """Of a strip under a platen, whose limit grows from 924 to 1537 with mu."""
    limit = limit_load(pressed(mu)).multiple
    proved = []
    for part in (0.98, 1.02):
        system = system_of(pressed(mu, part * limit))
        proved.append(collapse(Increment(system, system.rest(), 1.0)) is not None)
    assert proved == [False, True]
