"""The study of the element types: counts, known limit loads on coarse meshes, and its tables."""

import math

import numpy as np
import pytest

from bipot import Quadrature, upsetting
from studies import elements
from studies.element_limits import unknowns_per_constraint
from studies.element_scenes import PROBLEMS, Choice
from studies.element_types import ElementType
from studies.elements import Order, Row, extrapolated, measure, orders
from studies.tables import read_rows

BY_NAME = {problem.name: problem for problem in PROBLEMS}
LIMITS = [problem for problem in PROBLEMS if not problem.name.startswith("cook")]
PROJECTED = (ElementType.Q8P1, ElementType.Q4P0, ElementType.Q9P1, ElementType.T6)


def chosen(name):
    return Choice(ElementType(name), ElementType(name).quadrature)


def solved(problem, name, n):
    asked = BY_NAME[problem]
    return asked.value(asked.uniform(chosen(name), n)) / asked.exact - 1


@pytest.mark.parametrize(
    ("name", "rule", "count"),
    [
        ("q8", Quadrature.RADON7, 6 / 7),
        ("q8", Quadrature.GAUSS2, 3 / 2),
        ("q8p1", Quadrature.RADON7, 2.0),
        ("q8p1", Quadrature.GAUSS2, 2.0),
        ("q4p0", Quadrature.GAUSS2, 2.0),
        ("q9p1", Quadrature.GAUSS3, 8 / 3),
        ("t6", Quadrature.TRIANGLE3, 4.0),
        ("t3", Quadrature.TRIANGLE1, 1.0),
    ],
)
def test_unknowns_per_constraint_are_those_of_the_literature(name, rule, count):
    kind = ElementType(name)
    scene = upsetting(mu=0.1, elements=3, element=kind.element, quadrature=rule, volume=kind.volume)
    assert unknowns_per_constraint(scene) == pytest.approx(count, rel=1e-12)


ERRORS = {
    "block 1": {"q8p1": 0.038, "q4p0": 0.056, "q9p1": 0.021, "t6": 0.019},
    "block 2": {"q8p1": 0.046, "q4p0": 0.080, "q9p1": 0.032, "t6": 0.020},
    "block 4": {"q8p1": 0.037, "q4p0": 0.073, "q9p1": 0.030, "t6": 0.017},
    "punch smooth": {"q8p1": 0.039, "q4p0": 0.079, "q9p1": 0.028, "t6": 0.016},
    "punch rough": {"q8p1": 0.066, "q4p0": 0.106, "q9p1": 0.038, "t6": 0.036},
    "notch": {"q8p1": 0.020, "q4p0": 0.055, "q9p1": 0.018, "t6": 0.007},
}
"""What n = 4 is off by, rounded up: relative to the exact limit load, which no element is below."""


@pytest.mark.parametrize("problem", LIMITS, ids=lambda problem: problem.name)
@pytest.mark.parametrize("kind", PROJECTED, ids=lambda kind: kind.value)
def test_limit_loads_come_from_above_and_are_near(problem, kind):
    error, allowed = solved(problem.name, kind.value, 4), ERRORS[problem.name][kind.value]
    assert 0 < error < allowed


@pytest.mark.parametrize("problem", LIMITS, ids=lambda problem: problem.name)
def test_the_constant_strain_of_t3_is_a_bound(problem):
    """Its motions keep the volume everywhere, so that the coarsest meshes are above, too."""
    errors = [solved(problem.name, "t3", n) for n in (1, 2, 4)]
    assert min(errors) == errors[2] > 0


def test_the_mean_volume_of_t6_is_none():
    assert -0.01 < solved("notch", "t6", 2) < -0.005


@pytest.mark.parametrize(("problem", "allowed"), [("block 2", 1e-3), ("block 4", 1e-3), ("punch smooth", 1e-3)])
def test_a_series_extrapolates_to_the_exact_limit_load(problem, allowed):
    order, limit = extrapolated([solved(problem, "q9p1", n) for n in (2, 4, 8)])
    assert order == pytest.approx(1.0, abs=0.1)
    assert abs(limit) < allowed


def test_the_paper_element_is_farther_off_than_its_projection_and_plain_quadrilaterals_lock():
    assert solved("block 2", "q8", 4) > 1.8 * solved("block 2", "q8p1", 4)
    assert solved("block 2", "q4", 4) == math.inf


@pytest.mark.parametrize(
    ("name", "compressible", "incompressible"),
    [("q9p1", 1e-3, 0.007), ("q8p1", 0.009, 0.05), ("q4p0", 0.16, 0.15), ("t6", 0.03, 0.04)],
)
def test_cooks_membrane_is_that_of_the_literature_and_does_not_lock(name, compressible, incompressible):
    assert abs(solved("cook compressible", name, 4)) < compressible
    membrane = BY_NAME["cook incompressible"]
    # 18.51 is where Q9/P1 and T6/P0 tend to (docs/elements.md).
    assert membrane.value(membrane.uniform(chosen(name), 4)) == pytest.approx(18.51, rel=incompressible)


def test_cooks_membrane_of_four_node_quadrilaterals_as_they_are_locks():
    membrane = BY_NAME["cook incompressible"]
    assert membrane.value(membrane.uniform(chosen("q4"), 4)) < 0.5 * 18.51


def test_extrapolation_finds_order_and_limit_and_says_where_there_are_none():
    assert extrapolated([3 + 0.25**k for k in range(3)]) == pytest.approx((2.0, 3.0))
    for values in ([1.0, 2.0, 1.0], [1.0, 2.0, 4.0], [math.inf, math.inf, 2.0], [1.0, math.nan, 2.0]):
        assert np.isnan(extrapolated(values)).all()
    assert extrapolated([math.inf] * 3)[1] == math.inf


def row(n, error):
    return Row("block 1", "q4p0", "gauss2", n, 1, 1, 1 + error, 1.0, error, 0.0)


def test_the_order_of_a_series_leaves_the_refined_mesh_out_but_not_from_its_side():
    (found,) = orders([row(0, -0.01), row(4, 0.4), row(1, 1.6), row(2, 0.8)])
    assert (found.n, found.order, found.side) == (1, pytest.approx(1.0), "above and below")
    assert found.error == pytest.approx(0.0, abs=1e-12)
    assert orders([row(1, 1.6), row(2, 0.8)]) == []


@pytest.mark.slow
def test_the_refined_mesh_has_at_most_2000_elements_and_is_finer_where_it_matters():
    for problem in LIMITS:
        if problem.refined is not None:
            scene = problem.refined(chosen("q4p0"))
            assert len(scene.mesh.elements) <= 2000
    found = measure(BY_NAME["punch rough"], chosen("q4p0"), 0)
    assert 0 < found.error < 0.015


def test_the_study_writes_and_goes_on_with_its_tables(tmp_path, monkeypatch):
    monkeypatch.setattr(elements, "PROBLEMS", (BY_NAME["block 1"], BY_NAME["cook compressible"]))
    monkeypatch.setattr(elements, "CHOICES", (chosen("q4p0"), chosen("q4")))
    line = ["--fast", "--out", str(tmp_path)]
    assert elements.main(line) == 0
    rows = read_rows(tmp_path / "elements.csv", Row)
    assert [(r.problem, r.element, r.n) for r in rows[:6]] == [
        ("block 1", e, n) for e in ("q4p0", "q4") for n in (2, 4, 8)
    ]
    assert len(rows) == 12
    assert [order.side for order in read_rows(tmp_path / "orders.csv", Order)] == ["above", "none", "below", "below"]
    before = (tmp_path / "elements.csv").read_text()
    assert elements.main(line) == 2
    assert elements.main([*line, "--resume"]) == 0
    assert (tmp_path / "elements.csv").read_text() == before
