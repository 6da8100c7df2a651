"""Increments by accuracy of bodies that nobody calibrated on: confined, turned, strained a little; and their limits."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest

from bipot.control.estimate import error_estimate
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Hardening, Linear, Perfect, Swift, Voce
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Accepted, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder
from bipot.meshes.solids import brick
from bipot.paths import Path
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.poses import Turn
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool
from studies.accuracy.paced import CONTROL

ACCURACY = 1e-3
YOUNG = 210_000.0
STRAIGHT: Path = ((0.0, 0.0), (1.0, 1.0))
CLAMPED = (Support("base", 0), Support("base", 1))
QUARTER = (Symmetry("base", 1), Symmetry("left", 0))


def metal(poisson: float, hardening: Hardening) -> VonMises:
    return VonMises(Elasticity(YOUNG, poisson), hardening)


def lid(travel: tuple[float, float], mu: float, path: Path = STRAIGHT) -> tuple[FlatTool, ...]:
    return (FlatTool((0.0, 1.0), (0.0, -1.0), travel, ("top",), mu, path),)


def welded() -> Scene:
    """Of a metal that can be compressed, between welded tools: its yield strain is 0.11 %, it is pressed by 1.5 %."""
    mesh = block(4.0, 1.0, 8, 4, element=Element.Q4)
    return Scene(mesh, Geometry.PLANE_STRAIN, metal(0.0, Perfect(231.0)), QUARTER, lid((0.0, -0.015), np.inf))


def pulled() -> Scene:
    """A clamped block that a welded tool pulls."""
    mesh = block(2.6, 1.0, 5, 2, element=Element.T6)
    return Scene(mesh, Geometry.PLANE_STRAIN, metal(0.0, Linear(420.0, 840.0)), CLAMPED, lid((0.0, 0.1), np.inf))


def wide() -> Scene:
    """A clamped block beneath a tool without friction that presses and goes along."""
    mesh = block(6.3, 1.0, 8, 2, element=Element.T6)
    return Scene(mesh, Geometry.PLANE_STRAIN, metal(0.0, Voce(693.0, 600.0, 5.0)), CLAMPED, lid((0.1, -0.1), 0.0))


def short() -> Scene:
    """A rough cylinder that is pressed by eight yield strains."""
    held = Symmetry("base", 1), Support("axis", 0)
    material = metal(0.0, Swift(231.0, 0.02, 0.15))
    return Scene(cylinder(1.0, 1.0, 6, 6), Geometry.AXISYMMETRIC, material, held, lid((0.0, -0.005), 0.3))


def twisted(times: float = 1.0, elements: int = 3) -> Scene:
    """A brick, held below, that a lid presses and turns on at once: its force alone is not stationary."""
    top = (1.0, 1.0, 1.0)
    turn = Turn(0.2 * times, top, axis=(0.0, 0.0, 1.0))
    tool = ShapedTool(Plane(top, (0.0, 0.0, -1.0)), (0.0, 0.0, -0.1 * times), ("top",), 0.3, turn=turn)
    held = tuple(Support("base", d) for d in range(3))
    mesh = brick(2.0, 2.0, 1.0, elements, elements, elements)
    return Scene(mesh, Geometry.SOLID, metal(0.0, Voce(166.0, 100.0, 5.0)), held, (tool,))


def slender() -> Scene:
    """A nearly smooth bar, twice as high as it is wide, in which the first band of shear goes on to the side."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.28), ("top", "right"), 0.2)
    mesh = block(0.41, 1.0, 2, 5, element=Element.Q8)
    return Scene(mesh, Geometry.PLANE_STRAIN, metal(0.2, Perfect(80.0)), QUARTER, (tool,))


def sheared() -> Scene:
    """A clamped block that a welded tool takes along, at a constant height."""
    mesh = block(1.15, 1.0, 3, 3, element=Element.T6)
    return Scene(mesh, Geometry.PLANE_STRAIN, metal(0.45, Perfect(357.0)), CLAMPED, lid((0.03, 0.0), np.inf))


def quickened() -> Scene:
    """A slender block whose tool goes faster just before it yields."""
    mesh = block(0.31, 1.0, 3, 6, element=Element.Q8)
    path: Path = ((0.0, 0.0), (0.5, 0.3), (1.0, 1.0))
    material = metal(0.0, Linear(1365.0, 2730.0))
    return Scene(mesh, Geometry.PLANE_STRAIN, material, QUARTER, lid((0.0, -0.01), 0.1, path))


def rough() -> Scene:
    """A square between welded tools that is pressed by 26 yield strains: first yield is in its first increment."""
    mesh = block(1.0, 1.0, 4, 4, element=Element.T6)
    material = metal(0.2, Voce(80.0, 60.0, 30.0))
    return Scene(mesh, Geometry.PLANE_STRAIN, material, QUARTER, lid((0.0, -0.01), np.inf))


def stem(base: float) -> Scene:
    """A stem on a square block that is so wide, and held below: the stem alone is upset, by a fifth."""
    height, count = base + 1.0, round(base)
    square = block(base, height, count, count + 1, element=Element.Q8)
    x, y = square.nodes[square.elements].mean(axis=1).T
    elements = square.elements[(y < base) | (x < 1.0)]
    used, numbers = np.unique(elements, return_inverse=True)
    parts = {"base": square.boundaries["base"], "left": square.boundaries["left"], "top": square.boundaries["top"][:1]}
    new = {old: k for k, old in enumerate(used.tolist())}
    sides = {name: [[new[a] for a in edge] for edge in np.array(edges).tolist()] for name, edges in parts.items()}
    mesh = Mesh(square.nodes[used], numbers.reshape(elements.shape), {k: np.array(v) for k, v in sides.items()})
    tool = FlatTool((0.0, height), (0.0, -1.0), (0.0, -0.2), ("top",), 0.1)
    held = Symmetry("left", 0), Support("base", 0), Support("base", 1)
    return Scene(mesh, Geometry.PLANE_STRAIN, metal(0.3, Linear(300.0, 600.0)), held, (tool,))


def paced(scene: Scene, count: int | None = None, accuracy: float = ACCURACY) -> list[Accepted]:
    return list(islice(march(scene, Schedule(accuracy=accuracy), CONTROL), count))


def missed(scene: Scene, steps: list[Accepted]) -> Iterator[np.ndarray]:
    """Errors (d,) of the tool's force at ends of increments against eight parts of each, over its largest."""
    ends = [step.state.tau for step in steps]
    parts = [tau for pair in pairwise([0.0, *ends]) for tau in np.linspace(*pair, 9)[1:].tolist()]
    fine = list(islice(march(scene, Schedule(1, landings=tuple(tau for tau in parts if tau < 1)), CONTROL), len(parts)))
    largest = max(float(np.linalg.norm(step.tool_force(0))) for step in fine)
    for own, other in zip(steps, fine[7::8], strict=True):
        assert own.state.tau == other.state.tau
        yield (own.tool_force(0) - other.tool_force(0)) / largest


def along(scene: Scene, steps: list[Accepted]) -> np.ndarray:
    """These errors (k,) along the tool's way, over the accuracy."""
    way = np.array(scene.tools[0].travel)
    return np.abs([error @ way for error in missed(scene, steps)]) / np.linalg.norm(way) / ACCURACY


@pytest.mark.parametrize("count", [10, pytest.param(None, marks=pytest.mark.slow)])
@pytest.mark.parametrize("scene", [welded(), pulled(), wide()], ids=["welded", "pulled", "wide"])
def test_a_confined_body_has_not_long_yielded_however_far_it_is_strained(scene, count):
    """It stores a third of the work; passed in one increment, yielding left errors of 4.5 to 14 times the accuracy."""
    steps = paced(scene, count)
    assert along(scene, steps).max() <= 3
    assert len(steps) < 60


def test_a_body_that_has_yielded_within_a_short_way_is_not_followed():
    """It took 14 increments."""
    scene = short()
    steps = paced(scene)
    assert len(steps) <= 2
    assert along(scene, steps).max() <= 3


@pytest.mark.parametrize("count", [3, pytest.param(None, marks=pytest.mark.slow)])
def test_a_lid_that_presses_and_turns_follows_yielding(count):
    """A twentieth of its way was one increment, off by 24 times the accuracy; of the force there, by 35 times."""
    scene = twisted()
    steps = paced(scene, count)
    pressed = [abs(error[2]) for error in missed(scene, steps)]
    assert max(pressed) <= 3 * ACCURACY
    assert steps[0].state.tau < 0.01


def test_yielding_is_followed_however_far_a_lid_presses_and_turns_in_all():
    """A way four times as long was begun by an increment past first yield, off by 11 times the accuracy."""
    scene = twisted(4.0, elements=2)
    steps = paced(scene, 4)
    assert max(abs(error[2]) for error in missed(scene, steps)) <= ACCURACY
    assert steps[0].state.tau == pytest.approx(paced(twisted(elements=2), 1)[0].state.tau / 4, rel=0.02)


def test_a_lid_that_turns_all_the_way_round_strains_a_body_on_its_way():
    """It ends where it began: its strain was taken for that of its pressing alone, and forces were a fiftieth off."""
    once, twice = (paced(twisted(turns * 2 * np.pi / 0.2, elements=2), 1)[0].state.tau for turns in (1, 2))
    assert twice == pytest.approx(once / 2, rel=1e-3)
    assert once * 2 * np.pi == pytest.approx(paced(twisted(elements=2), 1)[0].state.tau * 0.2, rel=0.02)


@pytest.mark.parametrize(("scene", "order"), [(short(), 2), (twisted(), 1)], ids=["pressed", "turned"])
def test_what_is_left_of_yielding_is_what_the_body_stores(scene, order):
    """Made here of stress and Hooke's law: all that rests is stored or dissipated."""
    tau = 1.0 if order == 2 else 0.06
    step = next(march(scene, Schedule(1, landings=() if tau == 1 else (tau,)), CONTROL))
    kin, stress = step.solved.response.kinematics, step.stress.matrix
    stored = np.einsum("eqij,eqij->eq", stress, stress) / YOUNG  # Poisson's ratio is zero.
    work = np.einsum("eqij,eqij->eq", stress, step.plastic_strain.matrix) + stored
    part = float((kin.volume * stored).sum() / (kin.volume * work).sum())
    assert 1 / 9 < part < 1 / 6
    square, peeq = (kin.volume * np.vecdot(kin.strain, kin.strain)).sum() / kin.volume.sum(), step.state.peeq
    variance = np.cov(peeq.ravel(), aweights=kin.volume.ravel(), bias=True)
    left = (1 - part) * (part**order - (1 / 9) ** order) / 10
    found = error_estimate(step.start, step.solved)
    assert found == pytest.approx(2.5 * (square / 12 + 0.4 * variance) + left, rel=1e-6)
    assert left > 0.1 * found


def punched() -> Scene:
    """A large block beneath a flat punch a quarter as wide, which is pressed into it by a tenth of its half."""
    mesh = block(4.0, 4.0, 12, 12, element=Element.T6)
    beneath = mesh.nodes[mesh.boundaries["top"]][..., 0].max(axis=1) < 1.01
    boundaries = {**mesh.boundaries, "punch": mesh.boundaries["top"][beneath]}
    tool = FlatTool((0.0, 4.0), (0.0, -1.0), (0.0, -0.1), ("punch",), 0.1)
    held = Symmetry("left", 0), Support("base", 0), Support("base", 1)
    mesh = replace(mesh, boundaries=boundaries)
    return Scene(mesh, Geometry.PLANE_STRAIN, metal(0.3, Linear(300.0, 600.0)), held, (tool,))


@pytest.mark.parametrize("scene", [stem(4.0), stem(8.0), punched()], ids=["stem", "low stem", "punch"])
def test_what_is_strained_counts_however_large_the_body_around_it_is(scene):
    """All was one increment or two, off by up to 9 times the accuracy: strain was a mean over the body."""
    steps = paced(scene, 3)
    assert steps[-1].state.tau < 1
    assert along(scene, steps).max() <= 2


def test_strain_is_a_mean_over_the_work_where_little_of_the_body_takes_that():
    """Made here of stress, strain and peeq; nothing is left of yielding."""
    step = next(march(punched(), Schedule(1), CONTROL))
    kin, peeq = step.solved.response.kinematics, step.state.peeq
    power = kin.volume * np.abs(np.vecdot(step.state.stress, kin.strain))
    assert power.sum() ** 2 < kin.volume.sum() * (power**2 / kin.volume).sum() / 3
    square = np.average(np.vecdot(kin.strain, kin.strain), weights=power)
    variance = np.cov(peeq.ravel(), aweights=power.ravel(), bias=True)
    found = error_estimate(step.start, step.solved)
    assert found == pytest.approx(2.5 * (square / 12 + 0.4 * variance), rel=1e-6)


def test_a_force_across_the_way_is_not_what_is_asked():
    """The power of the tool is stationary, a force that does no work is not."""
    scene = sheared()
    errors = np.abs(list(missed(scene, paced(scene)))) / ACCURACY
    assert errors[:, 0].max() <= 3
    assert errors[:, 1].max() > 9


def test_forces_along_different_lines_are_not_what_is_asked():
    """Nor is any alone stationary: both are off on a cube pressed along two axes, by ever less."""
    held = Symmetry("base", 2), Symmetry("left", 0), Symmetry("front", 1)
    aside = FlatTool((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (-0.05, 0.0, 0.0), ("right",), 0.0)
    down = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.1), ("top",), 0.0)
    mesh = brick(1.0, 1.0, 1.0, 2, 2, 2)
    scene = Scene(mesh, Geometry.SOLID, metal(0.3, Perfect(300.0)), held, (down, aside))
    errors = along(scene, paced(scene, 4, accuracy=1e-4)) * ACCURACY / 1e-4
    assert max(errors[:2]) > 9
    assert errors[3] < 1


def test_where_bands_of_shear_form_the_error_of_an_increment_grows_by_itself():
    """The first increment's, below the accuracy, to more than three times that, whatever follows it is short."""
    scene = slender()
    first = paced(scene, 1)[0].state.tau
    rest = np.linspace(first, 0.4, 12)[1:].tolist()

    def forces(begin: list[float]) -> np.ndarray:
        taus = (*begin, *rest)
        steps = islice(march(scene, Schedule(1, landings=taus), CONTROL), len(taus))
        return np.array([step.tool_force(0)[1] for step in steps])[-len(rest) - 1 :]

    fine = forces(np.linspace(0.0, first, 9)[1:].tolist())
    errors = np.abs(forces([first]) - fine) / np.abs(fine).max() / ACCURACY
    assert errors[0] < 1.2
    assert errors[-1] > 3


def test_yielding_just_after_a_change_of_pace_is_followed():
    """It was passed in one increment, as if the path turned there, with an error of six times the accuracy."""
    scene = quickened()
    steps = paced(scene)
    assert len(steps) > 3
    assert along(scene, steps).max() <= 3


def test_first_yield_of_a_rough_body_leaves_more_than_a_fine_accuracy():
    """Within a coarse one."""
    scene = rough()
    fine = along(scene, paced(scene, accuracy=1e-4)).max() * ACCURACY / 1e-4
    assert along(scene, paced(scene)).max() <= 3
    assert 3 < fine < 8
