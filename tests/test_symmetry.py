"""Planes of symmetry: half a model against the whole body meshed, and forces of the whole of tools that planes cut."""

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
from bipot.paper import upsetting
from bipot.results.description import describe
from bipot.scene.loads import BodyForce, PointForce, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.tool import FlatTool
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
    schedule = Schedule(4, first=0.02, settling=1, growth=4.0)
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
    scene, schedule = part(across, along), Schedule(4, first=0.02, settling=1, growth=4.0)
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
    scene, schedule = drawn(seed), Schedule(4, first=0.02, settling=1, growth=4.0)
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


def test_a_file_says_which_supports_are_planes_of_symmetry():
    said = json.loads(json.dumps(describe(upsetting(mu=0.1, elements=1))))
    assert said["supports"] == [
        {"boundary": "axis", "direction": 0, "symmetry": False},
        {"boundary": "base", "direction": 1, "symmetry": True},
    ]
