"""Scenes made to deceive: held nodes in a tool's way, bodies in parts, open axes, tools that have no part in it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from scipy import sparse

from bipot.certificate import Bounds
from bipot.coulomb import CoulombProblem, GlobalCoulombProblem, solve
from bipot.coulomb import Limits as CoulombLimits
from bipot.errors import IncrementFailed, ProgramError, SceneError
from bipot.fem.reduction import Geometry
from bipot.forms import Cache, Delassus, Dissipation, FormName, Newton, Penalty, Step, Tangent, Uzawa
from bipot.forms.posed import Posed
from bipot.iterate import Iterate
from bipot.laws.hardening import Linear, Perfect, Tabulated
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from tests.scenes import STEEL

PUNCH = FlatTool(point=(0.0, 10.0), normal=(0.0, -1.0), travel=(0.0, -1.0), candidates=("top",), mu=0.1)


def pressed(*supports: Support, punch: FlatTool = PUNCH) -> Scene:
    return Scene(block(10.0, 10.0, 2, 2, element=Element.Q8), Geometry.PLANE_STRAIN, STEEL, supports, (punch,))


@pytest.mark.parametrize(
    "form",
    [Tangent(), Dissipation(), Newton(), Delassus(), Penalty(1e6, 1e6), Uzawa(1e6, 1e6)],
    ids=lambda form: form.name.value,
)
def test_a_punch_does_not_pass_through_a_held_node(form):
    """The corner is held, so it is no unknown of the contacts; it is in the punch's way all the same."""
    scene = pressed(Support("base", 1), Support("left", 0), Support("right", 1))
    with pytest.raises(IncrementFailed, match=r"tools\[0\] is driven into node \d+, which a support holds"):
        list(march(scene, Schedule(2), Control(form, (), cuts=1)))


def test_a_held_node_is_named_however_little_a_tool_is_driven_into_it():
    """Far below what anything else is measured by, and above the bound on penetration."""
    punch = replace(PUNCH, point=(0.0, 10.0), travel=(0.0, -5e-9))
    scene = pressed(Support("base", 1), Support("left", 0), Support("right", 1), punch=punch)
    with pytest.raises(IncrementFailed, match=r"tools\[0\] is driven into node \d+"):
        list(march(scene, Schedule(1), Control(cuts=0)))


def test_a_punch_that_stays_away_from_held_nodes_presses():
    """The held corner is touched when the increment ends, and not entered."""
    punch = replace(PUNCH, point=(0.0, 10.1), travel=(0.0, -0.1))
    scene = pressed(Support("base", 1), Support("left", 0), Support("right", 1), punch=punch)
    *_, last = march(scene, Schedule(2))
    assert max(last.solved.certificate.ratios(Bounds()).values()) <= 1


def test_a_held_node_inside_a_tool_is_measured():
    """Where nothing is asked, the penetration is still told."""
    scene = pressed(Support("base", 1), Support("left", 0), Support("right", 1))
    accepted = next(march(scene, Schedule(2), Control(limits=replace(Control().limits, bounds=Bounds.none()))))
    assert accepted.solved.certificate.penetration == pytest.approx(0.05)


@pytest.mark.parametrize("shift", [(20.0, 0.0), (10.0, 10.0)], ids=["apart", "by a corner"])
def test_a_mesh_of_several_parts_is_refused(shift):
    """What holds the first part leaves the second where it likes, and no test of the whole body's motions sees it."""
    one = block(10.0, 10.0, 2, 2, element=Element.Q8)
    nodes, elements = (
        np.vstack([one.nodes, one.nodes + shift]),
        np.vstack([one.elements, one.elements + len(one.nodes)]),
    )
    _, first, which = np.unique(nodes, axis=0, return_index=True, return_inverse=True)
    edges = {"base": one.boundary("base")}
    mesh = Mesh(nodes[first], which.ravel()[elements], {name: which.ravel()[of] for name, of in edges.items()})
    with pytest.raises(SceneError, match="in parts"):
        Scene(mesh, Geometry.PLANE_STRAIN, STEEL, (Support("base", 0), Support("base", 1)))


@pytest.mark.parametrize("geometry", [Geometry.AXISYMMETRIC])
def test_an_axis_that_may_open_is_refused(geometry):
    """A displacement across the axis that is not zero there has no finite hoop strain.

    Two cones pressed into a disc opened a hole there, with a half to a sixth of the force.
    """
    scene = upsetting(mu=0.3, elements=2)
    with pytest.raises(SceneError, match=r"node \d+ on the axis"):
        replace(scene, supports=(Support("base", 1),))
    block_ = block(10.0, 10.0, 1, 1, element=Element.Q8)
    punch = replace(PUNCH, travel=(0.0, -0.1))
    with pytest.raises(SceneError, match=r"node \d+ on the axis"):
        Scene(block_, geometry, STEEL, (Support("base", 1),), (punch,))
    assert Scene(block_, Geometry.PLANE_STRAIN, STEEL, (Support("base", 1),), (punch,))


@pytest.mark.parametrize("travel", [1e3, 1e9, 1e15])
def test_a_tool_that_has_no_part_in_it_changes_nothing(travel):
    """Scales, round-off and units are of the tools that may be touched, not of one that runs far away."""
    scene, schedule = upsetting(mu=0.3, elements=2, reduction=0.01), Schedule(2, first=0.05, settling=1)
    away = FlatTool((0.0, 1e20), (0.0, -1.0), (0.0, -travel), ("top",), 0.0)
    alone = list(march(scene, schedule))
    with_it = list(march(replace(scene, tools=(*scene.tools, away)), schedule))
    assert len(with_it) == len(alone)
    for a, b in zip(alone, with_it, strict=True):
        assert b.solved.certificate.below_resolution(Bounds()) == ()
        np.testing.assert_allclose(b.state.forces[: len(a.state.forces)], a.state.forces, atol=1e-5 * 3e4)
        assert b.unique == a.unique


def test_a_path_that_does_not_begin_where_the_tool_is_is_refused():
    """The point says where the tool is at the start: a first multiple other than zero would say something else."""
    with pytest.raises(SceneError, match="path"):
        replace(PUNCH, path=((0.0, 1.0), (1.0, 2.0)))


def test_a_body_far_from_the_origin_is_refused():
    """At 1e11 sizes from it positions keep four digits of the body: forces were off by 5e-5, and nothing said so."""
    one = block(10.0, 10.0, 2, 2, element=Element.Q8)
    assert Mesh(one.nodes + 1e6, one.elements, one.boundaries).size == 10.0
    with pytest.raises(SceneError, match="of the origin"):
        Mesh(one.nodes + 1e12, one.elements, one.boundaries)


@pytest.mark.parametrize(
    "made",
    [
        lambda: upsetting(mu=0.3, young=210e-195, hardening=Perfect(0.3e-195)),
        lambda: Elasticity(1e70, 0.3),
        lambda: Linear(300.0, 1e300),
        lambda: Tabulated((0.0, 0.1), (300.0, 1e200)),
        lambda: upsetting(mu=0.3, height=1e-120, diameter=1e-120),
        lambda: upsetting(mu=0.3, height=1e120, diameter=1e120),
        lambda: upsetting(mu=0.3, reduction=1e-180),
        lambda: upsetting(mu=1e160),
        lambda: replace(PUNCH, travel=(0.0, -1e160)),
        lambda: replace(PUNCH, point=(0.0, 1e300)),
        lambda: replace(PUNCH, travel=(0.0, -1e-180)),
        lambda: replace(PUNCH, path=((0.0, 0.0), (1.0, 1e308))),
        lambda: replace(PUNCH, mu_at={0: 1e200}),
        lambda: Perfect(10**400),
    ],
)
def test_numbers_whose_squares_are_none_are_refused(made):
    """With stresses of 1e-180 nothing yielded, 35 times the force was certified; a travel of 1e-180 had no force."""
    with pytest.raises(SceneError, match=r"magnitude|at most|to 1e|float can hold"):
        made()


@pytest.mark.parametrize(
    "made",
    [
        lambda: Control(cuts=2000),
        lambda: Mesh([[0, 1], [2]], [[0] * 8]),  # type: ignore[arg-type]
        lambda: Mesh(np.eye(8, 2), [[0, 1], [2]]),  # type: ignore[arg-type]
        lambda: Tabulated(((0.0,), 1.0), (1.0, 2.0)),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_array_or_too_much_is_refused_in_words(made):
    with pytest.raises(SceneError):
        made()


def problem(**changes):
    given = {"W": np.eye(4), "q": [-1.0, 0.0, -1.0, 0.0], "mu": 0.3, "dim": 2}
    return CoulombProblem(**(given | changes))


@pytest.mark.parametrize(
    "changes",
    [
        {"mu": [0.1, 0.2, 0.3]},
        {"mu": "a"},
        {"dim": 2.0},
        {"dim": "2"},
        {"W": "a"},
        {"W": None},
        {"W": [[1, 2], [3]]},
        {"W": 1j * np.eye(4)},
        {"W": sparse.csr_array(1j * np.eye(4))},
        {"W": np.ones((4, 4, 1))},
        {"W": 1e200 * np.eye(4)},
        {"q": [1j, 0, 0, 0]},
        {"q": ["a"] * 4},
        {"q": [1e200, 0, 0, 0]},
    ],
    ids=str,
)
def test_a_discrete_problem_of_something_else_is_refused(changes):
    with pytest.raises(SceneError):
        problem(**changes)


@pytest.mark.parametrize(
    "ask",
    [
        lambda: CoulombLimits(tol="a"),  # type: ignore[arg-type]
        lambda: CoulombLimits(iterations=2.5),  # type: ignore[arg-type]
        lambda: solve(3),  # type: ignore[arg-type]
        lambda: solve(problem(), 3),  # type: ignore[arg-type]
        lambda: solve(problem(), chain=()),
        lambda: solve(problem(), start=["a"] * 4),  # type: ignore[arg-type]
        lambda: solve(problem(), start=np.full(4, np.inf)),
        lambda: solve(problem(), start=np.full(4, 1e300)),
    ],
)
def test_a_solver_asked_for_nonsense_says_so(ask):
    with pytest.raises(SceneError):
        ask()


def test_a_global_problem_of_a_singular_matrix_has_no_reduced_form():
    given = {"M": np.zeros((2, 2)), "H": np.eye(2), "f": [1.0, 2.0], "w": [0.0, 0.0], "mu": 0.3, "dim": 2}
    loose = GlobalCoulombProblem(**given)
    with pytest.raises(ProgramError, match="cannot be factorised"):
        loose.reduced()


@dataclass(frozen=True)
class Liar:
    """A form of one's own, which tells something else of an answer than ``tangent`` does."""

    tell: Callable[[Step], Step]
    name: ClassVar[FormName] = FormName.TANGENT

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Posed:
        return Tangent().init(iterate, r, cache)

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        step, state = Tangent().step(iterate, r, state)
        return self.tell(step), state


def of_another_body(step: Step) -> Step:
    """With a response that is not that of its displacement."""
    told = replace(step.iterate.response, internal=0 * step.iterate.response.internal)
    return replace(step, r=0 * step.r, iterate=replace(step.iterate, response=told))


def rubbed_where_held(step: Step) -> Step:
    """With friction where supports hold what would slip: no unknown feels it."""
    r, held = step.r.copy(), ~step.iterate.rows.rubs
    r[held, 1] += 0.09 * r[held, 0]
    return replace(step, r=r)


def test_what_a_form_says_of_the_body_is_not_believed():
    """Internal forces of zero balanced contact forces of zero, under a punch."""
    control = Control(Liar(of_another_body), (), cuts=0)
    with pytest.raises(IncrementFailed, match="times its bound"):
        next(march(upsetting(mu=0.3, elements=2, reduction=0.01), Schedule(2), control))


@pytest.mark.parametrize("what", ["mu", "shear", "tool", "node", "tangent_free", "weights"])
def test_a_form_cannot_write_into_what_it_is_judged_by(what):
    """With coefficients that it had changed the certificate was that of another law, and the force off by 2 %."""

    def changed(step: Step) -> Step:
        contacts = step.iterate.increment.system.candidates
        array = contacts.means.weights.data if what == "weights" else getattr(contacts, what)
        array[:] = array[::-1]
        return step

    with pytest.raises(IncrementFailed, match="read-only"):
        next(march(upsetting(mu=0.3, elements=2, reduction=0.01), Schedule(2), Control(Liar(changed), ())))


def test_friction_that_no_unknown_feels_is_not_believed():
    """It was part of the punch's force."""
    wall = Support("left", 0)
    scene, schedule = pressed(Support("base", 1), wall, punch=replace(PUNCH, travel=(0.0, -0.1))), Schedule(2)
    forms = Tangent(), Liar(rubbed_where_held)
    (first, _), (own, _) = (list(march(scene, schedule, Control(form, ()))) for form in forms)
    assert (~first.solved.iterate.rows.rubs & (first.solved.r[:, 0] > 0)).any()
    np.testing.assert_allclose(own.tool_forces, first.tool_forces, rtol=1e-9)


@pytest.mark.parametrize("form", [Tangent(), Dissipation(), Newton()], ids=lambda form: form.name.value)
def test_a_body_that_is_pushed_without_a_force_may_be_farther_off(form):
    """Nothing is below it: it obeys the law at the punch, and anywhere farther."""
    punch = replace(PUNCH, mu=0.0, travel=(0.0, -0.02))
    accepted = next(march(pressed(Support("left", 0), punch=punch), Schedule(2), Control(form, ())))
    assert any(words.startswith("position") for words in accepted.solved.undetermined)
    assert not accepted.unique


def test_a_body_that_is_pressed_stays_where_it_is():
    """Contacts that carry hold it, whichever touch without a force beside them."""
    base = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.0)
    scene = pressed(Support("left", 0), punch=replace(PUNCH, mu=0.0, travel=(0.0, -0.02)))
    accepted = next(march(replace(scene, tools=(*scene.tools, base)), Schedule(2)))
    assert accepted.solved.undetermined == ()
