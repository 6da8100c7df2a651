"""Increments by accuracy of bodies that loads strain: they follow yielding, in any units, halves and numbering."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.paths import Amplitude
from bipot.scene.loads import Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool
from studies.accuracy.paced import CONTROL
from tests.inclined import turned

ACCURACY = 1e-3
THERE_AND_BACK = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, -1.0)))
CLAMPED = (Support("base", 0), Support("base", 1))


def steel(mpa: float = 1.0) -> VonMises:
    """With a hardening that lets it go by five yield strains at the loads here."""
    return VonMises(Elasticity(2e5 * mpa, 0.3), Linear(300.0 * mpa, 4000.0 * mpa))


def pulled(length: float = 1.0, mpa: float = 1.0) -> Scene:
    """A clamped block that a traction pulls by 1.1 times its yield stress and then presses, with another across."""
    mesh = block(1.0 * length, 2.0 * length, 2, 2, element=Element.Q4)
    loads = Traction("top", (0.0, 385.0 * mpa), THERE_AND_BACK), Traction("right", (20.0 * mpa, 0.0))
    return Scene(mesh, Geometry.PLANE_STRAIN, steel(mpa), CLAMPED, loads=loads)


def wide() -> Scene:
    """A wider one that hardens by a part in 66 of its stiffness."""
    mesh, soft = block(1.4, 1.0, 4, 4, element=Element.Q4), VonMises(Elasticity(92e3, 0.3), Linear(100.0, 1400.0))
    loads = (Traction("top", (-3.4, 121.4), THERE_AND_BACK),)
    return Scene(mesh, Geometry.PLANE_STRAIN, soft, CLAMPED, loads=loads)


def squeezed(driven: bool) -> Scene:
    """A clamped block under a lid: a force presses it, or it hardly moves while tractions pull the block's side."""
    if driven:
        force = Force((0.0, -900.0))
        lid, loads = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), 0.2, driven_by=force), ()
    else:
        lid = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -1e-5), ("top",), 0.2)
        loads = (Traction("right", (380.0, 0.0), THERE_AND_BACK),)
    mesh = block(2.0, 1.0, 3, 2, element=Element.Q4)
    return Scene(mesh, Geometry.PLANE_STRAIN, steel(), CLAMPED, (lid,), loads=loads)


def ends(scene: Scene, accuracy: float = ACCURACY) -> list[float]:
    return [step.state.tau for step in march(scene, Schedule(accuracy=accuracy), CONTROL)]


@pytest.mark.parametrize(
    ("scene", "times"),
    [(pulled(), 4), (wide(), 6), (squeezed(driven=True), 4), (squeezed(driven=False), 4)],
    ids=["alone", "wide", "force", "rest"],
)
def test_what_loads_displace_errs_by_what_was_asked(scene, times):
    """Some times that, beside a march with each increment in three parts: more the less the body hardens."""
    taus = [0.0, *ends(scene)]
    parts = [tau for pair in pairwise(taus) for tau in np.linspace(*pair, 4)[1:].tolist()]
    sides = [scene.mesh.boundary_nodes(name) for name in ("top", "right")]

    def moved(schedule: Schedule) -> np.ndarray:
        steps = list(march(scene, schedule, CONTROL))
        found = [[step.displacement[nodes].mean(axis=0) for nodes in sides] for step in steps]
        return np.reshape(found, (len(steps), -1))

    own, fine = moved(Schedule(accuracy=ACCURACY)), moved(Schedule(1, landings=tuple(parts[:-1])))
    assert np.abs(own - fine[2::3]).max() < times * ACCURACY * np.abs(fine).max()
    assert 10 < len(own) < 60


def test_it_takes_the_same_increments_in_other_units():
    assert ends(pulled(1e3, 1e-6)) == pytest.approx(ends(pulled()), rel=1e-6)


def test_it_takes_the_same_increments_with_other_numbers_of_nodes_and_elements():
    scene = pulled()
    mesh, rng = scene.mesh, np.random.default_rng(3)
    order, cells = rng.permutation(len(mesh.nodes)), rng.permutation(len(mesh.elements))
    number = np.argsort(order)
    sides = {name: number[np.asarray(edges)] for name, edges in mesh.boundaries.items()}
    again = Mesh(mesh.nodes[order], number[mesh.elements[cells]], sides)
    assert ends(replace(scene, mesh=again)) == pytest.approx(ends(scene), rel=1e-6)


@pytest.mark.slow
def test_half_a_body_takes_the_increments_of_the_whole():
    """A bar that is pulled by both ends, where one half of it is held by the plane of symmetry."""

    def bar(half: bool) -> Scene:
        mesh = block(1.0, 1.0 if half else 2.0, 2, 2 if half else 4, element=Element.Q4)
        pull = Traction("top", (0.0, 385.0), THERE_AND_BACK), Traction("right", (60.0, 0.0))
        if half:
            return Scene(mesh, Geometry.PLANE_STRAIN, steel(), (Symmetry("base", 1), Support("left", 0)), loads=pull)
        down = Traction("base", (0.0, -385.0), THERE_AND_BACK)
        return Scene(mesh, Geometry.PLANE_STRAIN, steel(), (Support("left", 0),), loads=(*pull, down))

    assert len(ends(bar(half=True))) > 10
    assert ends(bar(half=True)) == pytest.approx(ends(bar(half=False)), rel=1e-6)


@pytest.mark.parametrize(("unit", "angle"), [(1.0, 0.0), (1.0, 0.4), (1e-6, 0.0), (1e6, 0.4)])
def test_a_load_that_supports_take_up_changes_no_increments(unit, angle):
    """What round-off leaves of a pressure on a held wall is no load that follows yielding: it took 27, not 3."""
    mesh = block(1.1 * unit, 0.7 * unit, 2, 2, element=Element.Q8)
    lid = FlatTool((0.0, 0.7 * unit), (0.0, -1.0), (0.0, -0.05 * unit), ("top",), 0.2)
    held = Support("base", 1), Support("left", 0)
    bare = turned(Scene(mesh, Geometry.PLANE_STRAIN, steel(), held, (lid,)), angle)
    pressed = replace(bare, loads=(Pressure("left", 77.7),))
    assert ends(pressed) == pytest.approx(ends(bare), rel=1e-9)
