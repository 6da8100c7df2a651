"""An elastic body: every form poses it, without plastic cones, and finds what a material that hardly yields gives."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Elastic, Elasticity, Perfect, Schedule, VonMises, march, upsetting
from bipot.conic.through_cvxpy import Cvxpy
from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, system_of
from bipot.programs.data import Block, Term, Units
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.terms import ContactTerms
from bipot.results.columns import flow_gap
from tests.scenes import rows_between

STEEL = Elasticity(210e3, 0.3)
PRESSED = upsetting(mu=0.2, reduction=0.05, elements=2)
RUBBER = replace(PRESSED, material=Elastic(STEEL))
FORMS = {
    "newton": Newton(),
    "tangent": Tangent(),
    "dissipation": Dissipation(),
    "cvxpy": Dissipation(solver=Cvxpy()),
}


def last(scene, form):
    """The last of three increments, by one form alone."""
    *_, accepted = march(scene, Schedule(3), Control(form, ()))
    return accepted


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_every_form_finds_what_a_material_that_never_yields_gives(form):
    found = last(RUBBER, form)
    expected = last(replace(PRESSED, material=VonMises(STEEL, Perfect(1e9))), Newton())
    np.testing.assert_allclose(
        found.state.stress, expected.state.stress, atol=1e-6 * np.abs(expected.state.stress).max()
    )
    np.testing.assert_allclose(found.solved.r, expected.solved.r, atol=1e-6 * np.abs(expected.solved.r).max())
    assert not found.state.peeq.any()
    assert found.solved.certificate.relative_gap < 1e-7
    assert found.solved.certificate.yield_violation == 0.0
    assert found.energies.plastic == 0.0
    assert flow_gap(system_of(RUBBER), found) == 0.0


def test_an_elastic_program_has_no_plastic_variables_and_is_the_quadratic_one():
    """Its P is the stiffness on the displacements and zero elsewhere."""
    system = system_of(RUBBER)
    state = system.rest()
    response = system.body.respond(state, np.zeros(system.body.space.size))
    rows = rows_between(system.candidates, state.gap, 0.0, 0.01)
    contact = ContactTerms(rows, rows.threshold(np.full((rows.count, 2), 10.0)))
    program = DissipationProgram(system.body.plastic_model(response), np.zeros(len(response.x)), contact)
    conic = program.conic()
    n = len(response.x)
    assert Term.YIELD not in {row.term for row in conic.rows}
    assert set(conic.blocks) == {Block.DISPLACEMENT, Block.SLIP_BOUND}
    K = system.body.stiffness(response, Tangent().kind).toarray()
    np.testing.assert_allclose(conic.P.toarray()[:n, :n], K, atol=1e-12 * np.abs(K).max())
    assert not conic.P.toarray()[n:].any()
    assert not program.scaled(Units(1.0, 10.0, 1.0, 1000.0)).model.flows
