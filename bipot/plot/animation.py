"""Animation of a run."""

from __future__ import annotations

import io
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from bipot.basics.replacing import replace
from bipot.errors import ResultsError, require, require_count, require_number, require_path
from bipot.plot.contours import contour, frame, nodal_values, require_plane
from bipot.results import History
from bipot.results.history import TAU

GIF = ".gif"
SIZE, DPI = (6.0, 4.5), 100
"""Size in inches, and dots per inch."""

SLOWEST, FASTEST = 0.01, 100.0
"""Frames per second: a GIF counts hundredths of a second, in 16 bits."""


def animate(result: History, field: str, path: str | Path, *, frames: int = 40, rate: float = 8.0) -> Path:
    """Write a ``field`` of a run step by step, as :func:`bipot.plot.contour` draws it, into a GIF; returns its path.

    There are at most so many ``frames``, spread over the steps from the first to the last, ``rate`` of them per second.
    Colours and axes are the same in all.

    Raises:
        SceneError: no run that was opened, a body in space, no path or one that does not end in .gif, an unknown field,
            a number of frames below one, a rate outside [:data:`SLOWEST`, :data:`FASTEST`].
        ResultsError: the file cannot be written, or pillow is not installed (matplotlib brings it).
    """
    require_plane(result)
    require_path(path)
    path = Path(path)
    require(path.suffix.lower() == GIF, "path", str(path), f"one that ends in {GIF}")
    require_count(frames, "frames")
    require_number(rate, "rate")
    require(SLOWEST <= rate <= FASTEST, "rate", rate, f"in [{SLOWEST:g}, {FASTEST:g}] frames per second")
    if find_spec("PIL") is None:
        raise ResultsError(f"{path}: an animation needs pillow: pip install bipot[studies]")
    # The last step first: a single frame shows that.
    chosen = np.linspace(len(result.times) - 1, 0, min(frames, len(result.times))).round().astype(int)[::-1]
    replace(path, _gif(result, field, result.times[chosen].tolist(), rate), ResultsError)
    return path


def _gif(result: History, field: str, taus: list[float], rate: float) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    shown = [result.at(tau, by=TAU) for tau in taus]
    values = [nodal_values(snapshot, field) for snapshot in shown]
    limits = float(np.min(values)), float(np.max(values))
    corners = np.array([(nodes.min(axis=0), nodes.max(axis=0)) for nodes in (snapshot.nodes for snapshot in shown)])
    images = []
    for tau in taus:
        # Figures outside of pyplot, whose figures are the user's.
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        canvas, axes = FigureCanvasAgg(figure), figure.add_subplot()
        contour(result, field, tau, axes, by=TAU, limits=limits)
        frame(axes, result, corners.reshape(-1, 2))
        canvas.draw()
        images.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    memory = io.BytesIO()
    images[0].save(memory, "GIF", save_all=True, append_images=images[1:], duration=1000 / rate, loop=0)
    return memory.getvalue()
