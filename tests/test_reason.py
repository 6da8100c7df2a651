"""Why an increment fell back, was cut or was re-checked: every kind as it arises, its numbers and its sentence."""

import re
from functools import partial

import numpy as np
import pytest

from bipot.conic.solver import Accuracy
from bipot.control import carried
from bipot.control.attempting import Dissipated, attempt_increment
from bipot.control.landing import Locate
from bipot.control.reason import Reason, ReasonKind
from bipot.errors import InfeasibleProgram, InvertedElement, NotConverged, ProgramError, UnboundedProgram, UnsuitedForm
from bipot.forms import Cache, Delassus, Dissipation, FormName, Newton, Tangent
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.scene.loads import Traction
from bipot.scene.supports import Prescribed, Support
from tests.courses import HELD
from tests.scenes import scene, tool

PULLED = Traction("right", (1.0, 0.0))
WALL = tool(point=(1.01, 0.0), normal=(-1.0, 0.0), travel=(0.0, 0.0), candidates=("right",))


def accepted(control, increments=2, **changes):
    """Reasons of the increments of a block that a march accepts."""
    return [reason for step in march(scene(**changes), Schedule(increments), control) for reason in step.reasons]


def failed(control, **changes):
    """Reasons of an attempt at one increment of a block, from rest to the end, that fails."""
    system = system_of(scene(**changes))
    attempt = attempt_increment(Increment(system, system.rest(), 1.0), control, Cache(), 0.0)
    assert attempt.solved is None
    return attempt.failures


ONE_PASS = Control(Newton(), (), Limits(passes=1))
ARISES = {
    ReasonKind.UNSUITED: (partial(failed, Control(Delassus(), ()), tools=()), "delassus: nothing may touch the body"),
    ReasonKind.NOT_CONVERGED: (partial(failed, ONE_PASS), "newton: 1 passes left equilibrium .* times its bound"),
    ReasonKind.PROGRAM: (
        partial(failed, Control(Dissipation(), ()), tools=(), supports=(Support("base", 1),), loads=(PULLED,)),
        "dissipation: its program has no minimum",
    ),
    ReasonKind.FOLDED: (
        # Nodes that are led through the base: no length of Newton's step keeps it from folding.
        partial(failed, Control(Newton(), ()), tools=(), supports=(*HELD, Prescribed("top", 1, -1.5))),
        r"newton: element \d at \(.*\).*: Jacobian determinant -.* is not positive",
    ),
    ReasonKind.LANDING: (
        partial(accepted, Control(Tangent(), locate=Locate()), 4, tools=(tool(), WALL)),
        r"cut to the landing of node \d+ at tau = 0\.19",
    ),
    ReasonKind.ALMOST: (
        partial(accepted, Control(Dissipation(accuracy=Accuracy(1e-15), polished=False))),
        r"\d+ passes almost solved, certificate re-checked",
    ),
}


@pytest.mark.parametrize("kind", ARISES, ids=lambda kind: kind.name)
def test_a_kind_arises_and_says_what_happened(kind):
    make, words = ARISES[kind]
    reason = make()[0]
    assert reason.kind is kind
    assert re.match(words, str(reason))
    assert all(np.isfinite(value) for value in reason.measures.values())


def test_a_cut_says_which_end_was_not_reached():
    steps = list(march(upsetting(mu=0.3, reduction=0.6, elements=2), Schedule(2), Control(Tangent(), ())))
    cuts = [[r.measures["tau"] for r in step.reasons if r.kind is ReasonKind.CUT] for step in steps]
    assert [len(taus) for taus in cuts] == [step.cuts for step in steps]
    assert sum(map(len, cuts)) > 0
    for step, taus in zip(steps, cuts, strict=True):
        assert all(tau > step.state.tau for tau in taus)


def test_flow_that_is_not_carried_on_and_a_negative_dissipation_are_reasons(monkeypatch):
    monkeypatch.setattr(carried, "TOO_MUCH", -1.0)
    flow = accepted(Control(Newton(), ()))[-1]
    assert (flow.kind, str(flow)) == (ReasonKind.FLOW, "flow not carried on: unsettled after 3 solutions")
    assert flow.measures == {"solutions": 3}
    monkeypatch.setattr(Dissipated, "of", staticmethod(lambda start, solved: Dissipated(-2.0, -1.0, 8.0)))
    (negative,) = failed(Control(Newton(), ()))
    assert (negative.kind, negative.form) == (ReasonKind.DISSIPATION, FormName.NEWTON)
    assert negative.measures == {"plastic": -2.0, "friction's": -1.0}
    sentence = "newton: plastic dissipation is negative, -2 and friction's dissipation is negative, -1"
    assert str(negative) == sentence


@pytest.mark.parametrize(
    ("failure", "kind"),
    [
        (UnsuitedForm("why"), ReasonKind.UNSUITED),
        (NotConverged("why", {"law": 2.0}), ReasonKind.NOT_CONVERGED),
        (InvertedElement("why"), ReasonKind.FOLDED),
        (ProgramError("why"), ReasonKind.PROGRAM),
        (InfeasibleProgram("why"), ReasonKind.PROGRAM),
        (UnboundedProgram("why"), ReasonKind.PROGRAM),
    ],
    ids=lambda value: getattr(value, "name", type(value).__name__),
)
def test_a_failure_is_one_kind_and_keeps_its_numbers(failure, kind):
    reason = Reason.of(FormName.TANGENT, failure)
    assert (reason.kind, str(reason)) == (kind, "tangent: why")
    assert reason.measures == ({"law": 2.0} if isinstance(failure, NotConverged) else {})
