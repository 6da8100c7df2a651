"""Tables of docs/robustness.md, from results alone: coupling, landings, energy, corner, faults."""

from __future__ import annotations

from pathlib import Path

from studies.coupling import NAME as COUPLING
from studies.tables import Value, read_csv

Line = dict[str, Value]
Table = tuple[list[str], list[list[str]]]

INCREMENTS = (22, 90, 720)
"""Of the marches in the table of landings."""


def of_coupling(results: Path) -> Table:
    """Head and rows: contraction, cuts and passes of either sequence of programs, plain and safeguarded."""
    found = {(r["case"], r["sequence"], r["steps"]): r for r in _read(results, COUPLING)}
    head = ["case"]
    for sequence in ("threshold", "shift"):
        head += [f"{sequence}: contraction", "plain: cuts, passes", "safeguarded: cuts, passes"]
    rows = []
    for case in dict.fromkeys(name for name, _, _ in found):
        cells = [str(case)]
        for sequence in ("threshold", "shift"):
            plain, safe = (found[case, sequence, steps] for steps in ("plain", "safeguarded"))
            cells += [f"{plain['contraction']:.2g}, {safe['contraction']:.2g}", _ended(plain), _ended(safe)]
        rows.append(cells)
    return head, rows


def _ended(row: Line) -> str:
    told = f"{row['cuts']:.0f}, {row['passes']:.0f}"
    return told if row["outcome"] == "certified" else f"{told}, {row['outcome']}"


def of_landings(results: Path) -> Table:
    """Head and rows: forces and landings over the increments, both integrations, landings inside or located."""
    head = ["plastic flow", "landings", "increments", *(f"F at {k} % [N]" for k in (20, 44, 45))]
    head += ["curve to 45 %, L2", "landings before 45 %", "second landing at"]
    rows = []
    for r in _read(results, "landings"):
        if r["increments"] in INCREMENTS:
            cells = [str(r["integration"]), "located" if r["located"] else "inside", f"{r['increments']:.0f}"]
            cells += [f"{r[f'force_{k}_N']:.0f}" for k in (20, 44, 45)]
            where = f"{100 * float(r['second_landing']):.2f} %"
            cells += [f"{r['curve_error']:.1e}", f"{r['landings']:.0f}", where if r["located"] else f"by {where}"]
            rows.append(cells)
    return head, rows


def of_energy(results: Path) -> Table:
    """Head and rows: how the trapezoidal balance closes with BDF2 over the increments, and with what orders."""
    lines = [r for r in _read(results, "energy") if (r["configuration"], r["integration"]) == ("midpoint", "BDF2")]
    counts = list(dict.fromkeys(r["increments"] for r in lines))
    rows = []
    for mu in dict.fromkeys(r["mu"] for r in lines):
        own = {r["increments"]: r for r in lines if r["mu"] == mu}
        orders = ", ".join(f"{own[n]['order']:.2f}" for n in counts[1:])
        rows.append([f"mu = {mu:g}", *(f"{own[n]['trapezoidal']:.1e}" for n in counts), orders])
    return ["5 to 20 %, `midpoint`, BDF2", *(f"{n:.0f} increments" for n in counts), "observed orders"], rows


def of_faults(results: Path) -> Table:
    """Head and rows: a line a kind of fault."""
    lines = _read(results, "faults")
    counts = [name for name in lines[0] if name != "fault"]
    rows = [[str(line["fault"]), *(f"{line[name]:.0f}" for name in counts)] for line in lines]
    return ["fault", *counts], rows


def of_corner(results: Path) -> Table:
    """Head and rows: force and oscillation at 20 % by friction, quadrature and mesh."""
    lines = _read(results, "corner")
    sides = list(dict.fromkeys(r["elements"] for r in lines))
    found = {(r["mu"], r["quadrature"], r["elements"]): r for r in lines}
    names = ("line", "corner", "inside", "corner_inside")
    rows = []
    for mu, rule in dict.fromkeys((mu, rule) for mu, rule, _ in found):
        runs = [found[mu, rule, n] for n in sides]
        cells = [f"{mu:g}", f"`{rule}`", ", ".join(f"{r['force_N']:.0f}" for r in runs)]
        rows.append([*cells, *(", ".join(f"{r[name]:.2f}" for r in runs) for name in names)])
    said = ", ".join(f"{n:.0f}" for n in sides)
    return ["mu", "points", f"F at 20 % [N], {said} elements", "line", "corner", "inside", "corner element"], rows


def _read(results: Path, name: str) -> list[Line]:
    return read_csv(results / f"{name}.csv", f"python -m studies.{name} --out {results}")
