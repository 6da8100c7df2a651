"""Planes of symmetry: half a model against the whole body meshed, and what is no half of anything is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.errors import SceneError
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton
from bipot.increment import Limits
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder, ring
from bipot.results.description import describe
from bipot.scene.loads import BodyForce, PointForce, Pressure, Traction
from bipot.scene.scene import Scene, upsetting
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.tool import FlatTool, Sampling
from studies.fuzz.unfolded import about

TIGHT = Control(Newton(), (), Limits(Bounds(equilibrium=1e-11, law=1e-11)))
WIDTH, HEIGHT = 3.0, 2.0
STEEL = VonMises(Elasticity(2e5, 0.3), Linear(300.0, 2000.0))
LEFT, BASE = Symmetry("left", 0), Symmetry("base", 1)


def ends(scene, schedule, control=TIGHT):
    """The last increment's forces of whole tools (k, d) and energies (4,) of the whole body."""
    *_, last = march(scene, schedule, control)
    forces = np.array([last.tool_force(k) for k in range(len(scene.tools))])
    return forces, np.array([getattr(last.energies, name) for name in ("work", "elastic", "plastic", "friction")])


def agree(found, expected, rtol=1e-8):
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=rtol * scale)


def test_a_quarter_of_the_cylinder_is_half_of_it_between_two_punches():
    quarter = upsetting(mu=0.2, reduction=0.04, elements=3)
    (punch,) = quarter.tools
    mesh = cylinder(5.0, 10.0, 3, 6, element=Element.Q8)
    other = FlatTool((0.0, -5.0), (0.0, 1.0), (0.0, 0.2), ("base", "side"), 0.2)
    whole = replace(
        quarter,
        mesh=Mesh(mesh.nodes - [0.0, 5.0], mesh.elements, mesh.boundaries),
        supports=(Support("axis", 0),),
        tools=(punch, other),
    )
    assert (quarter.images, whole.images) == (2, 1)
    schedule = Schedule(4, first=0.02)
    (forces, energies), (both, summed) = ends(quarter, schedule), ends(whole, schedule)
    agree(forces[0], both[0])
    agree(-forces[0], both[1])
    agree(energies, summed)
    assert energies[3] > 0.01 * energies[0]


def part(across, along):
    """A block 2 WIDTH x 2 HEIGHT about the origin, of which half is modelled ``across`` x = 0 and ``along`` y = 0."""
    n, m = (3, 2) if across else (6, 2), (2, 2) if along else (4, 2)
    mesh = block(WIDTH * n[0] / 3, HEIGHT * m[0] / 2, n[0], m[0], element=Element.Q8)
    shift = np.array([0.0 if across else WIDTH, 0.0 if along else HEIGHT])
    top = FlatTool((0.0, HEIGHT), (0.0, -1.0), (0.0, -0.06), ("top",), 0.15)
    below = FlatTool((0.0, -HEIGHT), (0.0, 1.0), (0.0, 0.06), ("base",), 0.15)
    return Scene(
        mesh=Mesh(mesh.nodes - shift, mesh.elements, mesh.boundaries),
        geometry=Geometry.PLANE_STRAIN,
        material=STEEL,
        supports=(LEFT,) * across + (BASE,) * along,
        tools=(top,) if along else (top, below),
    )


@pytest.mark.parametrize(("across", "along"), [(True, True), (True, False), (False, True)])
def test_each_plane_of_a_block_between_platens_leaves_the_forces_and_energies_of_the_whole(across, along):
    scene, schedule = part(across, along), Schedule(4, first=0.02)
    assert scene.images == 2 ** (across + along)
    (forces, energies), (expected, summed) = ends(scene, schedule), ends(part(False, False), schedule)
    agree(forces, expected[: len(forces)])
    agree(energies, summed)
    assert forces[0, 0] == 0 or not across


def test_force_and_energy_of_an_elastic_quarter_are_those_of_the_whole_by_hand():
    young, poisson, strain = 2e5, 0.3, 1e-3
    scene = replace(
        part(True, True),
        material=Elastic(Elasticity(young, poisson)),
        configuration=Configuration.SMALL,
        tools=(FlatTool((0.0, HEIGHT), (0.0, -1.0), (0.0, -strain * HEIGHT), ("top",), 0.0),),
    )
    stress = young / (1 - poisson**2) * strain
    forces, energies = ends(scene, Schedule(2))
    agree(forces[0], [0.0, -stress * 2 * WIDTH])
    agree(energies, [stress * strain / 2 * 4 * WIDTH * HEIGHT] * 2 + [0.0, 0.0])


def drawn(seed):
    """A body with a plane of symmetry, under an inclined punch or a straight one, or squeezed by a smooth wall."""
    rng = np.random.default_rng(seed)
    kind, mu = ("block", "cylinder", "ring", "wedge")[seed % 4], float(rng.uniform(0.05, 0.4))
    n, m = (int(k) for k in rng.integers(2, 4, 2))
    mesh = {
        "cylinder": lambda: cylinder(3.0, 2.0, n, m, element=Element.Q8),
        "ring": lambda: ring(2.0, 4.0, 2.0, n, m, element=Element.Q8),
    }.get(kind, lambda: block(3.0, 2.0, n, m, element=Element.Q8))()
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.boundary_nodes(*mesh.boundaries))
    nodes = mesh.nodes.copy()
    nodes[inner] += rng.uniform(-0.08, 0.08, (len(inner), 2))
    # It meets the corner far from the plane: what meets its own image in the plane shares the force in many ways.
    angle = -0.1 if kind == "wedge" else 0.0
    normal = (float(np.sin(angle)), -float(np.cos(angle)))
    punch = FlatTool((3.0, 2.0), normal, (0.0, -0.08), ("top",), mu)
    wall = FlatTool((4.0, 0.0), (-1.0, 0.0), (-0.02, 0.0), ("side",), mu)
    held = {"cylinder": (Support("axis", 0), BASE), "ring": (BASE,), "wedge": (LEFT, Support("base", 1))}
    return Scene(
        mesh=Mesh(nodes, mesh.elements, mesh.boundaries),
        geometry=Geometry.PLANE_STRAIN if "left" in mesh.boundaries else Geometry.AXISYMMETRIC,
        material=STEEL,
        supports=held.get(kind, (LEFT, BASE)),
        tools=(punch, wall) if kind == "ring" else (punch,),
        quadrature=list(Quadrature)[seed % 3],
        configuration=Configuration.MIDPOINT if seed % 5 else Configuration.PAPER,
    )


@pytest.mark.parametrize("seed", range(8))
def test_the_mirror_image_meshed_has_the_same_forces_and_energies(seed):
    """The images are made by the fuzz study, which asks nothing of the library's planes."""
    scene, schedule = drawn(seed), Schedule(4, first=0.02)
    forces, energies = ends(scene, schedule)
    for plane in (support for support in scene.supports if isinstance(support, Symmetry)):
        seen = about(scene, plane).scene
        assert 2 * seen.images == scene.images
        assert len(seen.mesh.elements) == 2 * len(scene.mesh.elements)
        both, summed = ends(seen, schedule)
        agree(both[: len(forces)], forces)
        agree(summed, energies)
        cut = [abs(tool.normal[plane.direction]) < 1e-9 for tool in scene.tools]
        assert len(both) == 2 * len(forces) - sum(cut)
        if not all(cut):
            agree(both[-1] * np.where(np.arange(2) == plane.direction, -1, 1), forces[0])


def test_a_wall_around_a_ring_has_no_resultant_and_its_nodal_forces_push_inwards():
    scene = drawn(2)
    *_, last = march(scene, Schedule(2), TIGHT)
    assert last.tool_forces[1, 0] < -1.0
    assert last.tool_force(1).tolist() == [0.0, 0.0]
    assert last.tool_force(0)[1] == last.tool_forces[0, 1]


def test_loads_are_those_on_the_modelled_part():
    """A point force on the plane is half of that on the whole body, a traction one on each side."""
    scene = replace(part(True, True), tools=(), supports=(LEFT, Support("base", 0), Support("base", 1)))
    corner = int(np.argmin(np.hypot(scene.mesh.nodes[:, 0], scene.mesh.nodes[:, 1] - HEIGHT)))
    loads = (PointForce(corner, (0.0, -20.0)), Traction("right", (5.0, -3.0)), BodyForce((0.0, -1.0)))
    half = replace(scene, loads=loads)
    whole = about(half, LEFT).scene
    assert whole.loads[0] == PointForce(corner, (0.0, -40.0))
    agree(ends(half, Schedule(2))[1], ends(whole, Schedule(2))[1])


@pytest.mark.parametrize("number", [-1, 1, True, 0.0, "punch"])
def test_the_force_of_no_tool_is_refused(number):
    accepted = next(march(upsetting(mu=0.1, elements=1, reduction=0.01), Schedule(1)))
    with pytest.raises(SceneError, match=f"tool = {number!r}: must be"):
        accepted.tool_force(number)


def test_one_plane_may_have_several_boundaries():
    mesh = block(WIDTH, HEIGHT, 2, 2, element=Element.Q8)
    left = mesh.boundary("left")
    parts = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "low": left[:1], "high": left[1:]})
    scene = replace(part(True, True), mesh=parts, supports=(Symmetry("low", 0), Symmetry("high", 0), BASE))
    assert scene.images == 4
    assert replace(scene, supports=(LEFT, LEFT, BASE)).images == 4


def off_plane():
    """A node of the left side a millionth beside it."""
    mesh = block(WIDTH, HEIGHT, 2, 2, element=Element.Q8)
    nodes = mesh.nodes.copy()
    nodes[mesh.boundary_nodes("left")[0], 0] += 1e-6
    return Mesh(nodes, mesh.elements, mesh.boundaries)


def block_with(**changes):
    return replace(part(True, True), **changes)


def straight(**changes):
    given = {"point": (0.0, HEIGHT), "normal": (0.0, -1.0), "travel": (0.0, -0.1), "candidates": ("top",), "mu": 0.1}
    return FlatTool(**(given | changes))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Symmetry("left", 3), "support.direction = 3: must be 0, 1 or, in space, 2"),
        (lambda: Symmetry(3, 0), "support.boundary = 3: must be a str"),
        (lambda: Symmetry("left", 0.0), "support.direction = 0.0"),
        (lambda: block_with(supports=(Symmetry("middle", 0),)), "boundary = 'middle': must be one of"),
        (lambda: block_with(supports=(Symmetry("left", 1),)), "'left': must be one whose nodes have one coordinate 1"),
        (
            lambda: block_with(mesh=off_plane()),
            "'left': must be one whose nodes have one coordinate 0: they spread from 0 to 1e-06",
        ),
        (
            lambda: block_with(mesh=both_sides(), supports=(Symmetry("middle", 0),)),
            "'middle': must be one with the body on one side of its plane x_0 = 3",
        ),
        (
            lambda: block_with(supports=(LEFT, Symmetry("right", 0), BASE)),
            "along 0 = 'right': must be in the plane of the other, x_0 = 0: two make a periodic array",
        ),
        (
            lambda: replace(upsetting(mu=0.1, elements=1), supports=(Symmetry("axis", 0), BASE)),
            "symmetry.direction = 0: must be 1 in an axisymmetric scene",
        ),
        (
            lambda: block_with(tools=(straight(travel=(0.01, -0.1)),)),
            r"tools\[0\].travel = .*: must be without a component along 0: a plane of symmetry cuts the tool",
        ),
        (
            lambda: block_with(
                tools=(straight(), straight(point=(WIDTH, 0.0), normal=(-1.0, 0.0), candidates=("right",)))
            ),
            r"tools\[1\].travel = .*: must be without a component along 1",
        ),
        (
            lambda: block_with(tools=(straight(candidates=("top", "left")),)),
            r"tools\[0\].candidates = .*: must be on the surface of the whole body: .* lies in a plane of symmetry",
        ),
        (lambda: block_with(loads=(Pressure("left", 1.0),)), r"scene.loads\[0\].boundary = .*'left'.*: must be on the"),
        (lambda: block_with(loads=(Traction("base", (0.0, 1.0)),)), r"scene.loads\[0\].boundary = .*'base'"),
        (
            lambda: block_with(loads=(Pressure("top", 1.0), BodyForce((0.0, -1.0)))),
            r"scene.loads\[1\].vector = \(0.0, -1.0\): must be without a component along 1",
        ),
        (lambda: block_with(loads=(PointForce(0, (1.0, 0.0)),)), r"scene.loads\[0\].vector = \(1.0, 0.0\)"),
        (
            lambda: block_with(supports=(LEFT, BASE, Prescribed("top", 0, 0.1))),
            "such that node .* has one displacement along 0",
        ),
    ],
)
def test_what_is_no_part_of_a_symmetric_body_is_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def both_sides():
    """A block with a named line of edges in its middle."""
    mesh = block(2 * WIDTH, HEIGHT, 2, 1, element=Element.Q8)
    middle = np.flatnonzero(mesh.nodes[:, 0] == WIDTH)
    ends, mid = middle[:2], middle[2:]
    return Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "middle": [[ends[0], mid[0], ends[1]]]})


def test_a_body_off_the_origin_and_round_off_on_the_plane_are_no_reason_to_refuse():
    scene = part(True, True)
    far = replace(scene, mesh=Mesh(scene.mesh.nodes + np.array([1e5, 0.0]), scene.mesh.elements, scene.mesh.boundaries))
    assert far.planes[0].position == 1e5
    noise = np.random.default_rng(0).uniform(-1e-12, 1e-12, scene.mesh.nodes.shape)
    assert replace(scene, mesh=Mesh(scene.mesh.nodes + noise, scene.mesh.elements, scene.mesh.boundaries)).images == 4


def test_a_file_says_which_supports_are_planes_of_symmetry():
    said = json.loads(json.dumps(describe(upsetting(mu=0.1, elements=1))))
    assert said["supports"] == [
        {"boundary": "axis", "direction": 0, "symmetry": False},
        {"boundary": "base", "direction": 1, "symmetry": True},
    ]


@pytest.mark.parametrize("name", ["load", "tool"])
def test_the_axis_of_a_ring_is_no_surface_for_loads_or_tools(name):
    mesh, held = cylinder(1.0, 1.0, 3, 3, element=Element.Q8), (Support("axis", 0), Support("base", 1))
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.05), ("top", "axis"), 0.2, sampling=Sampling.WEIGHTED)
    tools, loads = ((tool,), ()) if name == "tool" else ((), (Pressure("axis", 1.0),))
    with pytest.raises(SceneError, match=r"on the surface of the whole body: .* or on an axis, inside it"):
        Scene(mesh, Geometry.AXISYMMETRIC, STEEL, held, tools, loads=loads)


def test_round_off_of_places_far_from_the_origin_does_not_take_nodes_past_a_plane():
    c, s = np.cos(1.1), np.sin(1.1)
    Q, far, straight = np.array([[c, -s], [s, c]]), np.array([1e6, 1.2e6]), block(2.0, 1.0, 4, 2)
    mesh = Mesh(straight.nodes @ Q.T + far, straight.elements, straight.boundaries)
    tool = FlatTool(tuple(Q @ [0.0, 1.0] + far), (s, -c), (0.1 * s, -0.1 * c), ("top",), 0.2)
    planes = Symmetry("left", (c, s)), Symmetry("base", (-s, c))
    assert sum(a.cuts for a in march(Scene(mesh, Geometry.PLANE_STRAIN, STEEL, planes, (tool,)), Schedule(60))) == 0
