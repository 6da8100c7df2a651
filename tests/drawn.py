"""Small runs for the figures of the upsetting, and what is written on a figure."""

import matplotlib as mpl
from matplotlib.text import Text

from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, Schedule, march
from bipot.results import Recorder
from bipot.results.columns import COURSE, INCREMENT, SECONDS, Column
from paper_figs import fig1_mesh, fig2_velocity, fig_force_stroke, fig_traction
from paper_figs.common import STYLE
from paper_figs.shown import shown

FIGURES = (fig1_mesh, fig2_velocity, fig_force_stroke, fig_traction)
REDUCTION = 0.25


def record(folder, scene, stop=None, parameters=None, increments=5):
    """A run of an upsetting with the columns that figures read; raises KeyboardInterrupt after increment ``stop``."""
    whole = -scene.tools[0].travel[1] / scene.mesh.nodes[:, 1].max()
    own = (
        Column("reduction", "of the height", lambda _, a: whole * a.state.tau),
        Column("force_N", "on the punch, N", lambda system, a: -a.tool_forces[0, 1]),
    )
    control = Control(Newton(), (Tangent(), Dissipation()))
    with Recorder(folder, scene, (INCREMENT, *own, *COURSE, SECONDS), parameters or {}, {}) as out:
        for accepted in march(scene, Schedule(increments, first=0.005, settling=1, growth=4.0), control):
            if stop is not None and accepted.number > stop:
                raise KeyboardInterrupt
            out.record(accepted)


def drawn(module, results):
    """The figure of a module, as its command line draws it."""
    with mpl.rc_context(STYLE):
        return module.draw(shown(results))


def boxes(figure):
    """Every text that is drawn on the figure, and its box."""
    texts, draw = [], Text.draw

    def collect(text, renderer):
        if text.get_visible() and text.get_text().strip():
            texts.append(text)
        draw(text, renderer)

    Text.draw = collect
    try:
        with mpl.rc_context(STYLE):
            figure.draw_without_rendering()
    finally:
        Text.draw = draw
    return [(text.get_text(), text.get_window_extent()) for text in texts]


def clashes(figure):
    """Texts, and handles of its legend, that the figure cuts off, and pairs of texts of which one covers the other."""
    found = boxes(figure)
    frame, keys = figure.get_window_extent(), [(legend, legend.get_window_extent()) for legend in figure.legends]
    cut = [
        w
        for w, b in [*found, *keys]
        if not (frame.x0 <= b.x0 < b.x1 <= frame.x1 and frame.y0 <= b.y0 < b.y1 <= frame.y1)
    ]
    pairs = [(one, two) for k, (one, a) in enumerate(found) for two, b in found[:k] if a.overlaps(b)]
    return [*cut, *pairs]
