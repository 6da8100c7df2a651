"""Pictures that studies leave beside their tables, where matplotlib is installed."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from studies.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE = (6.4, 4.2)
"""Inches."""


def drawn(path: Path, draw: Callable[[Figure], None]) -> None:
    """Let ``draw`` fill a figure, and write it; nothing where matplotlib is not installed.

    Raises:
        ResultsError: it cannot be written.
    """
    if find_spec("matplotlib") is None:
        return
    from matplotlib.figure import Figure

    draw(figure := Figure(figsize=SIZE, layout="constrained"))
    with replacing(path) as part:
        figure.savefig(part, dpi=150, format="png")
