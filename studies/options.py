"""Numbers of command lines, refused by what is wrong with them: functions for ``type`` of argparse."""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Callable

MOST_PROCESSES = 61 if sys.platform == "win32" else max(64, os.cpu_count() or 1)
"""More would only wait for each other; Windows knows no more than 61."""

MOST_VALUES = 10_000
"""Of one option."""


def count(least: int, most: int | None = None) -> Callable[[str], int]:
    """Reads a whole number from ``least`` on, up to ``most``.

    >>> count(1)("0")
    Traceback (most recent call last):
        ...
    argparse.ArgumentTypeError: 0: must be >= 1
    """
    allowed = f">= {least}" if most is None else f"from {least} to {most}"

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{_short(text)}: must be a whole number") from None
        if number < least or (most is not None and number > most):
            raise argparse.ArgumentTypeError(f"{_short(text)}: must be {allowed}")
        return number

    return read


def processes(least: int) -> Callable[[str], int]:
    """Reads how many processes, from ``least`` on."""
    return count(least, MOST_PROCESSES)


def positive(text: str) -> float:
    """Reads a finite number above zero.

    >>> positive("1e-3")
    0.001
    """
    number = _number(text)
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"{_short(text)}: must be a finite number > 0")
    return number


def coefficient(text: str) -> float:
    """Reads a Coulomb coefficient: zero or above; inf welds.

    >>> coefficient("inf")
    inf
    """
    number = _number(text)
    if not number >= 0:
        raise argparse.ArgumentTypeError(f"{_short(text)}: must be a number >= 0, or inf")
    return number


def coefficients(text: str) -> list[float]:
    """Reads one Coulomb coefficient, or ``FROM:TO:NUMBER`` of them, evenly from the first to the last.

    >>> coefficients("0:0.6:4")
    [0.0, 0.2, 0.4, 0.6]
    """
    parts = text.split(":")
    if len(parts) == 1:
        return [coefficient(text)]
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"{_short(text)}: must be a number, or FROM:TO:NUMBER")
    first, last, number = coefficient(parts[0]), coefficient(parts[1]), count(2, MOST_VALUES)(parts[2])
    if not first < last < math.inf:
        raise argparse.ArgumentTypeError(f"{_short(text)}: must go from one finite number up to a larger one")
    # As one writes them: a step is seldom a binary number.
    return [float(f"{first + (last - first) * k / (number - 1):.12g}") for k in range(number)]


def _number(text: str) -> float:
    """NaN where the text is no number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _short(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:30]}... ({len(text)} characters)"
