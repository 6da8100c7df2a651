"""Hardening curves by one word each, as a command line gives them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import signature

from bipot.errors import require
from bipot.laws.hardening import Hardening, Linear, Perfect, Swift, Tabulated, Voce

CURVES: dict[str, Callable[..., Hardening]] = {
    "perfect": Perfect,
    "linear": Linear,
    "voce": Voce,
    "swift": Swift,
    "table": Tabulated,
    "csv": Tabulated.from_csv,
}
"""What a command line calls the curves. Their numbers follow in the order of their fields; a table's are pairs, and
those of a file are on its lines.
"""

WORDS: Mapping[str, str] = {"table": "peeq/stress,...", "csv": "FILE"}
"""What follows the name of a curve that does not take its numbers one by one."""


def _numbers(text: str, separator: str) -> list[float]:
    try:
        return [float(word) for word in text.split(separator)]
    except ValueError:
        require(False, "hardening", text, f"numbers separated by '{separator}'")
        raise


def _fields(make: Callable[..., Hardening]) -> tuple[list[str], int]:
    """Names of a curve's numbers, and how many of them must be given."""
    given = signature(make).parameters.values()
    return [field.name for field in given], sum(field.default is field.empty for field in given)


def hardening_from_text(text: str) -> Hardening:
    """Read a hardening curve from one word, as a command line gives it; raises SceneError if it cannot.

    >>> hardening_from_text("linear:300,1000")
    Linear(sigma_y=300.0, modulus=1000.0)
    """
    name, _, rest = text.partition(":")
    require(name in CURVES, "hardening", name, "one of " + ", ".join(sorted(CURVES)))
    make = CURVES[name]
    if make == Tabulated.from_csv:
        require(rest != "", "hardening", text, f"csv:{WORDS['csv']}, of two columns: plastic strain and yield stress")
        return make(rest)
    if make is Tabulated:
        pairs = [_numbers(pair, "/") for pair in rest.split(",")]
        require(all(len(pair) == 2 for pair in pairs), "hardening", rest, "pairs peeq/stress separated by ','")
        return Tabulated(*zip(*pairs, strict=True))
    numbers, (names, least) = _numbers(rest, ","), _fields(make)
    counts = range(least, len(names) + 1)
    allowed = " or ".join(str(count) for count in counts) + " numbers separated by ','"
    require(len(numbers) in counts, "hardening", rest, allowed)
    return make(*numbers)


def hardening_usage() -> str:
    """What :func:`hardening_from_text` reads, for a command line's help.

    >>> hardening_usage().split("; ")[2]
    'voce:sigma_y,saturation,rate[,modulus]'
    """
    words = list[str]()
    for name, make in CURVES.items():
        names, least = _fields(make)
        rest = "".join(f"[,{field}]" for field in names[least:])
        words.append(f"{name}:" + WORDS.get(name, ",".join(names[:least]) + rest))
    return "; ".join(words)
