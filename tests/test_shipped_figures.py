"""Figures that the repository ships: drawn again from what it ships, in one style of letters, each in the checklist."""

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from paper_figs import (
    fig_corner,
    fig_landings,
    fig_mesh,
    fig_penalty_vs_conic,
    fig_speed_vs_error,
    fig_total_error,
    fig_verification,
)
from paper_figs.stamp import stamp, stamp_of
from studies.tables import read_csv, read_rows
from studies.verification.case import Row

ROOT = Path(__file__).parents[1]
RESULTS, SHIPPED = ROOT / "docs" / "results", ROOT / "docs" / "figures"

OF_RUNS = {"fig2_velocity", "fig_block", "fig_force_stroke"}
"""Those of `make run`, and of `python -m studies.block`."""


def of_table(module):
    return lambda results: {f"fig_{module.NAME}": module.draw(read_csv(results / f"{module.NAME}.csv", ""))}


FIGURES = {
    "fig_corner": fig_corner.figures,
    "fig_landings": of_table(fig_landings),
    "fig_mesh": fig_mesh.figures,
    "fig_penalty_vs_conic": of_table(fig_penalty_vs_conic),
    "fig_speed_vs_error": fig_speed_vs_error.figures,
    "fig_total_error": fig_total_error.figures,
}


@pytest.fixture(scope="module")
def drawn():
    """Every figure of results, from the tables of the repository."""
    return {name: figure for figures in FIGURES.values() for name, figure in figures(RESULTS).items()}


@pytest.mark.slow
def test_every_shipped_figure_is_drawn_from_what_is_shipped(drawn):
    assert {path.stem for path in SHIPPED.glob("*.png")} == {*drawn, *OF_RUNS}


def test_every_shipped_figure_shows_what_the_tables_say(drawn):
    """Of those drawn from tables that are shipped; one was two remakes of its table behind."""
    old = [name for name, figure in drawn.items() if stamp_of(SHIPPED / f"{name}.png") != stamp(figure)]
    assert old == [], "draw them again by their modules of paper_figs, --results docs/results"


def test_every_shipped_figure_of_the_verification_shows_what_the_table_says():
    drawn = dict(fig_verification.figures(read_rows(RESULTS / "verification.csv", Row)))
    folder = SHIPPED / "verification"
    assert {path.stem for path in folder.glob("*.png")} == set(drawn)
    old = [name for name, figure in drawn.items() if stamp_of(folder / f"{name}.png") != stamp(figure)]
    assert old == [], "python -m paper_figs.fig_verification --results docs/results --out docs/figures/verification"


def test_a_stamp_tells_numbers_and_words_apart_and_no_looks():
    def drawing(value=1.0, label="a", size=3.0):
        figure = Figure(figsize=(size, 2.0))
        ax = figure.subplots()
        ax.plot([0.0, 1.0], [0.5, value], label=label)
        ax.scatter([0.0], [value])
        return stamp(figure)

    assert drawing() == drawing(size=5.0) == drawing(1.0 + 1e-9)
    assert len({drawing(), drawing(1.01), drawing(label="b")}) == 3


def test_panels_have_letters_in_one_style_and_in_order(drawn):
    for name, figure in drawn.items():
        titles = [ax.get_title() for ax in figure.axes if ax.get_title()]
        assert [title[:3] for title in titles] == [f"({letter})" for letter in "abcdefgh"[: len(titles)]], name
        assert len(titles) >= 2


def test_every_line_that_is_drawn_looks_like_one_of_the_legend(drawn):
    """By colour; of the grey ones, which are no curves, axes and marks of reductions say what they are."""
    for name, figure in drawn.items():
        legends = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend() is not None)]
        known = {line.get_color() for legend in legends for line in legend.get_lines()}
        curves = {line.get_color() for ax in figure.axes for line in ax.lines if len(line.get_xdata()) > 2}
        assert curves <= known, name


def test_the_checklist_has_a_line_for_every_figure():
    told = (ROOT / "paper_figs" / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\| `(\w+)` \|", told, re.MULTILINE)
    modules = {path.stem for path in (ROOT / "paper_figs").glob("fig*.py")}
    assert sorted(lines) == sorted(modules - {"fig_verification"})
