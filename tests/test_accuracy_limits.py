"""What the mesh study makes of its courses: the smooth curve, limits with their bands, jumps; answers are known."""

import math
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from bipot.meshes.layout import Layout
from studies.accuracy.limits import TRUSTED, Level, bracketed, extrapolated, limit, told
from studies.accuracy.mesh import MARKS
from studies.accuracy.row import Discretisation, Row
from studies.accuracy.scatter import jumps, scatters
from studies.accuracy.smooth import EXPONENTS, smoothed
from studies.element_types import ElementType

AT = np.append([0.001, 0.002, 0.004, 0.008], np.linspace(0.01, 0.45, 89))
FORCE = "force_N"


def course(logarithm, quantity=FORCE, at=AT):
    """A quantity of known logarithm over what it is without friction."""
    return {"at": at, quantity: 7.0 * np.exp(logarithm(at)) / (1 - at) ** EXPONENTS[quantity]}


def exact(logarithm, reduction, quantity=FORCE):
    return 7.0 * np.exp(logarithm(reduction)) / (1 - reduction) ** EXPONENTS[quantity]


@pytest.mark.parametrize("quantity", EXPONENTS)
def test_a_smooth_course_is_its_own_curve(quantity):
    def bent(x):
        return 0.03 - 0.12 * x + 0.6 * x**2

    for mark in MARKS:
        assert smoothed(course(bent, quantity), quantity, mark) == pytest.approx(exact(bent, mark, quantity), rel=1e-12)


def test_first_yield_is_no_part_of_the_curve():
    late = course(lambda x: np.where(x < 0.02, -5.0, 0.04))
    assert smoothed(late, FORCE, 0.1) == pytest.approx(exact(lambda x: 0.04, 0.1), rel=1e-12)


@pytest.mark.parametrize("mark", MARKS)
def test_a_sawtooth_is_smoothed_to_its_mean(mark):
    """Of teeth of 1 % that are 4 % of the reduction long, a quarter is left at the end, a tenth elsewhere."""
    rest = [
        math.log(
            smoothed(course(lambda x, p=p: 0.01 * ((x / 0.04 + p) % 1 - 0.5)), FORCE, mark) / exact(lambda x: 0.0, mark)
        )
        for p in np.linspace(0, 1, 200)
    ]
    assert np.abs(rest).max() < (0.0025 if mark == MARKS[-1] else 0.001)
    assert abs(np.mean(rest)) < 1e-4


def test_a_course_that_does_not_come_so_far_or_has_few_increments_tells_nothing():
    assert math.isnan(smoothed(course(np.zeros_like, at=AT[AT < 0.3]), FORCE, 0.3))
    assert math.isnan(smoothed(course(np.zeros_like, at=np.linspace(0.03, 0.45, 11)), FORCE, 0.3))
    assert smoothed(course(np.zeros_like, at=np.linspace(0.03, 0.45, 12)), FORCE, 0.3) > 0


def test_the_band_reaches_from_the_finest_to_the_extrapolation_of_first_order():
    assert bracketed([3.0, 3.0], [5.0, 5.0], [3.0, 3.0]) == (2.0, 1.0)
    assert bracketed([3.5, 2.5], [5.0, 5.0], [3.5, 2.5]) == (2.0, 1.5)
    assert bracketed([3.5, 2.5], [5.0, 5.0], [3.0, 2.5]) == (2.0, 1.75)


@pytest.mark.parametrize("order", [1.0, 1.5, 2.0, 4.0])
def test_errors_of_any_order_from_one_on_are_within_the_band(order):
    for own in (1.0, -0.3):
        finest = [10 + own * 0.5**order] * 2
        value, band = bracketed(finest, [10 + own] * 2, finest)
        assert abs(value - 10) <= band * (1 + 1e-12)


def meshes(*edges):
    """Of every trusted series, with so many edges between nodes a side."""
    return [Level(name, n // (2 if name.element.element.quadratic else 1)) for name in TRUSTED for n in edges]


def test_the_finest_spacing_counts_that_both_families_have_with_its_double():
    values = {mesh: float(mesh.edges) for mesh in meshes(20, 40)}
    assert set(told(values).values()) == {(40.0, 20.0)}
    alone = Level(Discretisation(ElementType.Q4P0), 80)
    assert told(values | {alone: 80.0}) == told(values)
    joined = Level(Discretisation(ElementType.Q8P1, Layout.FANNED), 40)
    assert told(values | {alone: 80.0, joined: 80.0}) == {alone: (80.0, 40.0), joined: (80.0, 40.0)}
    linear = {mesh: value for mesh, value in values.items() if mesh.of.element is ElementType.Q4P0}
    assert told(linear) == {}
    assert told(dict.fromkeys(meshes(40), 1.0)) == {}
    odd = {Level(Discretisation(ElementType.Q4P0), n): 1.0 for n in (7, 3)}
    assert told(values | odd) == told(values)


def synthetic(rng, apart=0.0):
    """Courses whose limit is known: errors of first order, and teeth ``apart`` by so much in a spacing's elements."""
    phases = {edges: rng.random() for edges in (40, 80)}
    slopes = {name: rng.uniform(-0.05, 0.15) for name in TRUSTED}

    def curve(mesh):
        own = phases[mesh.edges] + rng.normal(0, apart)

        def logarithm(x):
            rolled = 0.2 * np.clip((x - 0.02) / 0.43, 0, None) ** 1.4
            teeth = (mesh.edges * rolled + own) % 1 - 0.5
            return smooth(x) + (slopes[mesh.of] - 0.8 * teeth) / mesh.edges

        return logarithm

    return {mesh: course(curve(mesh)) for mesh in meshes(40, 80)}


def smooth(x):
    return 0.033 - 0.12 * x + 0.55 * x**2 + 1.2 * x**4


@pytest.mark.parametrize(("apart", "share"), [(0.0, 0.9), (0.05, 0.95)])
def test_the_limit_is_within_its_band_where_elements_jump_together(apart, share):
    """Teeth of 1 % on the finest mesh; in the study they are 0.06 to 0.13 of a tooth apart (mu = 0.3, 20 a side)."""
    rng = np.random.default_rng(0)
    inside, bands = [], []
    for _ in range(60):
        courses = synthetic(rng, apart)
        for mark in MARKS:
            value, band, _ = limit(courses, FORCE, mark)
            inside.append(abs(value - exact(smooth, mark)) <= band)
            bands.append(band / value)
    assert np.mean(inside) > share
    assert np.mean(bands) < 0.0025, "a band that is as wide as the teeth tells nothing"


def row(mu, mesh, reduction):
    """Of the table; what no limit depends on is zero."""
    kind, layout, sampling = mesh.of
    told = {"element": kind.value, "layout": layout.value, "sampling": sampling.value, "elements": mesh.elements}
    none: dict[str, Any] = dict.fromkeys((one.name for one in fields(Row)), 0)
    return Row(**none | told | {"mu": mu, "reduction": reduction})


def test_limits_are_told_by_coefficient_and_reduction_as_far_as_runs_come():
    courses = synthetic(np.random.default_rng(1))
    curves = {}
    for mesh, whole in courses.items():
        for mark in (0.2, 0.45):
            if mesh.of.element is ElementType.Q4P0 or mark < 0.45:
                kept = whole["at"] <= mark
                one = {name: values[kept] for name, values in whole.items()}
                curves[row(0.3, mesh, mark)] = one | {"max_radius_mm": one[FORCE], "contact_radius_mm": one[FORCE]}
    found = extrapolated(list(curves), curves)
    assert [(one.mu, one.reduction, one.quantity) for one in found] == [(0.3, 0.2, quantity) for quantity in EXPONENTS]
    assert extrapolated([], {}) == []


def test_a_jump_is_what_is_beyond_the_smooth_change_whatever_the_increments():
    at = np.delete(np.linspace(0.1, 0.4, 61), [7, 30])
    force = np.exp(1.3 * at + 0.4 * at**2) * np.where(at > 0.2501, 1.03, 1.0)
    found = jumps(at, force)
    where = int(np.flatnonzero(at > 0.2501)[0]) - 1
    assert found.argmax() == where
    assert found[where] == pytest.approx(math.log(1.03), abs=3e-4)
    assert np.delete(found, where).max() < 3e-4


def test_jumps_count_from_the_first_landing_on_in_runs_that_end():
    at = np.linspace(0.0, 0.45, 91)
    force = np.exp(at) * np.where(at > 0.0999, 1.10, 1.0) * np.where(at > 0.2999, 1.02, 1.0)
    landed = np.where(at > 0.1999, 1.0, 0.0) + np.where(at > 0.2999, 1.0, 0.0)
    mesh = Level(Discretisation(ElementType.Q8P1, Layout.FANNED), 20)
    whole, short, never = row(0.3, mesh, 0.45), row(0.3, mesh, 0.4), row(0.1, mesh, 0.45)
    given = {"at": at, FORCE: force, "landed": landed}
    (one,) = scatters([whole, short, never], {whole: given, short: given, never: given | {"landed": 0 * landed}}, 0.45)
    assert (one.mu, one.element, one.layout, one.elements, one.landings) == (0.3, "q8p1", "fanned", 20, 2)
    assert (one.first_landing, one.reduction) == pytest.approx((0.2, 0.3))
    assert one.scatter == pytest.approx(math.log(1.02), abs=1e-6)
