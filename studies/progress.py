"""Progress of a study on a terminal and nowhere else: the library itself never prints."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from typing import Any


class Progress:
    """Receives the progress of a run: started once with a title, advanced to fractions of its path, closed. Silent."""

    def start(self, title: str) -> None:
        """A run of this title begins at 0."""

    def advance(self, fraction: float, note: str = "") -> None:
        """The run has reached ``fraction`` in [0, 1] of its path."""

    def close(self) -> None:
        """The run is over, at its end or not."""


@dataclass
class Bar(Progress):
    """A tqdm bar in per cent on stderr."""

    _bar: Any = field(default=None, init=False, repr=False)

    def start(self, title: str) -> None:
        """Show an empty bar."""
        shape = "{desc} {percentage:3.0f} %|{bar}| {elapsed}<{remaining} {postfix}"
        self._bar = import_module("tqdm").tqdm(total=1.0, desc=title, bar_format=shape, file=sys.stderr)

    def advance(self, fraction: float, note: str = "") -> None:
        """Fill it up to ``fraction``, with ``note`` behind it."""
        self._bar.set_postfix_str(note, refresh=False)
        self._bar.update(fraction - self._bar.n)

    def close(self) -> None:
        """Leave it as it is."""
        self._bar.close()


def terminal() -> Progress:
    """A bar when stderr is a terminal and tqdm is installed, else silence."""
    return Bar() if sys.stderr is not None and sys.stderr.isatty() and find_spec("tqdm") else Progress()
