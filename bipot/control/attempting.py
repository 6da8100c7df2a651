"""One attempt at an increment: the forms in turn, each time the flow that is carried on has changed."""

from __future__ import annotations

from dataclasses import replace

from bipot.control.carrying import Attempt, carry_on
from bipot.control.control import Control
from bipot.control.dissipated import Dissipated
from bipot.control.reason import Reason
from bipot.errors import InvertedElement, NotConverged, ProgramError, UnsuitedForm
from bipot.forms import Cache, FormName
from bipot.increment import Leave, LeftOff, Near, Observer, Solved, Trial, solve_increment, unobserved
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.response import State

STRAYED = (NotConverged, InvertedElement)
FAILURES = (*STRAYED, ProgramError)


def attempt_increment(
    increment: Increment,
    control: Control,
    cache: Cache,
    largest: float,
    observe: Observer = unobserved,
    sparing: bool = False,
) -> Attempt:
    """Try the increment, each time with the forms in turn; ``sparing`` the dissipation program where one strayed.

    Where a form is not suited, or a matrix singular, a shorter increment would not help: then it is not spared.
    ``largest`` is as in :func:`~bipot.increment.solve_increment`; :mod:`bipot.control.carrying` decides on repetitions.
    """

    def solve(begun: State, near_to: Near | None, leave: Leave | None) -> Attempt:
        passes, failures, last, strayed = 0, list[Reason](), None, False
        begins = replace(increment, start=begun)

        def count(trial: Trial) -> None:
            nonlocal passes
            passes += 1
            observe(trial)

        for form in control.forms:
            if sparing and form.name is FormName.DISSIPATION and isinstance(last, STRAYED):
                continue
            try:
                solved = solve_increment(begins, form, control.limits, cache, largest, count, near_to, leave)
            except LeftOff as left:
                return Attempt(None, form.name, passes, tuple(failures), strayed=strayed, left=left.near)
            except FAILURES as failure:
                failures.append(Reason.of(form.name, failure))
                last, strayed = failure, strayed or not isinstance(failure, UnsuitedForm)
            else:
                return Attempt(solved, form.name, passes, tuple(failures), strayed=strayed)
        return Attempt(None, control.forms[-1].name, passes, tuple(failures), last, strayed)

    def refused(solved: Solved) -> Reason | None:
        dissipation = Dissipated.of(increment.start, solved)
        return dissipation.negative(control.limits.bounds.relative_gap, friction=solved.posed is None)

    return carry_on(increment, solve, refused, control.integration is Integration.BDF2)
