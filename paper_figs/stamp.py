"""What a figure shows, in a few letters that its file carries: a file is told from what its tables say now."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import ArrayLike
from PIL import Image

KEY = "Shows"
"""Of the text in a PNG."""

DIGITS = 4
"""Of a number: fewer than libraries of other versions round alike."""


def stamp(figure: Figure) -> str:
    """Digest of the numbers and words in all panels and legends; not of their places and sizes, nor of ticks.

    The same for every version of matplotlib, and before and after the figure is written.
    """
    words = "\n".join(word for ax in figure.axes for word in _panel(ax)) + "\n".join(
        text.get_text() for legend in figure.legends for text in legend.get_texts()
    )
    return hashlib.sha256(words.encode()).hexdigest()[:16]


def stamp_of(path: Path) -> str | None:
    """The digest with which a PNG was written; None where it has none."""
    with Image.open(path) as picture:
        return picture.info.get(KEY)


def _panel(ax: Axes) -> Iterator[str]:
    yield from (ax.get_title(), ax.get_xlabel(), ax.get_ylabel(), ax.get_xscale(), ax.get_yscale())
    for artist in [*ax.lines, *ax.collections, *ax.texts]:
        yield from _artist(artist)


def _artist(artist: Artist) -> Iterator[str]:
    yield type(artist).__name__
    if isinstance(artist, Line2D):
        yield f"{artist.get_label()} {artist.get_color()} {artist.get_linestyle()} {artist.get_marker()}"
        yield from map(_numbers, artist.get_data(orig=True))
    elif isinstance(artist, Text):
        yield artist.get_text()
    elif isinstance(artist, Collection):
        yield from (_numbers(path.vertices) for path in artist.get_paths())
        yield _numbers(np.asarray(artist.get_offsets()))


def _numbers(values: ArrayLike) -> str:
    return " ".join(f"{value:.{DIGITS - 1}e}" for value in np.asarray(values, float).ravel())
