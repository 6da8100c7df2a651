"""Exceptions of the package, under one base, and the checks that raise them.

Bad input is refused when an object is made or a function called (:class:`SceneError`, by :func:`require`): what is of a
wrong type or shape always is, which docstrings do not repeat. A convex program without a solution says whether it is
infeasible or unbounded (:class:`InfeasibleProgram`, :class:`UnboundedProgram`). An increment that cannot be accepted
carries the last accepted state (:class:`IncrementFailed`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

LARGEST_STRESS, LARGEST_LENGTH = 1e60, 1e40
"""Largest value in any units, and inverse of the smallest: (E size^2)^2 then neither overflows nor vanishes."""


LARGEST_COUNT = 2**63 - 1
"""The largest length of an array, by its index type."""

MANY = "a number of many digits"

NO_NUMBERS = (bool, np.timedelta64)
"""Types that call themselves integers: NumPy derives its durations from them."""

LONGEST = 300
"""Letters of a value in a message: a scene given for something else would fill the screen with its arrays."""


class BipotError(Exception):
    """Base of every error this package raises on purpose."""


Refusal = Callable[[str], BipotError]
"""Makes the error of a message."""


class SceneError(BipotError, ValueError):
    """Input outside its allowed range; the message names field, value and range."""


class ResultsError(BipotError):
    """A results folder that is missing, unwritable, or holds a run of other parameters."""


class ProgramError(BipotError):
    """A convex program was not solved to the requested accuracy."""


class StalledProgram(ProgramError):
    """A solver stopped short of the accuracy because it came no nearer, and not at a limit of time or iterations."""


class UnsuitedForm(ProgramError):
    """A form cannot treat such contacts; another form can."""


class InfeasibleProgram(ProgramError):
    """No displacement satisfies the program's constraints."""


class UnboundedProgram(ProgramError):
    """A program's energy has no lower bound: along the ``ray`` a mechanism gains more than it dissipates.

    This happens where the load is above the limit load, but also because of friction that a pass has frozen, or of a
    linearised tangent. Only :class:`LimitPassed` is a proof.
    """

    def __init__(self, message: str, ray: Any = None) -> None:
        super().__init__(message)
        self.ray = ray


class BrokenSolver(BipotError):
    """A solver raised an error that tells nothing of its program, or gave no answer at all; the cause is that error."""


class InvertedElement(BipotError):
    """An element's Jacobian determinant is not positive; names the element, the value and the place."""


class FoldedAnswer(InvertedElement):
    """An element is folded by what solves an increment, not by an iterate on the way there."""


class NotConverged(BipotError):
    """The passes of one increment did not reach the tolerances; ``residuals`` holds the measures above their bounds.

    Where it is known better than to take more increments, ``advice`` is a sentence on what to change.
    """

    def __init__(self, message: str, residuals: Any = None, advice: str = "") -> None:
        super().__init__(message)
        self.residuals, self.advice = residuals, advice


class Refused(NotConverged):
    """An increment is inadmissible although its equations are solved; ``advice`` is a sentence on what to change.

    One that goes ``too_far`` may do so because its load is not carried.
    """

    def __init__(self, message: str, advice: str = "", *, too_far: bool = False) -> None:
        super().__init__(message, advice=advice)
        self.too_far = too_far


class IncrementFailed(BipotError):
    """The march stopped: ``state`` is the last accepted state, ``history`` that of a recorder.

    The message ends with one sentence on what to change.
    """

    def __init__(self, message: str, state: Any = None) -> None:
        super().__init__(message)
        self.state = state
        self.history: Any = None


class LimitPassed(IncrementFailed, UnboundedProgram):
    """The march stopped because the body cannot carry the load in its present shape.

    ``ray`` (a, d) is the mechanism, scaled such that the load gains one, and ``translation`` (m,) that of force-driven
    tools. At most ``fraction`` of the load at pseudo-time ``tau`` is carried (:mod:`bipot.programs.limit`).
    """

    def __init__(
        self,
        message: str,
        state: Any = None,
        *,
        ray: Any = None,
        translation: Any = None,
        fraction: float = math.nan,
        tau: float = math.nan,
    ) -> None:
        super().__init__(message, state)
        self.ray, self.translation, self.fraction, self.tau = ray, translation, fraction, tau


def require(condition: bool, field: str, value: object, allowed: str) -> None:
    """Raise :class:`SceneError` naming ``field``, ``value`` and the ``allowed`` range unless ``condition``.

    >>> require(-0.1 >= 0, "mu", -0.1, ">= 0")
    Traceback (most recent call last):
        ...
    bipot.errors.SceneError: mu = -0.1: must be >= 0
    """
    if not condition:
        raise SceneError(f"{field} = {_short(repr(value))}: must be {allowed}")


def require_type(value: object, kind: type, field: str, *, optional: bool = False) -> None:
    """Raise :class:`SceneError` unless ``value`` is a ``kind`` (an instance, not the class itself).

    A string is not accepted as a member of an enumeration: it would be unequal to every member and so select another
    model silently. The message names the member to use. ``optional`` allows None.

    >>> require_type("300", float, "sigma_y")
    Traceback (most recent call last):
        ...
    bipot.errors.SceneError: sigma_y = '300': must be a float
    """
    if (optional and value is None) or (isinstance(value, kind) and not isinstance(value, type)):
        return
    article = "an" if kind.__name__[0] in "AEIO" else "a"
    allowed = f"{article} {kind.__name__}"
    if issubclass(kind, Enum):
        meant = [member for member in kind if str(value).lower() in (str(member.value).lower(), member.name.lower())]
        allowed += f", e.g. {kind.__name__}.{next(iter(meant or kind)).name}"
    allowed += " or None" if optional else ""
    if getattr(kind, "_is_protocol", False) and not isinstance(value, type):
        lacking = [name for name in vars(kind) if not name.startswith("_") and not hasattr(value, name)]
        allowed += f"; it has no {', '.join(lacking)}"
    require(False, field, value, allowed)


def require_number(value: object, field: str) -> None:
    """Raise :class:`SceneError` unless ``value`` is a real number that a float can hold; True and False are none."""
    require(isinstance(value, Real) and not isinstance(value, NO_NUMBERS), field, value, "a number")
    try:
        float(value)  # type: ignore[arg-type]
    except OverflowError:
        require(False, field, MANY, "one that a float can hold")


def require_positive(**values: Any) -> None:
    """Raise :class:`SceneError` unless the fields' values are numbers, finite and above zero."""
    for field, value in values.items():
        require_number(value, field)
        require(0 < value < float("inf"), field, value, "finite and > 0")


def require_magnitude(value: float, field: str, largest: float) -> None:
    """Raise :class:`SceneError` unless |``value``| is zero or from 1/``largest`` to ``largest``.

    Beyond this range squares of forces and products with volumes overflow or underflow. An overflow is noticed, but an
    underflow makes a residual zero, or a stress that never yields.
    """
    allowed = f"of a magnitude from {1 / largest:g} to {largest:g}: choose other units"
    require(value == 0 or 1 / largest <= abs(value) <= largest, field, value, allowed)


def is_whole(value: object) -> TypeGuard[Integral]:
    """Whether ``value`` is of an integer type, truth values and durations apart."""
    return isinstance(value, Integral) and not isinstance(value, NO_NUMBERS)


def require_count(value: object, field: str, least: int = 1, most: int = LARGEST_COUNT) -> None:
    """Raise :class:`SceneError` unless ``value`` is a whole number, an integer type, from ``least`` to ``most``.

    >>> require_count(2.5, "increments")
    Traceback (most recent call last):
        ...
    bipot.errors.SceneError: increments = 2.5: must be a whole number
    """
    require(is_whole(value), field, value, "a whole number")
    number = int(value)  # type: ignore[call-overload]
    require(number >= least, field, _shown(number), f">= {least}")
    require(number <= most, field, _shown(number), f"<= {most}")


def require_path(value: object) -> None:
    """Raise :class:`SceneError` unless ``value`` is the path of a file or folder."""
    require(isinstance(value, str | Path), "path", value, "a path")


def require_tuple(value: object, kind: type, field: str) -> tuple[Any, ...]:
    """``value`` as a tuple of ``kind``; raises :class:`SceneError` unless it is a tuple or list of them."""
    require(isinstance(value, tuple | list), field, value, f"a tuple of {kind.__name__}")
    items = tuple(value)  # type: ignore[call-overload]
    for k, item in enumerate(items):
        require_type(item, kind, f"{field}[{k}]")
    return items


def _short(text: str) -> str:
    """A value's text, or the beginning of a long one, on one line."""
    return text if len(text) <= LONGEST else " ".join(text[:LONGEST].split()) + " ..."


def _shown(number: int) -> object:
    """A value for a message; Python does not print whole numbers of thousands of digits."""
    return number if abs(number) <= LARGEST_COUNT else MANY
