"""Friction with a largest force, |r_t| <= min(mu r_n, cap): limits, set, natural map, pieces, certificate."""

from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.certificate import contact_gaps, law_residual
from bipot.laws.coulomb import Status, cone_violation, friction_gap, limit, limit_slope, natural_map, status
from bipot.programs.data import ContactRows, Units
from bipot.programs.pieces import Pieces
from tests.newton_models import newton
from tests.test_certificate import certified, contact_fields, material_fields

INF = np.inf
LAWS = [(0.3, 1.0), (2.0, 0.5), (INF, 0.7), (0.3, 0.0), (0.0, 1.0)]


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def by_hand(r_n, mu, cap):
    """s of one contact, case by case."""
    if np.isinf(mu):
        return cap if r_n > 0 else 0.0
    return mu * r_n if mu * r_n < cap else cap


@pytest.mark.parametrize(("mu", "cap"), LAWS)
def test_the_limit_is_the_smaller_of_the_two(mu, cap):
    r_n = np.linspace(-1.0, 6.0, 57)
    np.testing.assert_array_equal(limit(r_n, mu, cap), [by_hand(one, mu, cap) for one in r_n.tolist()])
    inside = r_n[1:-1][np.abs(mu * r_n[1:-1] - cap) > 0.2 * max(mu, 1e-3)] if np.isfinite(mu) else r_n[r_n > 0.1]
    steps = (limit(inside + 1e-6, mu, cap) - limit(inside - 1e-6, mu, cap)) / 2e-6
    np.testing.assert_allclose(limit_slope(inside, mu, cap), steps, atol=1e-9)


def test_without_a_cap_nothing_changes(rng):
    r, u, mu = rng.normal(size=(200, 3)), rng.normal(size=(200, 3)), rng.uniform(0, 2, 200)
    none = np.full(200, INF)
    np.testing.assert_array_equal(natural_map(r, u, mu, 1.3, none), natural_map(r, u, mu, 1.3))
    np.testing.assert_array_equal(cone_violation(r, mu, none), cone_violation(r, mu))
    mixed = np.where(np.arange(200) % 2, none, 0.5)
    np.testing.assert_array_equal(natural_map(r, u, mu, 1.3, mixed)[1::2], natural_map(r, u, mu, 1.3)[1::2])


@pytest.mark.parametrize(("mu", "cap"), LAWS)
@pytest.mark.parametrize("d", [2, 3])
def test_the_set_of_forces_is_convex(rng, mu, cap, d):
    r = rng.normal(size=(4000, d)) * np.array([2.0] + [0.5] * (d - 1))
    inside = r[cone_violation(r, mu, cap) == 0]
    if min(mu, cap) == 0:
        inside = np.abs(r) * np.eye(d)[0]
    one, other = inside[: len(inside) // 2], inside[len(inside) // 2 :][: len(inside) // 2]
    t = rng.uniform(size=(len(one), 1))
    assert len(one) > 20
    assert cone_violation(t * one + (1 - t) * other, mu, cap).max() <= 1e-15


def cases(mu, cap, d):
    """(r, u, status) of the law's cases, one array each."""
    e = np.eye(d)[1:].mean(axis=0) / np.linalg.norm(np.eye(d)[1:].mean(axis=0))
    found = [(np.zeros(d), 0.3 * np.eye(d)[0] + 0.2 * np.roll(e, 0), Status.OPEN)]
    for r_n in (0.4, 3.0):
        s, n = by_hand(r_n, mu, cap), r_n * np.eye(d)[0]
        found.append((n - s * e, 0.6 * e, Status.SLIP))
        found.append((n + 0.5 * s * e, 0 * e, Status.STICK if s > 0 else Status.SLIP))
    return [np.array(part) for part in zip(*found, strict=True)]


@pytest.mark.parametrize(("mu", "cap"), LAWS)
@pytest.mark.parametrize("d", [2, 3])
def test_the_natural_map_and_the_gap_vanish_where_the_law_holds(mu, cap, d):
    r, u, kind = cases(mu, cap, d)
    for rho in (0.1, 1.0, 30.0):
        np.testing.assert_allclose(natural_map(r, u, mu, rho, cap), 0.0, atol=1e-14)
    np.testing.assert_allclose(friction_gap(r, u[:, 1:], mu, cap), 0.0, atol=1e-15)
    np.testing.assert_array_equal(cone_violation(r, mu, cap), 0.0)
    np.testing.assert_array_equal(status(r, u, 0.0, mu, 1e-9, 1e-9, cap), kind)


@pytest.mark.parametrize(("mu", "cap"), [law for law in LAWS if min(law) > 0])
def test_what_breaks_the_law_is_seen_at_its_size(mu, cap):
    r, u, _ = cases(mu, cap, 2)
    r, u = r[[1, 3]], u[[1, 3]]
    s = np.array([by_hand(one, mu, cap) for one in r[:, 0].tolist()])
    beyond, short, back = (r * np.array([1.0, factor]) for factor in (1.1, 0.9, -1.0))
    np.testing.assert_allclose(cone_violation(beyond, mu, cap), 0.1 * s)
    np.testing.assert_allclose(friction_gap(short, u[:, 1:], mu, cap), 0.1 * s * 0.6)
    np.testing.assert_allclose(friction_gap(back, u[:, 1:], mu, cap), 2 * s * 0.6)
    for wrong, by in ((beyond, 0.1 * s), (short, 0.1 * s), (back, 2 * s)):
        np.testing.assert_allclose(np.linalg.norm(natural_map(wrong, u, mu, 50.0, cap), axis=1), by)
    # Shear of what is open, and a normal force across a gap.
    assert np.abs(natural_map(np.array([[0.0, 0.2]]), np.array([[0.5, 0.1]]), mu, 1.0, cap)).max() == pytest.approx(0.2)
    assert np.abs(natural_map(np.array([[0.2, 0.0]]), np.array([[0.5, 0.0]]), mu, 1.0, cap)).max() == pytest.approx(0.2)


def one_contact(mu, cap, gap=-0.1, slip=0.2):
    one = np.ones(1)
    unit = [sp.csr_matrix(row) for row in np.eye(2)[:, None]]
    return ContactRows(unit[0], gap * one, unit[1], slip * one[:, None], np.arange(1), mu * one, cap * one, one == 0)


def solutions(K, F, rows, mu, cap):
    """Every (x, r) of K x = F + r, r = (r_n, r_t), that obeys the law: each case a linear system, then looked at."""
    gap, slip, found = rows.gap[0], rows.slip[0, 0], []
    x = np.linalg.solve(K, F)
    if x[0] + gap > 0:
        found.append((x, np.zeros(2)))
    x = -np.array([gap, slip])
    r = K @ x - F
    if r[0] > 0 and abs(r[1]) <= by_hand(r[0], mu, cap):
        found.append((x, r))
    for sign, held in product((-1.0, 1.0), (False, True)):
        # Unknowns x_t and r_n: r_t = -sign cap, or -sign mu r_n.
        if not held and np.isinf(mu):
            continue
        by_n = 0.0 if held else -sign * mu
        A = np.array([[K[0, 1], -1.0], [K[1, 1], -by_n]])
        b = F + np.array([0.0, -sign * cap if held else 0.0]) + K[:, 0] * gap
        x_t, r_n = np.linalg.solve(A, b)
        r_t = -sign * cap if held else by_n * r_n
        governs = np.isinf(mu) or (mu * r_n > cap if held else mu * r_n < cap)
        if r_n > 0 and governs and sign * (x_t + slip) > 0:
            found.append((np.array([-gap, x_t]), np.array([r_n, r_t])))
    return found


@pytest.mark.parametrize(("mu", "cap"), [(0.3, 0.4), (0.8, 0.1), (INF, 0.4), (INF, 0.05)])
def test_newton_finds_the_solution_that_trying_all_cases_finds(mu, cap):
    kinds, cycles = set(), 0
    for seed in range(120):
        rng = np.random.default_rng(seed)
        A = rng.normal(size=(2, 2))
        K, F = A @ A.T + np.diag(rng.uniform(1.0, 4.0, 2)), rng.normal(size=2)
        rows = one_contact(mu, cap, rng.normal(0.0, 0.3), rng.normal(0.0, 0.5))
        found = solutions(K, F, rows, mu, cap)
        if len(found) != 1:
            # Constant shear jumps where contact begins: there may be two ways, or none.
            assert np.isinf(mu)
            continue
        x, r = newton(K, F, rows, steps=25)
        if np.abs(natural_map(r, rows.motion(x), rows.mu, 1.0, rows.cap)).max() > 1e-9:
            # Where s jumps, steps without a search may cycle.
            assert np.isinf(mu)
            cycles += 1
            continue
        np.testing.assert_allclose(x, found[0][0], atol=1e-9)
        np.testing.assert_allclose(r[0], found[0][1], atol=1e-9)
        kinds.add(int(status(r, rows.motion(x), 0.0, mu, 1e-9, 1e-9, cap)[0]))
    assert {Status.OPEN, Status.STICK, Status.SLIP} <= kinds
    assert cycles <= 4


@pytest.mark.parametrize(("mu", "cap"), [(0.3, 1.0), (0.3, 0.1), (INF, 0.4)])
def test_the_pieces_have_the_derivative_of_the_law(rng, mu, cap):
    rows, scale = one_contact(mu, cap), np.array([2.0])
    for _ in range(40):
        motion, r = rng.normal(size=(1, 2)), rng.normal(size=(1, 2)) + np.array([0.5, 0.0])

        def value(motion, r):
            return Pieces.of(rows, motion, r, scale).value(motion, r)[0]

        at = Pieces.of(rows, motion, r, scale)
        for j, step in enumerate(1e-7 * np.eye(2)):
            by_motion = (value(motion + step, r) - value(motion - step, r)) / 2e-7
            by_force = (value(motion, r + step) - value(motion, r - step)) / 2e-7
            np.testing.assert_allclose(at.by_motion[0][:, j], by_motion, atol=1e-7)
            np.testing.assert_allclose(at.by_force[0][:, j], by_force, atol=1e-7)


def test_pieces_with_another_governing_law_are_not_the_same():
    motion, r, scale = np.array([[0.0, 0.5]]), np.array([[2.0, -0.6]]), np.ones(1)
    low, high = (Pieces.of(one_contact(0.3, cap), motion, r, scale) for cap in (0.5, 5.0))
    assert not low.same(high)
    assert low.same(Pieces.of(one_contact(0.3, 0.45), motion, r, scale))
    np.testing.assert_array_equal(low.at_caps(r), [[2.0, -0.5]])
    np.testing.assert_array_equal(high.at_caps(r), r)


def test_rows_measure_caps_in_units_of_force():
    rows = one_contact(0.3, 0.5)
    r, units = np.array([[4.0, 0.0]]), Units(0.1, 2.0, 50.0, 8.0)
    assert rows.limit(r) == 0.5
    assert rows.limit_slope(r) == 0.0
    np.testing.assert_allclose(units.force * rows.scaled(units).limit(r / units.force), 0.5)
    np.testing.assert_array_equal(rows.threshold(-r), [0.0])
    assert rows.capped
    assert not one_contact(0.3, INF).capped


@pytest.mark.parametrize("mu", [0.4, INF])
def test_planted_errors_of_capped_friction_come_back_in_the_certificate(mu):
    """r_n = 10, mu r_n = 4, cap 3: shear beyond it by 5 %, short of it by 5 %, and the right one."""
    material, _ = material_fields()
    slip, largest = 0.2, 10.0
    right = certified(contact_fields([[10.0, -3.0]], [[0.0, slip]], mu, cap=3.0, stiffness=40.0), material)
    assert (right.cone_violation, right.law, right.contact_gap) == (0.0, 0.0, 0.0)
    for factor in (1.05, 0.95):
        contact = contact_fields([[10.0, -3.0 * factor]], [[0.0, slip]], mu, cap=3.0, stiffness=40.0)
        wrong = certified(contact, material)
        assert wrong.cone_violation == pytest.approx(max(3.0 * (factor - 1), 0) / largest)
        assert wrong.contact_gap == pytest.approx(abs(3.0 * slip - 3.0 * factor * slip))
        assert wrong.law == pytest.approx(0.15 / np.linalg.norm([10.0, 0.0]), rel=1e-6)
        np.testing.assert_allclose(contact_gaps(contact), abs(3.0 - 3.0 * factor) * slip)
        np.testing.assert_allclose(law_residual(contact), [[0.0, -3.0 * (factor - 1)]], atol=1e-14)
    # The same forces obey Coulomb's law nowhere, and one of mu r_n not the capped one.
    assert certified(contact_fields([[10.0, -3.0]], [[0.0, slip]], 0.4), material).contact_gap == pytest.approx(0.2)
    assert certified(contact_fields([[10.0, -4.0]], [[0.0, slip]], 0.4, cap=3.0), material).cone_violation > 0.09


def test_constant_shear_is_that_of_points_that_carry_a_force():
    """An open point that a solver left a billionth of the force rubs as little as one that has none."""
    left, r = 1e-9, np.array([[10.0, -3.0], [1e-8, 0.0]])
    assert limit(np.array([left]), INF, 3.0, none=1e-7) == 0.0
    fields = contact_fields([[10.0, -3.0]], [[0.0, 0.2]], INF, cap=3.0)
    both = type(fields)(
        r=r,
        motion=np.array([[0.0, 0.2], [0.4, 0.2]]),
        mu=np.full(2, INF),
        cap=np.full(2, 3.0),
        tied=np.zeros(2, bool),
        stiffness=np.ones(2),
        largest=10.0,
        present=10.0,
        blur=np.zeros(2),
    )
    assert contact_gaps(both)[1] == pytest.approx(1e-8 * 0.4)
    assert np.abs(law_residual(both)[1]).max() == pytest.approx(1e-8)
