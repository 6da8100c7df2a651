"""The run that a folder holds already, and whether another is to be gone on with, refused or replaced."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from bipot.errors import ResultsError
from bipot.results.description import Parameters, as_json, describe, same_mesh, same_state
from bipot.results.folder import CSV, RUN, TOOLS, run_file
from bipot.results.history import History
from bipot.results.history import open as open_results
from bipot.scene.scene import Scene
from bipot.state import State

OVERWRITE = "overwrite it (Existing.OVERWRITE or --overwrite)"
ABSENT, CHOICE = "absent", f"choose another folder, or {OVERWRITE}"


class Existing(Enum):
    """What to do with an existing run in the folder: leave it and raise ResultsError, go on with it, or begin anew."""

    REFUSE = "refuse"
    RESUME = "resume"
    OVERWRITE = "overwrite"


@dataclass(frozen=True)
class Asked:
    """What identifies a run that is to be written, and must be the same in one that is gone on with.

    Its ``start`` is None where none is given: a run of any start is gone on with then.
    """

    scene: Scene
    parameters: Parameters
    units: Mapping[str, str]
    columns: tuple[str, ...]
    start: State | None

    def require_same(self, found: History, folder: Path) -> None:
        """Refuse a run ``found`` of another scene or start, other parameters, units or columns."""
        for what, stored, asked in (
            ("", found.parameters, self.parameters),
            ("units: ", found.units, self.units),
            ("scene: ", found.scene, describe(self.scene)),
            ("", {"columns": list(found.columns)}, {"columns": list(self.columns)}),
        ):
            other = _difference("", stored, asked)
            if other is not None:
                name, old, new = other
                raise ResultsError(f"{folder}: holds a run with {what}{name} = {old}, not {new}; {CHOICE}")
        if not same_mesh(found.mesh, self.scene.mesh):
            raise ResultsError(f"{folder}: holds a run on another mesh; {CHOICE}")
        if self.start is not None and not same_state(found.start.state, self.start):
            raise ResultsError(f"{folder}: holds a run that began at another state than start; {CHOICE}")


def _difference(name: str, old: Any, new: Any) -> tuple[str, Any, Any] | None:
    """The first part in which two JSON values differ, with its name below ``name``; None where they are the same."""
    if as_json(old) == as_json(new):
        return None
    parts: list[tuple[str, Any, Any]] = []
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        keys = sorted(old.keys() | new.keys())
        parts = [(f"{name}.{key}" if name else key, old.get(key, ABSENT), new.get(key, ABSENT)) for key in keys]
    elif isinstance(old, list | tuple) and isinstance(new, list | tuple) and len(old) == len(new):
        parts = [(f"{name}[{k}]", *pair) for k, pair in enumerate(zip(old, new, strict=True))]
    return next((found for part in parts if (found := _difference(*part)) is not None), (name, old, new))


def known(folder: Path, existing: Existing, asked: Asked) -> History | None:
    """The run to go on with; None if a new one is to begin.

    Raises:
        ResultsError: the folder holds what is no run, or another than is ``asked``, or a run that ``existing`` refuses.
    """
    if existing is Existing.OVERWRITE:
        return None
    file = run_file(folder)
    if not file.is_file():
        if file.exists():
            raise ResultsError(f"{file}: is no file; {CHOICE}")
        for beside in (CSV, TOOLS):
            if (folder / beside).exists():
                raise ResultsError(f"{folder}: holds {beside} without {RUN}; {CHOICE}")
        return None
    found = open_results(file)
    asked.require_same(found, folder)
    if existing is Existing.REFUSE:
        state = "a complete run" if found.complete else f"a run of {len(found)} increments, not complete"
        raise ResultsError(f"{folder}: holds {state}: resume it (Existing.RESUME or --resume), or {OVERWRITE}")
    return found
