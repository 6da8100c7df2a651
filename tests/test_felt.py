"""A tool that the body does not feel turns no path, whatever its own one does."""

from dataclasses import replace

import numpy as np

from bipot import Circle, FlatTool, Geometry, Scene, Schedule, ShapedTool, Symmetry, Turn, block, march, upsetting
from bipot.meshes.mesh import Mesh
from tests.test_pace import HALF, METAL, forces


def retreating(path):
    """Upset beside a tool that presses nothing, a body's size away from the side at rest."""
    scene = upsetting(mu=0.3, reduction=0.2, elements=4)
    return replace(scene, tools=(*scene.tools, FlatTool((10.0, 0.0), (-1.0, 0.0), (-1.0, 0.0), ("side",), 0.1, path)))


def test_what_touches_nothing_turns_no_path_whatever_it_does():
    """A kink of its path began the prediction and the flow of all others anew."""
    schedule = Schedule(10, first=0.005, landings=(HALF,), settling=1, growth=4.0)
    paths = ((0.0, 0.0), (1.0, 1.0)), ((0.0, 0.0), (HALF, 1.0), (1.0, 0.0))
    even, other = (list(march(retreating(path), schedule)) for path in paths)
    assert [a.passes for a in other] == [a.passes for a in even]
    np.testing.assert_allclose(forces(other), forces(even), rtol=1e-12)


def test_a_roll_keeps_what_it_has_bitten_where_a_pusher_far_behind_it_stops():
    """The next increment began at rest, and found the strip spat out: without force, and lost."""
    radius, thin, thick, bite = 50.0, 4.0, 5.0, 9.95
    plain = block(30.0, thick, 12, 2)
    mesh = Mesh(plain.nodes - (bite + 30.0, 0.0), plain.elements, plain.boundaries)
    centre = (0.0, thin + radius)
    rolled = ShapedTool(Circle(centre, radius), (0.0, 0.0), ("top",), 0.25, turn=Turn(0.15, centre))
    path = ((0.0, 0.0), (HALF, 1.0), (1.0, 1.0))
    pusher = FlatTool((-bite - 30.0, 0.0), (1.0, 0.0), (3.0, 0.0), ("left",), 0.0, path)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, METAL, (Symmetry("base", 1),), (rolled, pusher))
    steps = list(march(scene, Schedule(12, first=0.01, settling=1, growth=4.0)))
    (stopped,) = (k for k, a in enumerate(steps) if a.state.tau == HALF)
    before, after = (-forces(steps)[k, 0, 1] for k in (stopped, stopped + 1))
    assert steps[stopped].state.gap[-3:].min() > 0.1
    assert after > 0.99 * before
