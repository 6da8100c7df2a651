"""The course of a march between two increments: all that its continuation depends on, so it can be resumed later."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np

from bipot.energy import Energies
from bipot.errors import require, require_count, require_number, require_tuple, require_type
from bipot.forms.memory import Paced
from bipot.increment import Solved, advance
from bipot.state import State
from bipot.typing import Bools, EqualByNumbers, as_array, make_floats, max_abs, read_only

SHORTEST = 1e-20
"""Length in pseudo-time far below round-off, so that rates are finite."""


@dataclass(frozen=True, eq=False, repr=False)
class Course(EqualByNumbers):
    """The current state of a march, and everything else that it carries from increment to increment.

    ``number`` counts the increments accepted so far, ``energies`` are theirs, ``largest`` is the largest contact force
    among them. The others serve increment control: between two scheduled pseudo-times ``size`` is the length of the
    next increment, and halvings are counted from the length ``uncut``; both are NaN at a scheduled pseudo-time, where
    control begins anew. ``proposed`` is the length of the next increment chosen by an accuracy, NaN without one and
    after a way through the air (:mod:`bipot.control.pacing`). ``landed`` (c,) marks the candidates at whose landing an
    increment was cut since the last scheduled pseudo-time. ``before`` are the two increments before the last one as the
    predictor sees them, the later first, NaN where unknown.

    All fields are values: floats, whole numbers and read-only arrays whose shapes the scene fixes.

    Raises:
        SceneError: a wrong type, a negative count, an energy that is not finite, a ``largest`` below a force of the
            state, one of ``size`` and ``uncut`` without the other, or beyond the end of the path.
    """

    state: State
    number: int
    energies: Energies
    largest: float
    size: float
    uncut: float
    landed: Bools
    before: tuple[Paced, Paced]
    proposed: float = math.nan

    def __post_init__(self) -> None:
        require_type(self.state, State, "course.state")
        require_count(self.number, "course.number", 0)
        require_type(self.energies, Energies, "course.energies")
        for part in fields(self.energies):
            _require_finite(getattr(self.energies, part.name), f"course.energies.{part.name}")
        _require_finite(self.largest, "course.largest")
        present = max_abs(self.state.forces)
        allowed = f"at least {present:g}, the largest contact force of course.state"
        require(not self.largest < present, "course.largest", self.largest, allowed)
        for name in ("size", "uncut", "proposed"):
            make_floats(self, name, of="course.")
            value, field = getattr(self, name), f"course.{name}"
            require(math.isnan(value) or SHORTEST <= value <= 1, field, value, f"NaN, or from {SHORTEST:g} to 1")
        both = math.isnan(self.size) == math.isnan(self.uncut)
        require(both, "course.uncut", self.uncut, f"NaN if course.size is, which is {self.size:g}, and only then")
        marked = as_array(self.landed, "course.landed")
        require(marked.dtype.kind == "b", "course.landed", f"of type {marked.dtype}", "booleans")
        object.__setattr__(self, "landed", read_only(marked, np.bool_))
        before = require_tuple(self.before, Paced, "course.before")
        require(len(before) == 2, "course.before", before, "two")
        object.__setattr__(self, "before", before)

    def __repr__(self) -> str:
        """One line, without the arrays."""
        return f"Course(increment {self.number}, {self.state!r})"

    @staticmethod
    def of(state: State) -> Course:
        """The course of a march that begins at ``state``."""
        require_type(state, State, "state")
        return Course(
            state=state,
            number=0,
            energies=Energies(),
            largest=max_abs(state.forces),
            size=math.nan,
            uncut=math.nan,
            landed=np.zeros(len(state.gap), dtype=np.bool_),
            before=(Paced.unknown(state), Paced.unknown(state)),
        )

    def after(self, solved: Solved, proposed: float = math.nan) -> Course:
        """The course at a scheduled pseudo-time after the increment ``solved``, with the ``proposed`` next length."""
        start, state, quicker = self.state, advance(self.state, solved), solved.iterate.increment.past.quicker
        later, _ = self.before
        return replace(
            self.scheduled(),
            state=state,
            number=self.number + 1,
            energies=self.energies.after(start, state, solved),
            largest=max(self.largest, max_abs(state.forces)),
            before=(later.next(start).at_pace(quicker, start.tau), later.at_pace(quicker, start.tau)),
            proposed=proposed,
        )

    def scheduled(self) -> Course:
        """The same course with increment control begun anew, as at a scheduled pseudo-time."""
        return replace(self, size=math.nan, uncut=math.nan, landed=np.zeros_like(self.landed))


def _require_finite(value: object, field: str) -> None:
    require_number(value, field)
    require(math.isfinite(value), field, value, "finite")  # type: ignore[arg-type]
