"""Near a solution the conic forms converge as Newton does: their models leave nothing out there."""

from time import sleep

import numpy as np
import pytest
import scipy.sparse as sp

from bipot import (
    Circle,
    Control,
    Dissipation,
    Elasticity,
    Element,
    FlatTool,
    Force,
    Geometry,
    Moment,
    Newton,
    Perfect,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Tangent,
    Turn,
    VonMises,
    block,
    brick,
    march,
    upsetting,
)
from bipot.forms import dissipation, tangent
from bipot.increment import Trial
from bipot.programs.fixed_point import Route
from studies.fuzz.shaped import draw_shaped

STEEL = VonMises(Elasticity(210_000.0, 0.3), Perfect(300.0))


@pytest.mark.parametrize(("form", "most"), [(Tangent(), 1.1), (Dissipation(), 0.8)], ids=["tangent", "dissipation"])
def test_strong_perfect_flow_takes_no_more_passes_than_newton(form, most):
    """With C^ep alone, which leaves out how the configuration moves, it takes twice as many."""

    def passes(control):
        return sum(a.passes for a in march(upsetting(mu=0.1, reduction=0.3, elements=3), Schedule(20), control))

    assert passes(Control(form, ())) <= most * passes(Control(Newton(), ()))


def test_the_last_pass_squares_the_error():
    """Passes that halve it end just below the bound of 1e-7; the last of these ends far below."""
    *_, last = march(
        upsetting(mu=0.1, reduction=0.3, elements=4), Schedule(6, 0.01, settling=1, growth=4.0), Control(Tangent(), ())
    )
    assert last.passes >= 3
    assert last.solved.certificate.equilibrium < 1e-8


def test_the_last_pass_squares_the_error_under_a_roll_that_nothing_turns():
    """Of a roll without a moment no part is balanced beside that moment: near is what is small beside the forces."""
    free = Turn(0.0, (0.5, 1.6), driven_by=Moment(0.0))
    roll = ShapedTool(Circle((0.5, 1.6), 0.6), (0.0, 0.0), ("top",), 0.5, driven_by=Force((0.0, -150.0)), turn=free)
    mesh, supports = block(1.0, 1.0, 2, 2, element=Element.Q8), (Support("base", 1), Support("left", 0))
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, supports, (roll,))
    *_, last = march(scene, Schedule(3), Control(Tangent(), ()))
    assert last.passes >= 3
    assert last.solved.certificate.equilibrium < 1e-9


@pytest.mark.parametrize("form", [Newton(), Tangent(), Dissipation()], ids=["newton", "tangent", "dissipation"])
def test_a_tool_at_rest_does_not_rub_along_a_support(form):
    """Where a support holds a node along a tangent, friction has the direction of the slip; without one it is none.

    What the law leaves open would else be what it was, or none, as the form's last pass happened to find.
    """
    tool = FlatTool(
        (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.03, 0.0, -0.03), ("top",), 0.3, ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0))
    )
    supports = (Support("left", 0), Support("base", 2), Support("front", 1), Support("base", 0))
    scene = Scene(brick(1.0, 1.0, 1.0, 2, 2, 1, element=Element.H8), Geometry.SOLID, STEEL, supports, (tool,))
    trials: list[Trial] = []
    *_, slid, rested = march(scene, Schedule(2), Control(form, ()), observe=trials.append)
    contacts = rested.solved.iterate.increment.system.candidates
    held = np.isin(contacts.node, scene.mesh.boundary_nodes("left")) & (slid.solved.r[:, 1:] != 0).any(axis=1)
    assert held.any()
    along_x = rested.solved.iterate.frames[held, 1:, 0] != 0
    assert (rested.solved.r[held, 1:][along_x] == 0).all()
    # A form may find that its start is an answer already, and return it.
    start = next(trial for trial in trials if trial.iterate.increment.start.tau == slid.state.tau)
    assert (slid.state.forces[held, 1:][along_x] != 0).any()
    assert (start.r[held, 1:][along_x] == 0).all()


def test_newton_on_the_linearisation_counts_as_solving(monkeypatch):
    """A pass near a solution states a matrix, and spends its time on factors: seconds are booked as with a program."""
    solve = tangent.coupled

    def slow(*given):
        sleep(0.02)
        return solve(*given)

    monkeypatch.setattr(tangent, "coupled", slow)
    passes: list[Trial] = []
    scene = upsetting(mu=0.1, reduction=0.05, elements=2)
    list(march(scene, Schedule(1), Control(Tangent(), ()), observe=passes.append))
    near = [t.step.timing for t in passes if t.state.distance is not None and t.state.distance <= tangent.LINEAR]
    assert near
    assert all(timing.solve >= 0.02 for timing in near)


def test_a_driven_tool_that_the_program_leaves_in_the_air_comes_back():
    """The exact linearisation has no spring for it: it took such a tool where the next program has no minimum."""
    drawn = draw_shaped(980206)
    control = Control(Dissipation(), (), cuts=0, integration=drawn.integration)
    accepted = list(march(drawn.scene, drawn.schedule, control))
    assert accepted[-1].state.tau == 1.0


def test_a_moment_left_unbalanced_is_not_small_beside_wrong_contact_forces():
    """Times their arms these were far above the moment; the linearisation came ever slower to a tool that turned on."""
    drawn = draw_shaped(970063)
    *_, last = march(drawn.scene, drawn.schedule, Control(Tangent(), (), cuts=0, integration=drawn.integration))
    assert last.state.tau == 1.0


def test_the_energy_leads_on_where_the_linearisation_leads_nowhere(monkeypatch):
    """Without a step after it, a pass of `dissipation` ends with the threshold of the last one, and errs by it."""
    solve = dissipation.coupled

    def symmetric(model, *given):
        K = sp.csc_matrix(model.K)
        return solve(model, *given) if abs(K - K.T).max() < 1e-9 * abs(K).max() else None

    monkeypatch.setattr(dissipation, "coupled", symmetric)
    passes: list[Trial] = []
    list(
        march(
            upsetting(mu=0.1, reduction=0.05, elements=2),
            Schedule(2),
            Control(Dissipation(), ()),
            observe=passes.append,
        )
    )
    assert {t.step.coupled.route for t in passes} == {Route.EXACT}
