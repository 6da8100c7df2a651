"""What ``docs/robustness.md`` quotes."""

from __future__ import annotations

import re
from itertools import pairwise

from studies.outputs import read_curves
from studies.quoted.filling import Quoted
from studies.quoted.results import Line, Results, digits, percent, power, spread, within, word

EULER, BDF2 = "backward Euler", "BDF2"
REFERENCE = 1440.0
"""Increments of the march that the others of the study of landings are compared with."""

TURNED = "4 nu 0.4999"
WHOLE = "3 one increment of 45 %"
TWICE = "9 redundant rows"


def _accelerated(results: Results, sequence: str) -> str:
    """Increments of the safeguarded march at mu = 10 that needed Anderson's step, as a word."""
    (row,) = results.rows("coupling", case="upsetting mu 10", sequence=sequence, steps="safeguarded")
    routes = re.findall(r"(\w+):(\d+)", str(row["routes"]))
    return word(sum(int(count) for route, count in routes if "anderson" in route))


def _hard(results: Results, case: str, form: str, column: str) -> str:
    return word(results.one("hard_cases", column, case=case, form=form))


def _passes(results: Results, form: str) -> str:
    return digits(results.one("hard_cases", "passes", case=TWICE, form=form), 6)


def _alone(results: Results) -> bool:
    """Newton falls back in none of the cases with shared contacts."""
    cases = ("9 corner of punch and die", TWICE)
    return max(results.column("hard_cases", "fallbacks", case=cases, form="newton")) == 0


def _else_as_it_must(results: Results) -> bool:
    """What did not end as it must are penalty and uzawa where they are said to fail."""
    missed = {(r["case"], r["form"]) for r in results.rows("hard_cases", as_expected="False")}
    both = {(case, form) for case in ("1 welded", "3 one increment of 10 %") for form in ("penalty", "uzawa")}
    return missed == both | {(TURNED, "uzawa")}


def _landed(results: Results, integration: str, located: bool, least: float = 0.0) -> list[Line]:
    rows = results.rows("landings", integration=integration, located=float(located))
    return [row for row in rows if least <= float(row["increments"]) < REFERENCE]


def _scatter(results: Results, integration: str, located: bool, least: float = 0.0) -> str:
    """How F at 45 % ranges, in per cent of its mean."""
    part = spread(float(row["force_45_N"]) for row in _landed(results, integration, located, least))
    return f"{100 * part:.1f}" if part >= 0.01 else percent(part)


def _at(results: Results, integration: str, increments: float, column: str, located: bool = True) -> float:
    found = {"integration": integration, "increments": increments, "located": float(located)}
    return results.one("landings", column, **found)


def _limit(results: Results, column: str) -> float:
    """What the finest march has, landings located."""
    return _at(results, BDF2, 720.0, column)


def _too_early(results: Results) -> str:
    """By how many per cent of the height the second node lands too early with backward Euler, at most."""
    rows = [row for located in (False, True) for row in _landed(results, EULER, located)]
    seconds = [float(row["second_landing"]) for row in rows if float(row["landings"]) > 1]
    return percent(_limit(results, "second_landing") - min(seconds), 1)


def _settled(results: Results) -> bool:
    """Located landings of BDF2 are within 0.02 % of the height of the finest's from 90 increments on."""
    rows = _landed(results, BDF2, True, 90.0)
    names = ("first_landing", "second_landing")
    return all(abs(float(row[name]) - _limit(results, name)) < 2e-4 for row in rows for name in names)


def _stays_clear(results: Results) -> bool:
    rows = [row for located in (False, True) for row in _landed(results, BDF2, located)]
    return {row["landings"] for row in rows} == {1.0}


def _forces(results: Results) -> float:
    """Largest force at 45 % by backward Euler."""
    rows = [row for located in (False, True) for row in _landed(results, EULER, located)]
    return max(float(row["force_45_N"]) for row in rows)


def _costs(results: Results) -> list[float]:
    """What locating costs in passes, over the increments."""
    pairs = zip(_landed(results, BDF2, False), _landed(results, BDF2, True), strict=True)
    return [float(located["passes"]) - float(inside["passes"]) for inside, located in pairs]


def _orders(results: Results) -> list[float]:
    found = results.rows("energy", configuration="midpoint", integration=EULER)
    return [float(row["order"]) for row in found if float(row["increments"]) > 12]


def _ends(results: Results) -> list[float]:
    """What is missing with end-of-step work at mu = 0.1, backward Euler, from few increments to many."""
    return results.column("energy", "end", configuration="midpoint", integration=EULER, mu=0.1)


def _first_order(results: Results) -> bool:
    ends = _ends(results)
    return all(1.8 < coarse / fine < 2.2 for coarse, fine in pairwise(ends))


def _identity(results: Results) -> str:
    return power(within(max(map(abs, results.column("energy", "end", configuration="paper")))))


def _isochoric(results: Results, rule: str, elements: float) -> str:
    return percent(results.one("corner", "isochoric", mu=0.1, quadrature=rule, elements=elements))


def _least_pressure(results: Results, rule: str) -> str:
    """Of the consistent recovery on 20 elements at mu = 0.3, MPa."""
    name = f"mu0.3 {rule} 20"
    found = read_curves(results.folder / "corner.h5", {name})[name]
    return f"{found['consistent_pressure'].min():.0f}"


def _lowered(results: Results, mu: float) -> list[float]:
    """How many times less the line oscillates with two by two points."""
    lines = [results.column("corner", "line", mu=mu, quadrature=rule) for rule in ("radon7", "gauss2")]
    return [seven / four for seven, four in zip(*lines, strict=True)]


def _softer(results: Results) -> list[float]:
    """By what part two by two points lower the force."""
    forces = [results.column("corner", "force_N", quadrature=rule) for rule in ("radon7", "gauss2")]
    return [1 - four / seven for seven, four in zip(*forces, strict=True)]


def _like_seven(results: Results) -> bool:
    lines = [results.column("corner", "line", quadrature=rule) for rule in ("radon7", "gauss3")]
    return all(abs(nine / seven - 1) < 0.05 for seven, nine in zip(*lines, strict=True))


def _grows(results: Results) -> bool:
    """With seven points the corner's oscillation grows with the mesh, and at mu = 0.3 that of the line."""
    series = [("corner", 0.1), ("corner", 0.3), ("line", 0.3)]
    found = [results.column("corner", name, mu=mu, quadrature="radon7") for name, mu in series]
    return all(sorted(values) == values for values in found)


def _stopped(results: Results) -> list[float]:
    """Reductions at which Q8 with two by two points stops at mu = 0.3."""
    rows = results.rows("total", mu=0.3, element="q8", quadrature="gauss2", elements=(10.0, 20.0), program="bipot")
    found = [re.search(r"stopped: increment from tau = ([\d.]+)", str(row["outcome"])) for row in rows]
    return [0.45 * float(match[1]) for match in found if match]


def _all_stop(results: Results) -> bool:
    rows = results.rows("total", mu=0.3, element="q8", quadrature="gauss2", elements=(10.0, 20.0), program="bipot")
    last = {10.0: "element 99 ", 20.0: "element 399 "}
    return all(last[float(row["elements"])] in str(row["outcome"]) for row in rows)


def _fuzzed(results: Results, *errors: str) -> str:
    """How many random scenes ended with these errors of the library; any of them where none is named."""
    refused = [row for row in results.rows("fuzz", outcome="refused") if not str(row["kind"]).startswith("coulomb")]
    return digits(sum(str(row["reason"]).split(":")[0] in errors or not errors for row in refused), 6)


QUOTED = Quoted(
    values={
        "fuzz_refused": _fuzzed,
        "fuzz_scenes": lambda results: _fuzzed(results, "SceneError"),
        "fuzz_limits": lambda results: _fuzzed(results, "LimitPassed"),
        "fuzz_marches": lambda results: _fuzzed(results, "IncrementFailed"),
        "anderson_threshold": lambda results: _accelerated(results, "threshold"),
        "anderson_shift": lambda results: _accelerated(results, "shift"),
        "turned_fallbacks": lambda results: _hard(results, TURNED, "newton", "fallbacks"),
        "turned_increments": lambda results: digits(
            results.one("hard_cases", "increments", case=TURNED, form="newton"), 6
        ),
        "steep_fallbacks": lambda results: _hard(results, "1 mu 10", "newton", "fallbacks"),
        "whole_fallbacks": lambda results: _hard(results, WHOLE, "newton", "fallbacks"),
        "whole_parts": lambda results: _hard(results, WHOLE, "newton", "increments"),
        "whole_cuts": lambda results: _hard(results, WHOLE, "newton", "cuts"),
        "whole_passes": lambda results: digits(results.one("hard_cases", "passes", case=WHOLE, form="newton"), 6),
        "twice_increments": lambda results: digits(
            results.one("hard_cases", "increments", case=TWICE, form="newton"), 6
        ),
        **{
            f"twice_{form}": lambda results, form=form: _passes(results, form)
            for form in ("newton", "tangent", "dissipation")
        },
        "scatter": lambda results: _scatter(results, EULER, False),
        "scatter_located": lambda results: _scatter(results, EULER, True),
        "second_node": lambda results: digits(100 * _limit(results, "second_landing"), 4),
        "too_early": _too_early,
        "highest": lambda results: digits(_forces(results) / 1000, 4),
        "limit": lambda results: f"{_limit(results, 'force_45_N') / 1000:.2f}",
        "first_22": lambda results: f"{100 * _at(results, EULER, 22.0, 'first_landing'):.2f}",
        "first_720": lambda results: f"{100 * _at(results, EULER, 720.0, 'first_landing'):.2f}",
        "second_order": lambda results: _scatter(results, BDF2, False),
        "second_order_located": lambda results: _scatter(results, BDF2, True),
        "from_64": lambda results: _scatter(results, BDF2, False, 64.0),
        "from_64_located": lambda results: _scatter(results, BDF2, True, 64.0),
        "first_node": lambda results: f"{100 * _limit(results, 'first_landing'):.2f}",
        "second_node_again": lambda results: f"{100 * _limit(results, 'second_landing'):.2f}",
        **{
            f"curve_{n:.0f}_{'located' if located else 'inside'}": (
                lambda results, n=n, located=located: power(_at(results, BDF2, n, "curve_error", located), 2)
            )
            for n in (22.0, 90.0)
            for located in (False, True)
        },
        "least_cost": lambda results: digits(min(_costs(results)), 6),
        "largest_cost": lambda results: digits(max(_costs(results)), 6),
        "fewest": lambda results: digits(min(float(r["passes"]) for r in _landed(results, BDF2, False)), 6),
        "most": lambda results: digits(max(float(r["passes"]) for r in _landed(results, BDF2, False)), 6),
        "least_order": lambda results: f"{min(_orders(results)):.2f}",
        "largest_order": lambda results: f"{max(_orders(results)):.2f}",
        "end_few": lambda results: power(_ends(results)[0], 2),
        "end_many": lambda results: power(_ends(results)[-1], 2),
        "identity": _identity,
        **{
            f"kept_{rule}_{n:.0f}": lambda results, rule=rule, n=n: _isochoric(results, rule, n)
            for rule in ("radon7", "gauss2")
            for n in (5.0, 10.0, 20.0)
        },
        "least_seven": lambda results: _least_pressure(results, "radon7"),
        "least_four": lambda results: _least_pressure(results, "gauss2"),
        "lowered_01_least": lambda results: digits(min(_lowered(results, 0.1))),
        "lowered_01_largest": lambda results: digits(max(_lowered(results, 0.1))),
        "lowered_03_least": lambda results: digits(min(_lowered(results, 0.3))),
        "lowered_03_largest": lambda results: digits(max(_lowered(results, 0.3))),
        "softer_least": lambda results: percent(min(_softer(results)), 1),
        "softer_largest": lambda results: percent(max(_softer(results))),
        "stops_first": lambda results: f"{100 * min(_stopped(results)):.1f}",
        "stops_last": lambda results: f"{100 * max(_stopped(results)):.1f}",
    },
    claims={
        "where contacts share a node (9) it stands alone": _alone,
        "Everything else in the table ended as it must": _else_as_it_must,
        "the second node stays clear of the punch before 45 % at every number of increments": _stays_clear,
        "to 0.02 % of the height from 90 increments on": _settled,
        "not systematically lower with located landings": lambda results: (
            _at(results, BDF2, 22.0, "curve_error") < _at(results, BDF2, 22.0, "curve_error", False)
            and _at(results, BDF2, 90.0, "curve_error") > _at(results, BDF2, 90.0, "curve_error", False)
        ),
        "close with first order only": _first_order,
        "oscillates more on finer meshes": _grows,
        "3 x 3 points behave like seven": _like_seven,
        "for all runs of the study of the total error on 10 and 20 elements a side": _all_stop,
    },
)
