"""The tables of the comparison page, and of increments by accuracy: a head and rows, from the results files alone."""

from __future__ import annotations

import math
from pathlib import Path

from studies import penalty_round_off, penalty_vs_conic, solvers, speed_vs_error
from studies.accuracy import foreign, paced
from studies.speed_jobs import Knob
from studies.tables import Value, read_csv, read_rows

Line = dict[str, Value]
Made = tuple[list[str], list[list[str]]]
"""Head and rows."""

SMALL = 1e-2
"""Below it numbers are shown with an exponent."""
FIELDS = {
    "pressure error": "normal_traction_error",
    "shear error": "tangential_traction_error",
    "penetration [mm]": "penetration_mm",
    "creep [mm]": "stick_creep_mm",
    "relative gap": "relative_gap",
    "condition": "condition",
}
COLUMNS = {"curve error": "curve_error", "algebraic error": "algebraic_error", "passes": "passes", "s": "seconds"}
DIGITS = {"passes": 6, "seconds": 3}


def brief(value: Value, digits: int = 2) -> str:
    """A number in a few digits, a dash for nan."""
    if isinstance(value, str):
        return value
    if math.isnan(value):
        return "–"
    return f"{value:.{max(digits - 1, 0)}e}" if 0 < abs(value) < SMALL else f"{value:.{digits}g}"


def of_optimisers(results: Path) -> Made:
    """Agreement and cost of the optimisers."""
    lines = _read(results, "optimisers", "optimisers")
    names = ("largest_difference", "mean_iterations", "seconds_per_pass", "passes", "almost")
    head = ["optimiser", "largest difference from newton", "mean iterations", "s a pass", "passes", "almost solved"]
    return head, [[str(line["optimiser"]), *(brief(line[n], 3) for n in names)] for line in lines]


def of_solvers(results: Path) -> Made:
    """Objective, residuals and cost of the conic solvers on the same programs."""
    lines = _read(results, solvers.NAME, solvers.NAME)
    head = [
        "form",
        "solver",
        "variables",
        "second-order cones",
        "objective off by",
        "error",
        "iterations",
        "s a program",
    ]
    rows = []
    for line in lines:
        cells = [str(line["form"]), str(line["solver"]), f"{line['variables']:g}", f"{line['cones']:g}"]
        rows.append([*cells, *(brief(line[n], 3) for n in ("objective", "error", "iterations", "seconds"))])
    return head, rows


def of_penalty_errors(results: Path) -> Made:
    """Force error and observed order over K."""
    lines = _penalties(results)
    paths = list(dict.fromkeys((line["mu"], line["reduction"]) for line in lines))
    found = {(line["mu"], line["reduction"], line["K_over_E_h"]): line for line in lines}
    rows = []
    for K in dict.fromkeys(line["K_over_E_h"] for line in lines):
        cells = [found[mu, reduction, K] for mu, reduction in paths]
        rows.append([f"{K:g}", *(f"{brief(c['force_error'])} ({brief(c['order'], 3)})" for c in cells)])
    return ["K h/E", *(f"mu = {mu:g}, {100 * float(r):g} %" for mu, r in paths)], rows


def of_penalty_fields(results: Path) -> Made:
    """What else the penalty leaves, at mu = 0.3 and 20 %."""
    lines = [line for line in _penalties(results) if (line["mu"], line["reduction"]) == (0.3, 0.2)]
    rows = [[f"{line['K_over_E_h']:g}", *(brief(line[name]) for name in FIELDS.values())] for line in lines]
    return ["K h/E", *FIELDS], rows


def of_exact_forms(results: Path) -> Made:
    """Force of Uzawa against the conic run, and passes of both."""
    lines = _read(results, penalty_vs_conic.NAME, penalty_vs_conic.NAME)
    conic = {(line["mu"], line["reduction"]): line for line in lines if line["form"] == "tangent"}
    rows = []
    for line in lines:
        if line["form"] == "uzawa":
            other = conic[line["mu"], line["reduction"]]
            cells = [brief(v, 3) for v in (line["force_error"], line["passes"], other["passes"])]
            rows.append([f"{line['mu']:g}", f"{100 * float(line['reduction']):g} %", *cells, str(other["outcome"])])
    return ["mu", "reduction", "force error of uzawa", "passes", "passes, conic", "conic run"], rows


def of_round_off(results: Path) -> Made:
    """Relative difference in force, or where the run stopped, over penalty and tolerance."""
    lines = _read(results, penalty_round_off.NAME, penalty_round_off.NAME)
    found = {(line["K_over_E_h"], line["tolerance"]): line for line in lines}
    asked = list(dict.fromkeys(line["tolerance"] for line in lines))
    rows = []
    for K in dict.fromkeys(line["K_over_E_h"] for line in lines):
        cells = [found[K, t] for t in asked]
        stopped = [c["outcome"] != "solved" for c in cells]
        shown = ["stops" if s else brief(c["difference"]) for c, s in zip(cells, stopped, strict=True)]
        rows.append([f"{K:g}", *shown])
    return ["K h/E", *(f"to {t:g}" for t in asked)], rows


def of_fastest(results: Path, measure: str) -> Made:
    """The fastest of each family within the limits on one measure."""
    rows = []
    for line in _read(results, "fastest", speed_vs_error.NAME):
        if line["measure"] == measure:
            short = float(line["error"]) > float(line["limit"])
            knob = "" if line["knob"] == Knob.INCREMENTS.value else f", {line['knob']} {line['value']:g}"
            run = f"{line['method']}, {line['increments']:g} increments{knob}"
            needed = f"order {brief(line['order'])}, needs about {brief(line['needed'])} increments"
            note = f"not reached; {'more increments were worse' if math.isnan(float(line['order'])) else needed}"
            cells = [f"{line['mu']:g}", f"{line['limit']:g}", str(line["family"]), run]
            cells += [brief(line["seconds"], 3), brief(line["error"]), brief(line["relative_gap"])]
            rows.append([*cells, note if short else ""])
    return ["mu", "limit", "family", "run", "s", "error", "certificate's relative gap", ""], rows


def of_runs(results: Path) -> Made:
    """Every run on the one mesh: knob, errors, cost."""
    lines = _read(results, speed_vs_error.NAME, speed_vs_error.NAME)
    knobs = [k.value for k in (Knob.INCREMENTS, Knob.PENALTY, Knob.TOLERANCE, Knob.START)]
    mus = list(dict.fromkeys(line["mu"] for line in lines))
    found = {(line["mu"], line["method"], line["knob"], line["value"]): line for line in lines}
    rows = []
    for method, knob, value in dict.fromkeys((r["method"], r["knob"], r["value"]) for r in lines if r["knob"] in knobs):
        cells = [found.get((mu, method, knob, value), {}) for mu in mus]
        shown = [brief(c.get(name, math.nan), DIGITS.get(name, 2)) for c in cells for name in COLUMNS.values()]
        rows.append([str(method), f"{knob} {value:g}", *shown])
    return ["method", "knob", *(f"{name} ({mu:g})" for mu in mus for name in COLUMNS)], rows


def of_meshes(results: Path) -> Made:
    """Force at 20 % over the mesh, with order and limit where there is one."""
    lines = _read(results, "extrapolation", speed_vs_error.NAME)
    kept = [line for line in lines if line["quantity"] == "force_20_N"]
    cells = [
        [f"{r['mu']:g}", str(r["quadrature"]), str(r["values"]), brief(r["order"], 3), brief(r["limit"], 7)]
        for r in kept
    ]
    return ["mu", "quadrature", "elements a side: force [N]", "order", "limit [N]"], cells


def of_scatter(results: Path) -> Made:
    """Force at 45 % for mu = 0.3 over the increments."""
    lines = _read(results, speed_vs_error.NAME, speed_vs_error.NAME)
    kept = [line for line in lines if line["knob"] == Knob.SCATTER.value]
    return ["increments", "F at 45 % [N]"], [[brief(r["value"], 6), brief(r["force_end_N"], 7)] for r in kept]


def of_paced(results: Path) -> Made:
    """Error and cost of increments by accuracy, beside the cheapest equal ones that err no more."""
    names = ("true_error", "increments", "passes", "uniform_error", "uniform_increments", "uniform_passes", "ratio")
    head = ["scene", "accuracy", "error", "increments", "passes", "equal ones: error", "increments", "passes", "ratio"]
    rows = []
    for line in _read(results, paced.NAME, f"accuracy.{paced.NAME}"):
        cells = [brief(line[name], 2 if "error" in name else 3) for name in names]
        rows.append([str(line["scene"]), f"{line['accuracy']:g}", *cells])
    return head, rows


def of_foreign(results: Path, study: foreign.Study) -> Made:
    """Forces of both programs on a punch, and how far ours is from the other; a dash where one does not come.

    The last column has the seconds of both.
    """
    rows = read_rows(results / f"{study.name}.csv", foreign.Row)
    marks = study.whole.marks
    head = ["mu", "a side", *(f"travel of {100 * mark:g} %" for mark in marks), "s"]
    lines, seconds = dict[tuple[float, int], list[str]](), dict[tuple[float, int], str]()
    for row in rows:
        run = row.mu, row.elements
        cells = lines.setdefault(run, [f"{row.mu:g}", str(row.elements)])
        cells.append(f"{row.own_force_N:.0f}, {row.foreign_force_N:.0f} ({100 * row.difference:+.2f} %)")
        seconds[run] = f"{row.own_s:.1f}, {row.foreign_s:.1f}"
    return head, [[*cells, *["–"] * (len(head) - 1 - len(cells)), seconds[run]] for run, cells in lines.items()]


def _penalties(results: Path) -> list[Line]:
    lines = _read(results, penalty_vs_conic.NAME, penalty_vs_conic.NAME)
    return [line for line in lines if line["form"] == "penalty"]


def _read(results: Path, name: str, study: str) -> list[Line]:
    return read_csv(results / f"{name}.csv", f"python -m studies.{study} --out {results}")
