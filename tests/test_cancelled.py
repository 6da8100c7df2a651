"""Friction that contact in means leaves out where slips in a mean have several directions, told by a column."""

import numpy as np
import pytest

from bipot.checks.cancelled import cancelled
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Accepted, Control, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.results.columns import CANCELLED
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, Sampling, ShapedTool

MU, HEIGHT, TURNED = 0.1, 0.5, 0.2
WEIGHTED = Sampling.WEIGHTED
HELD = tuple(Support("base", d) for d in range(3))
STEEL = VonMises(Elasticity(2e5, 0.3), Linear(300.0, 2000.0))


def last_of(scene: Scene, increments: int = 2, **landings) -> Accepted:
    *_, last = march(scene, Schedule(increments, **landings), Control(Newton(), ()))
    return last


def value(scene: Scene, last: Accepted) -> float:
    return float(CANCELLED.value(system_of(scene), last))


def lid(count: int, element: Element, sampling: Sampling = Sampling.WEIGHTED, angle: float = TURNED) -> Scene:
    """A slab with the sides 2, under a lid that presses it and then turns about its middle, or goes along it."""
    mesh = brick(2.0, 2.0, HEIGHT, count, count, 1, element=element)
    mesh = Mesh(mesh.nodes - [1.0, 1.0, 0.0], mesh.elements, mesh.boundaries)
    at, later = (0.0, 0.0, HEIGHT), Amplitude(((0.0, 0.0), (0.1, 0.0), (1.0, 1.0)))
    tool = ShapedTool(
        Plane(at, (0.0, 0.0, -1.0)),
        (0.0, 0.0 if angle else 0.1, -1e-4),
        ("top",),
        MU,
        ((0.0, 0.0), (0.1, (0.0, 0.0, 1.0)), (1.0, (1.0, 1.0, 1.0))),
        turn=Turn(angle, at, later, axis=(0.0, 0.0, 1.0)),
        sampling=sampling,
    )
    return Scene(mesh, Geometry.SOLID, Elastic(Elasticity(1e6, 0.0)), HELD, (tool,))


@pytest.mark.parametrize("element", [Element.H20, Element.T10])
@pytest.mark.parametrize(("count", "least"), [(2, 0.2), (4, 0.05)])
def test_under_a_lid_that_turns_it_is_the_part_of_the_moment_that_is_left_out(element, count, least):
    """All slides: mu p int r dA = 4/3 (sqrt 2 + asinh 1) mu p on a face of [-1, 1]^2 under the pressure p."""
    scene = lid(count, element)
    last = last_of(scene, landings=(0.1,))
    pressure = -last.tool_force(0)[2] / 4
    short = 1 - abs(last.tool_moment(0)) / (4 / 3 * (np.sqrt(2) + np.arcsinh(1)) * MU * pressure)
    assert value(scene, last) == pytest.approx(short, abs=1e-3)
    assert short > least


@pytest.mark.parametrize(("sampling", "angle"), [(Sampling.WEIGHTED, 0.0), (Sampling.NODES, TURNED)])
def test_there_is_none_at_nodes_and_where_the_lid_goes_along(sampling, angle):
    scene = lid(2, Element.T10, sampling, angle)
    assert value(scene, last_of(scene, landings=(0.1,))) < (1e-3 if angle == 0.0 else 1e-15)


def squeezed(parts: int, quarter: bool) -> Scene:
    """A block that spreads beneath a platen from its middle, where slips have all directions, or its quarter."""
    platen = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.03), ("top",), MU, sampling=Sampling.WEIGHTED)
    base, cut = (Support("base", 2),), (Symmetry("left", 0), Symmetry("front", 1))
    if quarter:
        mesh = brick(1.0, 1.0, 1.0, parts, parts, 1, element=Element.H20)
        return Scene(mesh, Geometry.SOLID, STEEL, (*base, *cut), (platen,))
    mesh = brick(2.0, 2.0, 1.0, 2 * parts, 2 * parts, 1, element=Element.H20)
    whole = Mesh(mesh.nodes - [1.0, 1.0, 0.0], mesh.elements, mesh.boundaries)
    return Scene(whole, Geometry.SOLID, STEEL, base, (platen,))


def test_a_quarter_leaves_out_what_the_whole_body_does():
    found = [value(scene, last_of(scene)) for scene in (squeezed(1, True), squeezed(1, False))]
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[0] > 1e-4


def test_in_a_plane_slips_of_both_signs_cancel_in_the_mean_between_them():
    """A strip slips outwards from its middle, where the mean of one side is that of the other, less its sign.

    Slips are v at the ends, and along an edge of length h as they are at the nodes of its parabola.
    """
    platen = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.01), ("top",), MU, sampling=Sampling.WEIGHTED)
    mesh = block(4.0, 1.0, 2, 1, element=Element.Q8)
    strip = Mesh(mesh.nodes - [2.0, 0.0], mesh.elements, mesh.boundaries)
    scene = Scene(strip, Geometry.PLANE_STRAIN, STEEL, (Support("base", 1),), (platen,))
    last = last_of(scene)
    x, u = strip.nodes, last.state.du[:, 0]
    on = [np.flatnonzero((x[:, 1] == 1.0) & (x[:, 0] == at)) for at in (0.0, 1.0, 2.0)]
    s, w = np.polynomial.legendre.leggauss(3)
    s, w = (s + 1) / 2, w / 2
    slip = (u[on] * [(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)]).sum(axis=0)
    middle = np.flatnonzero(np.isin(system_of(scene).candidates.node, on[0]))
    lost = MU * last.solved.r[middle, 0] @ [float(w @ ((1 - s) * np.abs(slip)) / 0.5)]
    assert value(scene, last) == pytest.approx(lost / (last.solved.iterate.work(last.solved.r) + lost), rel=1e-6)


@pytest.mark.parametrize("surface", [Plane((0.0, 1.0), (0.0, -1.0)), Circle((0.0, 5.0), 4.0)])
def test_half_a_strip_leaves_out_what_the_whole_one_does(surface):
    """In the plane of symmetry the mean does not slip, though its modelled half does."""
    platen = ShapedTool(surface, (0.0, -0.05), ("top",), MU, sampling=Sampling.WEIGHTED)
    mesh, support = block(4.0, 1.0, 4, 1, element=Element.Q8), Support("base", 1)
    whole = Mesh(mesh.nodes - [2.0, 0.0], mesh.elements, mesh.boundaries)
    half = block(2.0, 1.0, 2, 1, element=Element.Q8)
    scenes = (
        Scene(half, Geometry.PLANE_STRAIN, STEEL, (support, Symmetry("left", 0)), (platen,)),
        Scene(whole, Geometry.PLANE_STRAIN, STEEL, (support,), (platen,)),
    )
    found = [value(scene, last_of(scene, 1)) for scene in scenes]
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[0] > 1e-3


def test_the_mean_about_the_axis_of_a_disc_does_not_slip():
    """Slips are -v s (1 - s) 4 - w s (2 s - 1) along the radius s of one edge, and none is left of their mean."""
    platen = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.01), ("top",), MU, sampling=Sampling.WEIGHTED)
    mesh = block(1.0, 1.0, 1, 1, element=Element.Q8)
    scene = Scene(mesh, Geometry.AXISYMMETRIC, STEEL, (Support("base", 1), Support("left", 0)), (platen,))
    last = last_of(scene, 1)
    x, u, candidates = mesh.nodes, last.state.du[:, 0], system_of(scene).candidates
    middle, rim = (np.flatnonzero((x[:, 1] == 1.0) & (x[:, 0] == at))[0] for at in (0.5, 1.0))
    s, w = np.polynomial.legendre.leggauss(6)
    s, w = (s + 1) / 2, w / 2
    slip = 4 * s * (1 - s) * u[middle] + s * (2 * s - 1) * u[rim]
    hat = 1 - s
    centre = np.flatnonzero(x[candidates.node, 0] == 0.0)
    lost = MU * last.solved.r[centre[0], 0] * (w @ (s * hat * np.abs(slip))) / (w @ (s * hat))
    assert value(scene, last) == pytest.approx(lost / (last.solved.iterate.work(last.solved.r) + lost), rel=1e-2)


def test_a_force_that_round_off_leaves_below_zero_has_no_friction_to_lose():
    """Where tools rest or lift off there may be no work beside it."""
    rests = FlatTool(
        (0.0, 1.0), (0.0, -1.0), (0.0, -1e-3), ("top",), MU, ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)), sampling=WEIGHTED
    )
    supports = Support("base", 0), Support("base", 1)
    scene = Scene(block(2.0, 1.0, 2, 1, element=Element.Q8), Geometry.PLANE_STRAIN, STEEL, supports, (rests,))
    last = last_of(scene)
    pulls = np.zeros_like(last.solved.r)
    pulls[0, 0] = -1e-18
    assert cancelled(last.solved.iterate, pulls) == 0.0


def test_a_weld_has_no_friction_to_lose_and_hides_none_that_another_tool_loses():
    """Its limit is infinite: what little slips within its means, or nothing, would count infinitely often."""
    platen = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.01), ("top",), MU, sampling=WEIGHTED)
    welded = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), np.inf, sampling=WEIGHTED)
    mesh = block(4.0, 1.0, 2, 1, element=Element.Q8)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, (), (platen, welded))
    found = last_of(scene, 1)
    slides = found.solved.r * (system_of(scene).candidates.tool == 0)[:, None]
    assert value(scene, found) == pytest.approx(cancelled(found.solved.iterate, slides), rel=0.01)
    assert value(scene, found) > 1e-3
