"""A damaged file and what its refusal must name."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Case:
    """``kind`` of the damage, the file, and what a message must name beside the file."""

    kind: str
    path: Path
    field: str = ""


def damaged(
    valid: Path, folder: Path, damages: Mapping[str, Callable[[Path], None]], field: str = ""
) -> Iterator[Case]:
    """Copies of ``valid``, each damaged in one way."""
    for kind, damage in damages.items():
        path = folder / f"{kind}{valid.suffix}"
        shutil.copy(valid, path)
        damage(path)
        yield Case(kind, path, field)
