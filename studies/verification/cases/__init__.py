"""The cases, one a file that holds it as ``CASE``: a new file is a new case."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from studies.verification.case import Case, Subject


def all_cases() -> tuple[Case, ...]:
    """Every case, by subject and name."""
    found: list[Case] = [import_module(f"{__name__}.{module.name}").CASE for module in iter_modules(__path__)]
    order = list(Subject)
    return tuple(sorted(found, key=lambda case: (order.index(case.subject), case.name)))
