"""What attempts at an increment are, and what those that solve it in halves need."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from bipot.control.reason import Reason
from bipot.errors import UnsuitedForm
from bipot.forms import FormName
from bipot.increment import Leave, Near, Solved
from bipot.iterate import Increment
from bipot.state import State


class Attempt(NamedTuple):
    """The result of one attempt at an increment: the solution or None, the form, passes spent, why forms failed.

    ``last`` is the failure of the last form whose solution was inadmissible, or else of the last form tried, which says
    less. ``strayed`` says whether a suited form failed, ``spared`` whether a form was left out, and ``refused`` whether
    the attempt ended early because the remaining forms would find the same inadmissible solution. ``left`` is the
    iterate at which the increment was left unsolved because the flow does not continue as it was carried on.
    """

    solved: Solved | None
    form: FormName
    passes: int
    failures: tuple[Reason, ...]
    last: Exception | None = None
    strayed: bool = False
    left: Near | None = None
    spared: bool = False
    refused: bool = False

    @property
    def unsuited(self) -> bool:
        """Whether no form suits the scene, so that a shorter increment would not help."""
        return isinstance(self.last, UnsuitedForm) and not self.strayed

    def failed(self, why: Reason) -> Attempt:
        """The same attempt with one more failure."""
        return self._replace(failures=(*self.failures, why))


Solve = Callable[[State, Near | None, Leave | None], Attempt]
"""``solve(begun, near_to, leave)`` attempts the increment from the state ``begun``, after the flow carried on.

The iteration starts at ``near_to``; for this and ``leave`` see :func:`bipot.increment.solve_increment`."""


Even = Callable[[Near], bool]
"""Says whether an increment by backward Euler strains the body so evenly that it needs no halves."""


class Halves(NamedTuple):
    """An increment in halves: ``first(near_to)`` attempts its first ``half``, ``whole`` the rest with the flow of that.

    One from rest that is ``even`` is not halved.
    """

    half: Increment
    first: Callable[[Near | None], Attempt]
    whole: Solve
    even: Even


Objection = Callable[[Solved], Reason | None]
"""Says why a solution is not accepted; None if it is accepted."""


def joined(tried: list[Attempt]) -> Attempt:
    """The last attempt with what was spent on, failed, strayed or was spared in any."""
    return tried[-1]._replace(
        passes=sum(attempt.passes for attempt in tried),
        failures=tuple(failure for attempt in tried for failure in attempt.failures),
        strayed=any(attempt.strayed for attempt in tried),
        spared=any(attempt.spared for attempt in tried),
    )
