"""What ``docs/elements.md`` quotes."""

from __future__ import annotations

import math

from studies.accuracy.limits import TRUSTED, courses_of, told
from studies.accuracy.mesh import name as curves_of
from studies.accuracy.row import Row as MeshRow
from studies.accuracy.smooth import Course, smoothed
from studies.elements import Order, Row, orders
from studies.outputs import read_curves
from studies.quoted.filling import Quoted
from studies.quoted.results import Results, digits, percent, within
from studies.tables import Value, read_rows

END = 0.45
PAPER = {"element": "q8", "layout": "tensor", "sampling": "nodes", "elements": 10.0}
DEFAULT = {"element": "q4p0", "layout": "tensor", "sampling": "nodes", "elements": 20.0}
EASY = ("block 1", "block 2", "block 4", "punch smooth")


def _order(results: Results, element: str, problem: str) -> Order:
    """What the series of an element with its own rule extrapolates to."""
    rows = [r for r in read_rows(results.folder / "elements.csv", Row) if (r.element, r.problem) == (element, problem)]
    return next(order for order in orders(rows) if order.quadrature == rows[0].quadrature)


def _worst(results: Results, elements: tuple[str, ...], problems: tuple[str, ...]) -> float:
    """Largest error of the extrapolated values."""
    return max(abs(_order(results, element, problem).error) for element in elements for problem in problems)


def _agree(results: Results) -> bool:
    """Two elements extrapolate to the same deflection, to four digits."""
    one, other = (_order(results, element, "cook incompressible").extrapolated for element in ("q9p1", "t6"))
    return abs(one / other - 1) < 1e-4


def off(results: Results, mu: float, reduction: float, **mesh: Value | tuple[Value, ...]) -> float:
    """How far the force of a mesh is from its limit, over the limit."""
    limit = results.one("limits", "value", mu=mu, reduction=reduction, quantity="force_N")
    return results.one("mesh", "force_N", mu=mu, reduction=reduction, **mesh) / limit - 1


def _line(results: Results, mu: float, reduction: float, **mesh: Value | tuple[Value, ...]) -> str:
    return f"{results.one('mesh', 'line', mu=mu, reduction=reduction, **mesh):.3f}"


def _mean_square(results: Results, element: str, side: float) -> float:
    """Root of the mean square of the force's distance from its limits in weighted contact."""
    rows = results.rows("mesh", mu=(0.1, 0.3), element=element, sampling="weighted", elements=side)
    limits = [results.one("limits", "value", mu=r["mu"], reduction=r["reduction"], quantity="force_N") for r in rows]
    each = [(float(r["force_N"]) / limit - 1) ** 2 for r, limit in zip(rows, limits, strict=True)]
    return math.sqrt(sum(each) / len(each))


def _above(results: Results) -> bool:
    """One refined mesh of T6 alone has a limit load below the exact one."""
    found = read_rows(results.folder / "elements.csv", Row)
    below = {(row.element, row.problem) for row in found if row.error < 0 and not row.problem.startswith("cook")}
    return below == {("t6", "punch smooth")}


def _falls(results: Results) -> bool:
    series = [[_mean_square(results, name, n) for n in (5.0, 10.0, 20.0)] for name in ("q8", "q8p1", "q9p1")]
    return all(coarse > middle > fine for coarse, middle, fine in series)


def _finest(results: Results, *, smooth: bool) -> list[float]:
    """Distances from the limit at 45 % and mu = 0.3 of the meshes that tell it, of their smooth curves or forces."""
    rows = [row for row in read_rows(results.folder / "mesh.csv", MeshRow) if (row.mu, row.reduction) == (0.3, END)]
    named = {row: curves_of(row) for row in rows if row.of in TRUSTED}
    curves = read_curves(results.folder / "mesh.h5", set(named.values()))
    courses = courses_of(list(named), {row: curves[name] for row, name in named.items()})[0.3]
    kept = told(dict.fromkeys(courses, 0.0))
    limit = results.one("limits", "value", mu=0.3, reduction=END, quantity="force_N")
    return [abs(_at_end(courses[mesh], smooth=smooth) / limit - 1) for mesh in kept]


def _at_end(course: Course, *, smooth: bool) -> float:
    return smoothed(course, "force_N", END) if smooth else float(course["force_N"][-1])


def _fanned(results: Results, column: str) -> list[float]:
    """Of the runs by fanned meshes of the two projected quadratic elements that come to the end."""
    found = {"element": ("q8p1", "q9p1"), "layout": "fanned", "sampling": "nodes", "mu": (0.1, 0.3), "reduction": END}
    return results.column("mesh", column, **found)


def _lacking(results: Results) -> bool:
    """All fanned meshes come to the end but the coarsest and the finest of q9p1 at mu = 0.1, and none was cut."""
    found = {"layout": "fanned", "sampling": "nodes", "mu": (0.1, 0.3), "reduction": (0.1, END)}
    rows = results.rows("mesh", element=("q8p1", "q9p1"), **found)
    runs = [{(r["mu"], r["element"], r["elements"]) for r in rows if r["reduction"] == at} for at in (0.1, END)]
    return runs[0] - runs[1] == {(0.1, "q9p1", 5.0), (0.1, "q9p1", 40.0)} and max(_fanned(results, "cuts")) == 0


def _edges(results: Results, edges: int, column: str) -> list[float]:
    """Of the runs with so many edges between nodes a side by the elements that do not lock, mu = 0.3."""
    linear = results.column("scatter", column, mu=0.3, element="q4p0", sampling="nodes", elements=float(edges))
    quadratic = {"element": ("q8p1", "q9p1"), "sampling": "nodes", "elements": edges / 2}
    return linear + results.column("scatter", column, mu=0.3, **quadratic)


def _halves(results: Results) -> bool:
    coarse, fine = (sum(_edges(results, edges, "scatter")) for edges in (40, 80))
    return 0.4 < fine / coarse < 0.6


def _a_fifth(results: Results) -> bool:
    return all(0.19 < n / edges < 0.22 for edges in (40, 80) for n in _edges(results, edges, "landings"))


def _needed(results: Results) -> str:
    """Edges that would jump by half a per cent, in proportion to 80 of them."""
    return digits(80 * max(_edges(results, 80, "scatter")) / 0.005, 1)


CUBE = "block_pressure"


def _cube(results: Results, column: str, layout: str, mu: float = 0.3) -> list[float]:
    """Of the runs of the cube in a layout, where known."""
    return [value for value in results.column(CUBE, column, layout=layout, mu=mu) if math.isfinite(value)]


def _arrive(results: Results) -> bool:
    """No fanned mesh folds; in the other layout one does."""
    fanned = min(min(_cube(results, "reached", "fanned", mu)) for mu in (0.1, 0.3))
    return fanned > 0.2999 > min(_cube(results, "reached", "tensor"))


def _peaks(results: Results) -> bool:
    """The largest ``edge`` would make more of ``line`` than was found."""
    rows = [row for row in results.rows(CUBE, layout="fanned", mu=0.3) if float(row["elements"]) > 4]
    made = [0.29 * (float(row["largest_edge"]) - 1) / math.sqrt(float(row["elements"]) - 3) for row in rows]
    return all(float(row["largest_line"]) < peak for row, peak in zip(rows, made, strict=True))


def _low(results: Results) -> bool:
    """At mu = 0.1 in the tensor layout, and wherever the last ``edge`` is far below the largest: a node has landed."""
    rows = results.rows(CUBE, layout="fanned", mu=0.3)
    landed = [float(row["line"]) for row in rows if float(row["edge"]) < 0.6 * float(row["largest_edge"])]
    return len(landed) == 3 and max(*landed, *_cube(results, "largest_line", "tensor", 0.1)) < 0.06


def _falls_with_the_cube(results: Results) -> bool:
    """The largest ``line`` of ``fanned`` meshes from 4 elements a side on, and from 8 on."""
    steep, flat = (_cube(results, "largest_line", "fanned", mu) for mu in (0.3, 0.1))
    edges = _cube(results, "largest_edge", "fanned", 0.1)
    return sorted(steep, reverse=True) == steep and abs(flat[2] / flat[1] - 1) < 0.02 and sorted(edges) == edges


def _alike(results: Results) -> bool:
    """At mu = 0.1 ``inner`` is small in both layouts, ``edge`` and ``line`` are higher fanned."""
    one, other = ([_cube(results, name, layout, 0.1) for name in ("inner", "edge", "line")] for layout in LAYOUTS)
    higher = all(
        b > a for own, theirs in zip(one[1:], other[1:], strict=True) for a, b in zip(own, theirs, strict=True)
    )
    return higher and max(*one[0], *other[0]) < 0.02


LAYOUTS = "tensor", "fanned"

WEIGHTED = PAPER | {"sampling": "weighted"}
FANNED = DEFAULT | {"layout": "fanned"}

QUOTED = Quoted(
    values={
        "near": lambda results: percent(within(_worst(results, ("q4p0", "q9p1", "t6"), EASY))),
        "rough_q4p0": lambda results: percent(within(_worst(results, ("q4p0",), ("punch rough",)))),
        "rough_others": lambda results: percent(within(_worst(results, ("q9p1", "t6"), ("punch rough",)))),
        "rough_q8p1_order": lambda results: digits(_order(results, "q8p1", "punch rough").order),
        "rough_q8p1": lambda results: percent(-_order(results, "q8p1", "punch rough").error),
        "conic": lambda results: digits(max(_fanned(results, "fallbacks")), 3),
        "of_increments": lambda results: digits(max(_fanned(results, "increments")), 3),
        "smooth_off": lambda results: percent(within(max(_finest(results, smooth=True)))),
        "least_off": lambda results: percent(min(_finest(results, smooth=False)), 1),
        "largest_off": lambda results: percent(max(_finest(results, smooth=False)), 1),
        "paper_01": lambda results: percent(off(results, 0.1, END, **PAPER)),
        "paper_03": lambda results: percent(-off(results, 0.3, END, **PAPER)),
        "paper_line_01": lambda results: digits(results.one("mesh", "line", mu=0.1, reduction=END, **PAPER)),
        "paper_line_03": lambda results: digits(results.one("mesh", "line", mu=0.3, reduction=END, **PAPER)),
        "default_01": lambda results: percent(within(max(abs(off(results, 0.1, at, **DEFAULT)) for at in (0.2, END)))),
        "default_03_20": lambda results: percent(within(off(results, 0.3, 0.2, **DEFAULT), 2)),
        "default_03_45": lambda results: percent(within(off(results, 0.3, END, **DEFAULT), 1)),
        **{
            f"{name}_line_{10 * mu:02.0f}_{100 * at:.0f}": (
                lambda results, mesh=mesh, mu=mu, at=at: _line(results, mu, at, **mesh)
            )
            for name, mesh in (("default", DEFAULT), ("fanned", FANNED))
            for mu in (0.1, 0.3)
            for at in (0.2, END)
        },
        "jump_40_least": lambda results: percent(min(_edges(results, 40, "scatter"))),
        "jump_40_largest": lambda results: percent(max(_edges(results, 40, "scatter"))),
        "jump_80_least": lambda results: percent(min(_edges(results, 80, "scatter"))),
        "jump_80_largest": lambda results: percent(max(_edges(results, 80, "scatter"))),
        "landed_40": lambda results: digits(max(_edges(results, 40, "landings")), 3),
        "landed_80": lambda results: digits(max(_edges(results, 80, "landings")), 3),
        "needed_edges": _needed,
        "weighted_line": lambda results: _line(results, 0.1, 0.2, **WEIGHTED),
        "nodes_line": lambda results: _line(results, 0.1, 0.2, **PAPER),
        "weighted_20": lambda results: percent(off(results, 0.1, 0.2, **WEIGHTED), 1),
        "nodes_20": lambda results: percent(off(results, 0.1, 0.2, **PAPER)),
        "weighted_40": lambda results: percent(within(off(results, 0.1, 0.4, **WEIGHTED), 1)),
        "nodes_40": lambda results: percent(off(results, 0.1, 0.4, **PAPER), 1),
        "block_fold": lambda results: digits(100 * min(_cube(results, "reached", "tensor")), 3),
        **{
            f"inner_{layout}": lambda results, layout=layout: digits(max(_cube(results, "largest_inner", layout)))
            for layout in LAYOUTS
        },
        "written": lambda results: digits(max(results.column(CUBE, "largest_written"))),
        **{
            f"mean_square_{name}": lambda results, name=name: percent(_mean_square(results, name, 20.0))
            for name in ("q8", "q8p1", "q9p1")
        },
    },
    claims={
        "and all its meshes in the table reach the end": _arrive,
        "would give a larger *line* than was found, with 8, 12 and 16 a side alike": _peaks,
        "*line* is below 0.06 where the peak is low, at mu = 0.1 in the `tensor` layout or after a landing": _low,
        "falls with the mesh, at mu = 0.1, where the peak grows with it, hardly": _falls_with_the_cube,
        "the two layouts have about the same *inner*": _alike,
        "there is no published number, but `q9p1` and `t6` extrapolate to the same four digits": _agree,
        "all meshes but the coarsest and the finest of `q9p1` at mu = 0.1, in `newton` form without a cut": _lacking,
        "all its contact pressures are positive": lambda results: (
            min(results.column("mesh", "p_min_MPa", mu=(0.1, 0.3), **DEFAULT)) > 0
        ),
        "larger than the exact one but that of `t6` under the smooth punch": _above,
        "The jump halves with the mesh": _halves,
        "moves by a fifth of what was the side": _a_fifth,
        "falls with every refinement in weighted means too": _falls,
    },
)
