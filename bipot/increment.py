r"""The solution of one increment: the only loop over passes.

A pass linearises the body at the last iterate, solves the form's convex program with the friction threshold or shift
frozen, updates the threshold or shift by the answer, and evaluates the body at the answer. The increment is accepted
when its certificate, recomputed from the fields, is within the bounds.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

from bipot.certificate import Bounds, Certificate
from bipot.checks.examined import POSED, Examined
from bipot.checks.refusals import refuse_blocked, refuse_motion
from bipot.checks.settling import least_moved, unloaded
from bipot.conic.problem import Claim, Timing
from bipot.conic.solver import asked
from bipot.contact.closeness import newly_closed
from bipot.errors import InvertedElement, NotConverged, require, require_count, require_type
from bipot.forms import OWN, Cache, Form, Step
from bipot.iterate import Increment, Iterate
from bipot.prediction import begin
from bipot.programs.data import ContactRows
from bipot.programs.fixed_point import Coupled
from bipot.response import Response
from bipot.state import State
from bipot.typing import Floats, Ints, as_numbers, make_floats

APART = 0.1
"""Gap at the start over the increment's unit of length above which a candidate lands in it, and not at its start."""


@dataclass(frozen=True)
class Limits:
    """When an increment is accepted, and when it is given up.

    It is given up after ``passes``, or when ``patience`` passes in a row have not reduced the worst measure (over its
    bound) below ``progress`` times its smallest value so far.
    """

    bounds: Bounds = Bounds()
    passes: int = 40
    patience: int = 8
    progress: float = 0.7

    def __post_init__(self) -> None:
        require_type(self.bounds, Bounds, "limits.bounds")
        require_count(self.passes, "limits.passes")
        require_count(self.patience, "limits.patience")
        make_floats(self, of="limits.", progress="in (0, 1]")


@dataclass(frozen=True, eq=False)
class Near:
    """A starting point of the iteration: an iterate with the forces r (c, d) of all candidates."""

    iterate: Iterate
    r: Floats

    @property
    def response(self) -> Response:
        """The body's response."""
        return self.iterate.response

    @property
    def rows(self) -> ContactRows:
        """The contact rows of all candidates."""
        return self.iterate.rows


@dataclass(frozen=True, eq=False)
class Solved(Near):
    """An increment that met its bounds: iterate, forces of all candidates, certificate, cost.

    ``almost`` counts the passes whose solver claimed less than the requested accuracy; the certificate has re-checked
    them. ``coupled`` says how friction was coupled to the normal forces. ``undetermined`` names what the law does not
    determine (:mod:`bipot.checks.determinacy`) and is empty if the answer is locally unique. ``posed`` is as in
    :class:`bipot.forms.Step`.
    """

    certificate: Certificate
    posed: float | None
    passes: int
    iterations: int
    almost: int
    timing: Timing
    coupled: Coupled
    undetermined: tuple[str, ...] = ()

    @property
    def landed(self) -> Ints:
        """The candidates that land in the increment, and not at its start."""
        increment = self.iterate.increment
        return newly_closed(increment.start.gap, self.r, APART * increment.units.length)


@dataclass(frozen=True)
class Trial:
    """One pass as an observer sees it: the form, its input, its answer, and the evaluation of the answer.

    The input is ``iterate``, the forces r (c, d) and ``state``. ``seconds`` is the processor time of the pass, the
    evaluation of its answer included.
    """

    number: int
    form: Form[Any]
    iterate: Iterate
    r: Floats
    state: Any
    step: Step
    examined: Examined
    seconds: float

    @property
    def certificate(self) -> Certificate:
        """All measures, computed when first used."""
        return self.examined.certificate


Observer = Callable[[Trial], None]

Leave = Callable[[Near, float], bool]
"""Decides at an iterate with its error (as in :class:`bipot.forms.Step`) whether to leave the increment unsolved."""


class LeftOff(Exception):
    """An increment was left unsolved, ``near`` a solution, because it is to be solved from another state."""

    def __init__(self, near: Near) -> None:
        super().__init__("left unsolved")
        self.near = near


def unobserved(trial: Trial) -> None:
    """An observer that does nothing."""


def solve_increment(
    increment: Increment,
    form: Form[Any],
    limits: Limits,
    cache: Cache,
    largest: float,
    observe: Observer = unobserved,
    near_to: Near | None = None,
    leave: Leave | None = None,
) -> Solved:
    """Solve the increment.

    ``largest`` is the largest contact force of the run so far, the scale of the cone measure. ``near_to`` is the
    solution of the same increment with slightly different flow carried on: the iteration starts there. ``leave`` is
    called after every pass that is not accepted.

    Raises:
        LeftOff: ``leave`` decided to leave the increment unsolved.
        NotConverged: at the ``limits``, naming the measures above their bounds; at once where no motion can resolve the
            increment (:func:`~bipot.checks.refusals.refuse_blocked`); Refused for an inadmissible motion.
        InvertedElement: at an iterate; FoldedAnswer if an element of the answer is folded anywhere.
        ProgramError: in a pass.
        BrokenSolver: for another error in a form or solver of one's own, or an answer of another kind.
    """
    refuse_blocked(increment, limits.bounds)
    watch, iterations, almost = _Watch(limits), 0, 0
    began = time.perf_counter()
    iterate, r = _first(increment, limits, cache, near_to)
    timing = Timing(assembly=time.perf_counter() - began)
    with _asked(form):
        state = form.init(iterate, r, cache)
    for number in range(1, limits.passes + 1):
        began, given = time.process_time(), (iterate, r, state)
        with _asked(form):
            step, state = form.step(*given)
            iterate, r = (step.iterate, step.r) if type(form) in OWN else _unsaid(increment, step)
        iterations, timing = iterations + step.iterations, timing + step.timing
        almost += step.outcome is Claim.ALMOST
        examined = Examined(iterate, r, largest, limits.bounds)
        try:
            accepted = watch.accepts(examined, step)
        finally:
            observe(Trial(number, form, *given, step, examined, time.process_time() - began))
        if accepted:
            examined, undetermined = _admitted(watch, examined, step)
            return Solved(
                iterate=examined.iterate,
                r=examined.r,
                certificate=examined.certificate,
                posed=step.posed,
                passes=number,
                iterations=iterations,
                almost=almost,
                timing=timing,
                coupled=step.coupled,
                undetermined=undetermined,
            )
        if leave is not None and leave(Near(iterate, r), step.error):
            raise LeftOff(Near(iterate, r))
    raise watch.failure(f"{limits.passes} passes left")


def _asked(form: Form[Any]) -> AbstractContextManager[None]:
    """While a ``form``, which may be a user's own, is asked: its programming errors are no failures of an increment."""
    return nullcontext() if type(form) in OWN else asked(form, "form", InvertedElement)


def _unsaid(increment: Increment, step: Step) -> tuple[Iterate, Floats]:
    """Iterate and contact forces (c, d) of a form that is not the library's own.

    It is not trusted with the body's response, nor with friction that nothing tells, which no measure would see.
    """
    require_type(step, Step, "step")
    require_type(step.iterate, Iterate, "step.iterate")
    iterate, r = increment.at(step.iterate.x), as_numbers(step.r, "step.r")
    told = iterate.rows.told
    require(r.shape == told.shape, "step.r", f"of shape {r.shape}", f"of shape {told.shape}")
    return iterate, np.where(told, r, 0.0)


def _first(increment: Increment, limits: Limits, cache: Cache, near_to: Near | None) -> tuple[Iterate, Floats]:
    """The iterate and the contact forces (c, d) from which the iteration starts."""
    if near_to is None:
        # What no law determines is none, and not what it was while the tool moved.
        forces = np.where(increment.rows.idle, 0.0, cache.pace.forces(increment))
        return begin(increment, cache.pace, limits.bounds), forces
    return increment.at(near_to.response.x), near_to.r


def _admitted(watch: _Watch, accepted: Examined, step: Step) -> tuple[Examined, tuple[str, ...]]:
    """The ``accepted`` answer with the least free rigid motion, and what is not determined, in words.

    Contact forces that are all round-off are none.

    Raises:
        NotConverged, Refused, FoldedAnswer: as of :func:`solve_increment`.
    """
    least, undetermined = least_moved(unloaded(accepted))
    if not np.array_equal(least.iterate.x, accepted.iterate.x) and not watch.accepts(least, step):
        raise watch.failure("the least of the body's free rigid motions leaves")
    least.increment.system.body.refuse_folded(least.response)
    refuse_motion(least.iterate, least.r)
    return least, undetermined


class _Watch:
    """Acceptance and patience over the passes of one increment."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        # The first is for passes out of equilibrium, for which no other measure is computed; the second for the others.
        self.least, self.waited = [np.inf, np.inf], 0
        self.last: dict[str, float] = {}
        self.coupled = Coupled()

    def accepts(self, examined: Examined, step: Step) -> bool:
        """Whether the bounds are met; raises NotConverged when the patience is exhausted."""
        self.coupled = step.coupled
        ratios = examined.ratios()
        balanced = "law" in ratios
        if step.posed is not None:
            ratios = {k: ratios[k] for k in POSED if k in ratios}
            ratios["posed"] = step.posed / self.limits.bounds.cone_violation
        self.last = {k: v for k, v in ratios.items() if not v <= 1}
        worst = max(ratios.values())
        if not self.last:
            return True
        if worst < self.limits.progress * self.least[balanced]:
            self.least[balanced], self.waited = worst, 0
        else:
            self.waited += 1
        # Beside no forces the distance from the law is infinite, as of a contact that closes in the next pass.
        if self.waited >= self.limits.patience or np.isnan(worst):
            raise self.failure("stalled with")
        return False

    def failure(self, what: str) -> NotConverged:
        """The exception that names the measures above their bounds, as multiples of these, and friction's coupling."""
        above = ", ".join(f"{name} {ratio:.2g} times" for name, ratio in self.last.items())
        seen = f", contraction {self.coupled.contraction:.2g}" if self.coupled.contraction > 0 else ""
        return NotConverged(f"{what} {above} its bound (coupling {self.coupled.route.value}{seen})", self.last)


def advance(start: State, solved: Solved) -> State:
    """The state after the increment that was ``solved`` from the accepted state ``start``, with its flow carried on."""
    increment, gap = solved.iterate.increment, solved.iterate.motion[:, 0]
    return increment.system.body.advance(start, solved.response, increment.tau, solved.r, gap)
