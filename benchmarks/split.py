"""Where the time of a run goes: exclusive seconds of the functions that make up a pass."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from enum import Enum
from typing import Any, TypeVar
from unittest.mock import patch

from bipot import response
from bipot.certification import Examined
from bipot.contact import Candidates
from bipot.forms import conic
from bipot.forms.memory import Memory, Setup
from bipot.forms.newton import Law
from bipot.laws import von_mises
from bipot.programs.data import ContactRows
from bipot.programs.fixed_point import Coupling
from bipot.programs.newton import Pattern

T = TypeVar("T")


class Part(Enum):
    """The parts of a pass; OTHER is what the loops themselves take."""

    KINEMATICS = "kinematics"
    RETURN_MAP = "return map"
    ASSEMBLY = "assembly"
    FACTORISATION = "factorisation"
    CONTACT = "contact"
    PROGRAM = "program"
    COUPLING = "coupling"
    OTHER = "other"


OWNERS: dict[Part, tuple[tuple[Any, str], ...]] = {
    Part.KINEMATICS: ((response, "increment"), (response, "rotate")),
    Part.RETURN_MAP: ((von_mises, "radial_return"),),
    Part.ASSEMBLY: (
        (response.Body, "tangent"),
        (response.Body, "stiffness"),
        (Setup, "data"),
        (response.Body, "respond"),
    ),
    Part.FACTORISATION: ((Pattern, "factorise"), (conic, "condense")),
    Part.CONTACT: ((Candidates, "rows"), (ContactRows, "take"), (Law, "iterate"), (Memory, "begin")),
    Part.COUPLING: ((Examined, "ratios"), (Coupling, "update")),
}


PASS = ("solve", "ratios")


class Stopwatch:
    """Exclusive seconds per part, of nested timed calls; nothing is charged while it is paused (part None).

    ``passes`` are the inclusive seconds of the functions in PASS: all that a pass does. What is left of an increment
    is its start (rows, prediction and its response) and its end (energies, advance).
    """

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(Part, 0.0)
        self.passes = 0.0
        self._part: Part | None = None
        self._since = time.process_time()

    def switch(self, part: Part | None) -> Part | None:
        """Charge the time since the last switch, and start charging ``part``; returns the part before."""
        now, before = time.process_time(), self._part
        if before is not None:
            self.seconds[before] += now - self._since
        self._part, self._since = part, now
        return before

    def reset(self) -> None:
        """Forget what was charged."""
        self.seconds, self.passes = dict.fromkeys(Part, 0.0), 0.0

    def while_running(self, steps: Iterator[T]) -> Iterator[T]:
        """The steps of a generator, charged only while it runs."""
        while True:
            self.switch(Part.OTHER)
            try:
                step = next(steps)
            except StopIteration:
                return
            finally:
                self.switch(None)
            yield step

    def timed(self, part: Part, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """``function``, its time charged to ``part``."""

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            if self._part is None:
                return function(*args, **kwargs)
            before = self.switch(part)
            began = self._since
            try:
                return function(*args, **kwargs)
            finally:
                self.switch(before)
                self.passes += (self._since - began) * (name in PASS)

        return call


@contextmanager
def stopwatch(form: type) -> Iterator[Stopwatch]:
    """Time the parts while the context is open; what ``form.solve`` does besides them is the program."""
    watch = Stopwatch()
    with ExitStack() as stack:
        for part, owners in {**OWNERS, Part.PROGRAM: ((form, "solve"),)}.items():
            for owner, name in owners:
                stack.enter_context(patch.object(owner, name, watch.timed(part, name, getattr(owner, name))))
        yield watch
