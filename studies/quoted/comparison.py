"""What ``docs/comparison.md`` quotes."""

from __future__ import annotations

from itertools import pairwise
from math import log

from studies.accuracy.clad import known
from studies.quoted.filling import Quoted
from studies.quoted.results import Line, Results, digits, percent, power


def _above_the_line(results: Results) -> str:
    """Force error at K h/E = 100 over what it is at 10^4 by order one, mu = 0.3 to 20 %."""
    here, later = (
        results.one("penalty_vs_conic", "force_error", mu=0.3, reduction=0.2, form="penalty", K_over_E_h=K)
        for K in (100.0, 1e4)
    )
    return digits(here / (later * 1e4 / 100))


def _penalties(results: Results, column: str, least: float, mu: float, reduction: float) -> list[float]:
    """A column over K h/E from ``least`` to 1e5, a decade apart."""
    found = {"mu": mu, "reduction": reduction, "form": "penalty"}
    return results.column("penalty_vs_conic", column, **found, K_over_E_h=_decades(least, 1e5))


def _decades(least: float, largest: float) -> tuple[float, ...]:
    return tuple(K for K in (10.0**n for n in range(-3, 9)) if least <= K <= largest)


def _of_order_one(results: Results) -> bool:
    """Force errors from K h/E = 10 on, but at mu = 0.3, whose tractions switch and whose increments are cut."""
    paths = [(mu, reduction) for mu in (0.1, 0.6) for reduction in (0.2, 0.45)]
    return all(0.9 < order < 1.1 for path in paths for order in _penalties(results, "order", 10.0, *path))


def _on_it_later(results: Results) -> bool:
    """At mu = 0.3, 20 %, from K h/E = 1000 on: errors times K are as at 1e4."""
    errors = _penalties(results, "force_error", 1000.0, 0.3, 0.2)
    return all(abs(errors[k] * 10.0 ** (k - 1) / errors[1] - 1) < 0.05 for k in range(len(errors)))


def _stays(results: Results) -> bool:
    """The force error at mu = 0.3, 45 %, from K h/E = 10 on."""
    found = {"mu": 0.3, "reduction": 0.45, "form": "penalty"}
    errors = results.column("penalty_vs_conic", "force_error", **found, K_over_E_h=_decades(10.0, 1e8))
    return len(errors) == 8 and 1e-4 < min(errors) and max(errors) < 4e-4


def _in_proportion(results: Results, column: str, exponent: int) -> bool:
    """From K h/E = 1000 on a column at mu = 0.3, 20 % goes with this power of K, to a tenth."""
    values = _penalties(results, column, 1000.0, 0.3, 0.2)
    return all(abs(b / a / 10.0**exponent - 1) < 0.1 for a, b in pairwise(values))


def _flat(results: Results) -> bool:
    """By less than a factor of three."""
    found = {"mu": 0.3, "reduction": 0.2, "form": "penalty"}
    values = results.column("penalty_vs_conic", "condition", **found, K_over_E_h=_decades(0.001, 100.0))
    return max(values) < 3 * min(values)


def _two_against_one(results: Results) -> bool:
    """Errors over the increments at mu = 0.1, 10 to 40: by BDF2 and by backward Euler."""
    found = {"mu": 0.1, "knob": "increments", "value": (10.0, 20.0, 40.0)}
    orders = [
        log(errors[0] / errors[-1], 4)
        for method in ("newton", "newton, backward Euler")
        for errors in [results.column("speed_vs_error", "curve_error", method=method, **found)]
    ]
    return abs(orders[0] - 2) < 0.4 and abs(orders[1] - 1) < 0.3


def _paper(results: Results, mu: float) -> list[Line]:
    """Runs of the paper's scheme over the increments, the coarsest first."""
    rows = results.rows("speed_vs_error", mu=mu, method="paper as written", knob="increments")
    return sorted(rows, key=lambda row: float(row["increments"]))


def _enough(results: Results, mu: float) -> str:
    """Least increments measured of the paper's scheme with a curve error of 1e-3."""
    return digits(min(float(row["increments"]) for row in _paper(results, mu) if float(row["curve_error"]) <= 1e-3), 6)


def _nearest(results: Results, mu: float) -> Line:
    """Run of the paper's scheme whose curve is nearest."""
    return min(_paper(results, mu), key=lambda row: float(row["curve_error"]))


def _of_penalty(results: Results, column: str) -> list[float]:
    """What the penalty takes over what the tangent form takes on the same increments."""
    found = []
    for row in results.rows("speed_vs_error", method="tangent", knob="increments"):
        same = {"mu": row["mu"], "knob": "increments", "value": row["value"]}
        found += [
            value / float(row[column]) for value in results.column("speed_vs_error", column, method="penalty", **same)
        ]
    return found


def _turns_round(results: Results) -> bool:
    """The paper's error is above 1e-5 and grows again with more increments, for both mu."""
    near = [(_paper(results, mu)[-1], _nearest(results, mu)) for mu in (0.1, 0.3)]
    return all(float(best["curve_error"]) > 1e-5 and best is not last for last, best in near)


def _slower(results: Results) -> bool:
    """At each measured count of increments seconds grow from newton over tangent to dissipation."""
    found = []
    for row in results.rows("speed_vs_error", method="newton", knob="increments"):
        for slower, faster in (("tangent", "newton"), ("dissipation", "tangent")):
            same = {"mu": row["mu"], "knob": "increments", "value": row["value"]}
            times = [
                [float(r["seconds"]) for r in results.rows("speed_vs_error", **same) if r["method"] == method]
                for method in (slower, faster)
            ]
            found += [a > b for a, b in zip(*times, strict=False)]
    return bool(found) and all(found)


def _unaffected(results: Results) -> bool:
    """Where several tolerances come to the end, their forces agree to 1e-9 of each other."""
    found = [row for row in results.rows("penalty_round_off", outcome="solved") if float(row["K_over_E_h"]) > 1e4]
    forces = [[float(r["force_N"]) for r in found if r["K_over_E_h"] == K] for K in {r["K_over_E_h"] for r in found}]
    return bool(forces) and all(max(one) - min(one) <= 1e-9 * max(one) for one in forces)


def _ratios(results: Results, mu: float) -> list[float]:
    return results.column("total_ratio", "ratio", mu=mu)


def _foreign_first(results: Results) -> list[float]:
    """Errors within which the whole process of CalculiX is clearly the faster one, mu = 0.1."""
    rows = results.rows("total_ratio", mu=0.1)
    return [float(row["error"]) for row in rows if float(row["process_ratio"]) < 0.9]


def _foreign_leads_coarse(results: Results) -> bool:
    first = min(_foreign_first(results))
    return all(
        (float(r["error"]) >= first) == (float(r["process_ratio"]) < 0.9) for r in results.rows("total_ratio", mu=0.1)
    )


def same_mesh(results: Results, least: int, seconds: str = "seconds") -> list[float]:
    """How often faster ``bipot`` is on the mesh of Q8 with 2 x 2 points of ``least`` and more a side, mu = 0.1.

    By the run without the start of Python, or by the whole process: the column ``seconds``.
    """
    solved = {"mu": 0.1, "outcome": "solved"}
    own = results.rows("total", program="bipot", element="q8", quadrature="gauss2", **solved)
    foreign = results.rows("total", program="CalculiX", element="CAX8R", **solved)
    sides = {float(r["elements"]) for r in own} & {float(r["elements"]) for r in foreign}
    times = [
        [min(float(r[seconds]) for r in rows if r["elements"] == side) for rows in (foreign, own)]
        for side in sorted(sides)
        if side >= least
    ]
    return [other / ours for other, ours in times]


WHOLE = "process_seconds"


def _best(results: Results, program: str) -> Line:
    """The run of least error at mu = 0.3."""
    rows = results.rows("total", mu=0.3, program=program, outcome="solved")
    return min(rows, key=lambda row: float(row["force_error"]))


def _fine(results: Results, schedule: str, column: str) -> float:
    """40 x 40 Q4/P0 at mu = 0.1."""
    fine = {"element": "q4p0", "layout": "tensor", "elements": 40.0, "schedule": schedule}
    return results.one("total", column, mu=0.1, program="bipot", **fine)


def _by_friction(results: Results) -> float:
    """How far the force on the domed punch at mu = 0.3 is above that without friction, finest mesh, end of travel."""
    found = {"elements": 10.0, "travel": 0.4}
    smooth, rough = (results.one("domed", "own_force_N", mu=mu, **found) for mu in (0.0, 0.3))
    return rough / smooth - 1


def _off_known(results: Results, column: str) -> float:
    """Largest relative error of the force on a body of two metals without friction, for which it is known."""
    rows = results.rows("clad", mu=0.0)
    return max(abs(float(row[column]) / known(float(row["travel"])) - 1) for row in rows)


def _times_die(results: Results) -> list[float]:
    """How many times CalculiX's seconds are ours, of marches with a deformable die on the finer mesh."""
    return [float(row["foreign_s"]) / float(row["own_s"]) for row in results.rows("die", elements=10.0)]


QUOTED = Quoted(
    values={
        "above_the_line": _above_the_line,
        "enough_03": lambda results: _enough(results, 0.3),
        "enough_01": lambda results: _enough(results, 0.1),
        "nearest_01": lambda results: digits(float(_nearest(results, 0.1)["increments"]), 6),
        "nearest_03": lambda results: digits(float(_nearest(results, 0.3)["increments"]), 6),
        "off_01": lambda results: power(float(_nearest(results, 0.1)["curve_error"])),
        "off_03": lambda results: power(float(_nearest(results, 0.3)["curve_error"])),
        **{
            f"penalty_{column}_{name}": lambda results, column=column, end=end: digits(
                end(_of_penalty(results, column))
            )
            for column in ("passes", "seconds")
            for name, end in (("least", min), ("largest", max))
        },
        "least_ratio": lambda results: digits(min(_ratios(results, 0.1))),
        "largest_ratio": lambda results: digits(max(_ratios(results, 0.1))),
        "foreign_first": lambda results: percent(min(_foreign_first(results))),
        "same_mesh_least": lambda results: digits(min(same_mesh(results, 10))),
        "same_mesh_largest": lambda results: digits(max(same_mesh(results, 10))),
        "same_process_least": lambda results: digits(min(same_mesh(results, 10, WHOLE))),
        "same_process_largest": lambda results: digits(max(same_mesh(results, 10, WHOLE))),
        "ratio_03": lambda results: digits(max(_ratios(results, 0.3))),
        "best_03": lambda results: percent(float(_best(results, "bipot")["force_error"]), 1),
        "best_03_s": lambda results: digits(float(_best(results, "bipot")["seconds"])),
        "fine_40": lambda results: percent(_fine(results, "40 increments", "force_error"), 1),
        "fine_40_increments": lambda results: digits(_fine(results, "40 increments", "increments"), 4),
        "fine_accuracy": lambda results: percent(_fine(results, "accuracy 0.001", "force_error"), 1),
        "domed": lambda results: percent(max(map(abs, results.column("domed", "difference"))), 1),
        "clad": lambda results: percent(max(map(abs, results.column("clad", "difference"))), 1),
        "die_least": lambda results: digits(min(_times_die(results))),
        "die_largest": lambda results: digits(max(_times_die(results))),
        "die": lambda results: percent(max(map(abs, results.column("die", "difference"))), 1),
        "block_die": lambda results: percent(max(map(abs, results.column("block_die", "difference"))), 1),
        "clad_own": lambda results: percent(_off_known(results, "own_force_N"), 1),
        "clad_foreign": lambda results: percent(_off_known(results, "foreign_force_N"), 1),
        "domed_friction": lambda results: percent(_by_friction(results)),
        "fine_accuracy_increments": lambda results: digits(_fine(results, "accuracy 0.001", "increments"), 4),
    },
    claims={
        "At mu = 0.1 and 0.6, once K h/E is 10 or so, the force error falls with order 1 in 1/K": _of_order_one,
        "and on it from 1000 on": _on_it_later,
        "stays between 1e-4 and 4e-4 from K h/E = 10 on": _stays,
        "number changes by less than a factor of three up to K h/E = 100": _flat,
        "then grows in proportion to K": lambda results: _in_proportion(results, "condition", 1),
        "creeps by its force over K_t, in proportion to 1/K": lambda results: _in_proportion(
            results, "stick_creep_mm", -1
        ),
        "shows a relative gap in proportion to 1/K": lambda results: _in_proportion(results, "relative_gap", -1),
        "order two against order one": _two_against_one,
        "grows again, so it tends to another curve": _turns_round,
        "Newton is faster than the conic `tangent` form, and the `dissipation` form is slower than both": _slower,
        "the force does not follow the tolerance": _unaffected,
        "a factor of 40 is not reached": lambda results: max(_ratios(results, 0.1) + _ratios(results, 0.3)) < 40,
        "and slower or level below": _foreign_leads_coarse,
        "On the same mesh of 10 and of 20 elements a side": lambda results: len(same_mesh(results, 10)) == 2,
        "At mu = 0.3 the only one of these errors that CalculiX reaches is 5 %": lambda results: (
            [row["error"] for row in results.rows("total_ratio", mu=0.3)] == [0.05]
            and float(_best(results, "CalculiX")["force_error"]) > 0.02
        ),
        "is not reached by CalculiX": lambda results: (
            float(_best(results, "bipot")["force_error"]) < float(_best(results, "CalculiX")["force_error"])
        ),
        "increments, below the band": lambda results: (
            _fine(results, "40 increments", "force_error") < _fine(results, "40 increments", "band")
        ),
    },
)
