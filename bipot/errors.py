"""What can go wrong, as exceptions under one base.

Bad input is refused when an object is made (:class:`SceneError`, by :func:`require`); a convex program that has
no answer says which (:class:`InfeasibleProgram`, :class:`UnboundedProgram`); an increment that cannot be
accepted carries the last good state with it (:class:`IncrementFailed`).
"""

from __future__ import annotations

from typing import Any


class BipotError(Exception):
    """Base of every error this package raises on purpose."""


class SceneError(BipotError, ValueError):
    """Input outside its allowed range; the message names field, value and range."""


class ResultsError(BipotError):
    """A results folder that is missing, unwritable, or holds a run of other parameters."""


class ProgramError(BipotError):
    """A convex program was not solved to the asked accuracy."""


class InfeasibleProgram(ProgramError):
    """No displacement satisfies the program's constraints."""


class UnboundedProgram(ProgramError):
    """The energy has no lower bound: the load is above the limit load. ``ray`` is the collapse mechanism."""

    def __init__(self, message: str, ray: Any = None) -> None:
        super().__init__(message)
        self.ray = ray


class InvertedElement(BipotError):
    """An element's Jacobian determinant is not positive; names the element, the value and the place."""


class NotConverged(BipotError):
    """The passes of one increment did not reach the tolerances; ``residuals`` holds what was reached."""

    def __init__(self, message: str, residuals: Any = None) -> None:
        super().__init__(message)
        self.residuals = residuals


class IncrementFailed(BipotError):
    """The march stopped: ``state`` is the last accepted state, ``history`` what the runner had recorded.

    The message ends with one sentence on what to change.
    """

    def __init__(self, message: str, state: Any = None, history: Any = None) -> None:
        super().__init__(message)
        self.state = state
        self.history = history


def require(condition: bool, field: str, value: object, allowed: str) -> None:
    """Raise :class:`SceneError` naming ``field``, ``value`` and the ``allowed`` range unless ``condition``.

    >>> require(-0.1 >= 0, "mu", -0.1, ">= 0")
    Traceback (most recent call last):
        ...
    bipot.errors.SceneError: mu = -0.1: must be >= 0
    """
    if not condition:
        raise SceneError(f"{field} = {value!r}: must be {allowed}")
