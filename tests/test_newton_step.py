"""A step of the Newton form: its pieces, frames and linear algebra on closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from bipot.laws.coulomb import natural_map
from bipot.programs import frames
from bipot.programs import newton as newton_step
from bipot.programs.data import ContactRows
from bipot.programs.frames import Frames
from bipot.programs.newton import Model, minimised
from bipot.programs.ordering import Pattern
from bipot.programs.pieces import Pieces
from tests.newton_models import csc, newton, rows_of, turned


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, 0.7])
def test_one_node_slip_in_any_frame(angle: float) -> None:
    """Closed form: u_n = 0 and r_t = mu r_n give u_t = -7/15, r = (22, 11)/15, whatever frame the unknowns have."""
    K, F = np.array([[2.0, -1.0], [-1.0, 1.0]]), np.array([-1.0, -1.2])
    R = turned(angle)
    rows = rows_of(R[:, :1].T, R[:, 1:].T, np.zeros(1), np.zeros(1), 0.5)
    x, r = newton(R @ K @ R.T, R @ F, rows)
    np.testing.assert_allclose(R.T @ x, [0.0, -7 / 15], atol=1e-12)
    np.testing.assert_allclose(r, [[22 / 15, 11 / 15]], atol=1e-12)


@pytest.mark.parametrize(
    ("mu", "F", "u", "r"),
    [
        (0.5, (1.0, 0.2), (1.2, 1.4), (0.0, 0.0)),
        (0.5, (-1.0, 0.1), (0.0, 0.0), (1.0, -0.1)),
        (0.0, (-1.0, -0.3), (0.0, -0.3), (1.3, 0.0)),
    ],
    ids=["open", "stick", "frictionless"],
)
def test_one_node_other_pieces(mu: float, F: tuple, u: tuple, r: tuple) -> None:
    K = np.array([[2.0, -1.0], [-1.0, 1.0]])
    x, force = newton(K, np.array(F), rows_of(np.eye(2)[:1], np.eye(2)[1:], np.zeros(1), np.zeros(1), mu))
    np.testing.assert_allclose(x, u, atol=1e-12)
    np.testing.assert_allclose(force[0], r, atol=1e-12)


def test_tied_node_meets_gap_and_slip_and_may_pull() -> None:
    K, F = np.array([[2.0, -1.0], [-1.0, 1.0]]), np.array([1.0, 0.2])
    rows = rows_of(np.eye(2)[:1], np.eye(2)[1:], np.array([0.25]), np.array([-0.5]), 0.0, tied=True)
    x, r = newton(K, F, rows)
    np.testing.assert_allclose(x, [-0.25, 0.5], atol=1e-12)
    np.testing.assert_allclose(r[0], K @ x - F, atol=1e-12)


def test_a_pair_on_which_the_fixed_point_cycles_is_solved() -> None:
    """A published problem on which the undamped De Saxce fixed point cycles; 139 times its solution is integer."""
    W = np.array([[28, -5, -12, -10], [-5, 17, -12, -5], [-12, -12, 22, 7], [-10, -5, 7, 10]], dtype=float)
    q = np.array([-4.0, 1.0, -4.0, -4.0])
    K = np.linalg.inv(W)
    G_n, G_t = np.eye(4)[[0, 2]], np.eye(4)[[1, 3]]
    x, r = newton(K, K @ q, rows_of(G_n, G_t, np.zeros(2), np.zeros(2), 1.0))
    np.testing.assert_allclose(r.ravel() * 139, [204, 204, 188, 188], atol=1e-9)
    np.testing.assert_allclose(x * 139, [0, -609, 0, -420], atol=1e-9)


def model_in_space(rng: np.random.Generator, nodes: int) -> Model:
    """Nodes coupled by a random energy and pressed onto a plane, across which they are dragged."""
    n = 3 * nodes
    A = rng.normal(size=(n, n))
    K = A @ A.T / n + np.eye(n)
    F = np.array([2.0, 1.0, -4.0]) + rng.normal(size=(nodes, 3))
    up, along = np.eye(n)[2::3], np.delete(np.eye(n), np.s_[2::3], axis=0)
    gap, slip = rng.uniform(-0.5, 1.0, nodes), rng.normal(size=2 * nodes)
    return Model(K, F.ravel(), rows_of(up, along, gap, slip, 0.4))


def test_slip_that_turns_by_little_needs_no_new_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    """From a near answer: exact by two thirds of the factors that one for each direction takes."""
    counts = []
    for seed in range(5):
        model = model_in_space(np.random.default_rng(seed), 12)

        def at(motion: np.ndarray, r: np.ndarray, rows: ContactRows = model.rows) -> Pieces:
            return Pieces.of(rows, motion, r, np.ones(rows.count))

        last = minimised(model, at, np.zeros(36), np.zeros((12, 3)))
        begin, model = (last.x, last.r), model._replace(f=1.01 * model.f)
        kept = minimised(model, at, *begin)
        with monkeypatch.context() as patch:
            patch.setattr(newton_step, "TURN", newton_step.ALIKE)
            anew = minimised(model, at, *begin)
        motion = model.rows.motion(kept.x)
        law = natural_map(kept.r, motion, model.rows.mu, 1.0)
        assert np.any(np.abs(motion[:, 1:]).min(axis=1) > 0.1), "nothing slides"
        assert np.abs(law).max() < 1e-11 * np.abs(kept.r).max()
        np.testing.assert_allclose(kept.x, anew.x, atol=1e-10)
        counts.append((kept.factors, anew.factors))
    fewer, more = np.sum(counts, axis=0)
    assert fewer <= 2 / 3 * more


def test_what_is_dragged_along_a_support_slides_even_from_inside_of_its_disc() -> None:
    """No unknown moves it along the first tangent: friction is mu r_n against the slip, and y is not stretched."""
    rows = rows_of(np.array([[1.0, 0.0]]), np.diag([0.0, 1.0]), np.zeros(1), np.array([0.1, 0.0]), 0.3)
    assert rows.dragged.all()
    motion, r = np.array([[0.0, 0.1, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    pieces = Pieces.of(rows, motion, r, np.ones(1))
    np.testing.assert_allclose(pieces.value(motion, r), [[0.0, 0.3, 0.0]])
    np.testing.assert_allclose(pieces.disc.by_point[0], np.diag([0.0, 1.0]), atol=1e-15)
    held = replace(rows, slip=np.zeros((1, 2)))
    assert not Pieces.of(held, 0 * motion, r, np.ones(1)).disc.slides.any()


def test_what_touches_without_a_force_is_closed() -> None:
    """Else nothing would hold a body that only contacts hold."""
    rows = rows_of(np.eye(3), np.zeros((3, 3)), np.zeros(3), np.zeros(3), 0.3)
    gaps = np.array([[-1e-12, 0.0], [0.0, 0.0], [1e-12, 0.0]])
    assert Pieces.of(rows, gaps, np.zeros((3, 2)), np.ones(3)).closed.tolist() == [True, True, False]


def test_open_contacts_of_a_model_carry_exactly_nothing() -> None:
    """What the solution of their rows leaves is round-off, which a certificate of a body without force would see."""
    apart = 0
    for seed in range(5):
        model = model_in_space(np.random.default_rng(seed), 12)
        model = model._replace(f=np.repeat([1.0, -1.0], 18) * model.f)
        found = minimised(
            model, lambda u, r, m=model: Pieces.of(m.rows, u, r, np.ones(12)), np.zeros(36), np.zeros((12, 3))
        )
        opened = model.rows.motion(found.x)[:, 0] > 1e-6
        assert (found.r[opened] == 0).all()
        apart += opened.sum()
    assert apart > 5


def test_a_model_without_force_comes_to_rest() -> None:
    """From what a solver leaves of motions and forces; the body's own scale of force then is none."""
    model = model_in_space(np.random.default_rng(0), 12)
    free = model._replace(f=np.zeros(36), rows=replace(model.rows, gap=np.ones(12)))
    noise = np.random.default_rng(1).normal(size=(2, 36))
    found = minimised(
        free, lambda u, r: Pieces.of(free.rows, u, r, np.ones(12)), 1e-10 * noise[0], 1e-8 * noise[1].reshape(12, 3)
    )
    assert not found.r.any()
    assert np.abs(found.x).max() < 1e-30


def test_a_start_whose_miss_is_round_off_of_a_far_model_takes_a_step() -> None:
    """A contact sunk by 1e-9 beside unknowns of 1e9: K x has the round-off of a force of 1e-7, so no error falls."""
    n = 42
    normal, tangent = np.eye(n)[:2]
    rows = rows_of(normal[None], tangent[None], np.zeros(1), np.zeros(1), 0.3)
    for seed in range(10):
        rng = np.random.default_rng(seed)
        A = rng.normal(size=(n, n))
        K = A @ A.T / n + np.eye(n)
        x, r = np.append(np.zeros(2), 1e9 * rng.uniform(1, 2, n - 2)), np.array([[1.0, 0.1]])
        model = Model(K, K @ x - rows.forces(r), rows)
        sunk = x - 1e-9 * normal
        found = minimised(model, lambda motion, r: Pieces.of(rows, motion, r, np.ones(1)), sunk, r)
        assert rows.motion(found.x)[0, 0] == 0


@settings(deadline=None, derandomize=True, max_examples=25)
@given(st.integers(2, 30), st.integers(0, 10_000))
def test_pattern_solves_unsymmetric_systems(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = sp.random(n, n, 0.3, random_state=rng)
    A = sp.csc_matrix(A + A.T + sp.eye(n))
    A.sort_indices()
    pattern = Pattern.of(A.indices, A.indptr)
    A.data = rng.uniform(-1, 1, A.nnz) + 5 * n * (A.indices == np.repeat(np.arange(n), np.diff(A.indptr)))
    b = rng.normal(size=n)
    np.testing.assert_allclose(A @ pattern.solve(pattern.factorise(pattern.by_row(A.data)[:-1]), b), b, atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(st.integers(0, 10_000), st.integers(1, 2))
def test_pieces_are_the_derivatives_of_the_law(seed: int, tangents: int) -> None:
    rng = np.random.default_rng(seed)
    c, d = 6, 1 + tangents
    rows = rows_of(np.zeros((c, 1)), np.zeros((c * tangents, 1)), np.zeros(c), np.zeros(c * tangents), 0.4)
    motion, r, scale = rng.normal(size=(c, d)), rng.normal(size=(c, d)), rng.uniform(1, 3, c)
    dm, dr = rng.normal(size=(2, c, d))

    def law(h: float) -> np.ndarray:
        m, f = motion + h * dm, r + h * dr
        return Pieces.of(rows, m, f, scale).value(m, f)

    pieces = Pieces.of(rows, motion, r, scale)
    expected = (law(1e-6) - law(-1e-6)) / 2e-6
    linear = np.einsum("cij,cj->ci", pieces.by_motion, dm) + np.einsum("cij,cj->ci", pieces.by_force, dr)
    np.testing.assert_allclose(linear, expected, atol=1e-6)


def test_dead_band_holds_a_contact_without_force_or_gap() -> None:
    rows = rows_of(np.eye(2), np.eye(2), np.zeros(2), np.zeros(2), 0.1)
    band, scale = (1e-3, 1e-3), np.ones(2)
    closed = Pieces.of(rows, np.zeros((2, 2)), np.ones((2, 2)), scale)
    weak = np.array([[-5e-4, 0.0], [-2e-3, 0.0]])
    assert Pieces.of(rows, np.zeros((2, 2)), weak, scale, band, closed).closed.tolist() == [True, False]
    opened = Pieces.of(rows, np.ones((2, 2)), np.zeros((2, 2)), scale)
    entering = np.array([[-5e-4, 0.0], [-2e-3, 0.0]])
    assert Pieces.of(rows, entering, np.zeros((2, 2)), scale, band, opened).closed.tolist() == [False, True]


def test_frames_agree_with_the_rows() -> None:
    rng = np.random.default_rng(0)
    G_n, G_t = np.zeros((2, 5)), np.zeros((2, 5))
    G_n[0, 1:3], G_t[0, 1:3] = turned(0.3)
    G_n[1, 4] = -1.0
    rows = rows_of(G_n, G_t, rng.normal(size=2), rng.normal(size=2), 0.2).take(np.array([True, True]))
    rows = ContactRows(rows.G_n, rows.gap, rows.G_t[:1], rows.slip[:1], np.array([0]), rows.mu, rows.cap, rows.tied)
    pattern = Pattern.of(*csc(np.zeros((5, 5))))
    held = Frames.of(rows, pattern)
    r = np.array([[1.0, -0.3], [2.0, 0.0]])
    np.testing.assert_allclose(held.reaction(rows.forces(r)), r, atol=1e-14)


def test_a_contact_of_two_nodes_with_other_neighbours_borders_the_matrix() -> None:
    """A sparse pattern has no place for what a full one has: K couples the middle one of a chain to both ends."""
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    F, ends = np.array([-2.0, 0.7, -1.0]), np.array([[1.0, 0.0, 1.0]]) / np.sqrt(2)
    rows = rows_of(ends, np.array([[1.0, 0.0, -1.0]]) / np.sqrt(2), np.zeros(1), np.zeros(1), 0.3)
    x, r = newton(K, F, rows, sparse=True)
    np.testing.assert_allclose(K @ x - F, rows.forces(r), atol=1e-12)
    np.testing.assert_allclose(ends @ x, 0.0, atol=1e-12)
    np.testing.assert_allclose(r[:, 1], -0.3 * r[:, 0] * np.sign(x[0]), atol=1e-12)
    np.testing.assert_allclose(x, newton(K, F, rows)[0], atol=1e-12)


def test_a_contact_that_is_dragged_where_its_frame_has_turned_owns_nothing() -> None:
    """Where the tangent comes to lie along what a support holds, no equilibrium determines the friction."""
    gap, slip, pattern = np.zeros(1), np.array([0.1]), Pattern.of(*csc(np.zeros((2, 2))))
    rows, along = (
        rows_of(np.array([n]), np.array([t]), gap, slip, 0.3) for n, t in (((1, 0), (0, 1)), ((1, 0), (0, 0)))
    )
    frames = Frames.of(rows, pattern)
    assert frames.border is None
    assert along.dragged.all()
    assert frames.turned(along).border is not None


@settings(deadline=None, derandomize=True, max_examples=20)
@given(st.integers(0, 10_000), st.booleans())
def test_forces_that_border_the_matrix_give_the_step_of_forces_that_are_eliminated(seed: int, frictional: bool) -> None:
    """On contacts that own their unknowns, which either takes; with and without friction rows, every piece."""
    rng = np.random.default_rng(seed)
    n, c = 9, 3
    A = rng.normal(size=(n, n))
    K, F = A @ A.T + n * np.eye(n), 5 * rng.normal(size=n)
    G_n, G_t = np.zeros((c, n)), np.zeros((c, n))
    for k, R in enumerate(map(turned, rng.uniform(0, 6, c))):
        G_n[k, 2 * k : 2 * k + 2], G_t[k, 2 * k : 2 * k + 2] = R
    rows = rows_of(G_n, G_t, 0.1 * rng.normal(size=c), 0.1 * rng.normal(size=c), 0.4)
    if not frictional:
        rows = replace(rows, G_t=rows.G_t[:0], slip=rows.slip[:0], frictional=rows.frictional[:0])
    own = newton(K, F, rows)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frames, "DEPENDENT", np.inf)
        assert Frames.of(rows, Pattern.of(*csc(K))).border is not None
        bordered = newton(K, F, rows)
    for ours, theirs in zip(bordered, own, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-9)


BESIDE = np.array([[3.0, -1.0, -0.5], [-1.0, 2.0, -0.4], [-0.5, -0.4, 1.0]])


@pytest.mark.parametrize(
    ("G_n", "G_t"),
    [
        (np.array([[1.0, 0, 0], [0, 1, 0]]), np.array([[0.0, 1, 0], [1, 0, 0]])),
        (np.array([[1.0, 0, 0], [1, 0, 0]]), np.array([[0.0, 1, 0], [0, 1, 0]])),
        (np.array([[0.6, 0, -0.8]]), np.array([[0.0, 1, 0]])),
        (np.array([[0.6, 0, 0]]), np.array([[0.8, 0, 0]])),
    ],
    ids=["a node in a corner", "rows given twice", "two nodes in a row", "two rows on one unknown"],
)
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_contacts_that_share_unknowns_meet_the_law(G_n: np.ndarray, G_t: np.ndarray, mu: float) -> None:
    """K x = F + G' r, and the natural map of r and motion vanishes: nothing else is asked."""
    c, F = len(G_n), np.array([-2.0, -1.0, 0.7])
    rows = rows_of(G_n, G_t, np.full(c, 0.1), np.zeros(c), mu)
    assert Frames.of(rows, Pattern.of(*csc(BESIDE))).border is not None
    x, r = newton(BESIDE, F, rows, 30)
    np.testing.assert_allclose(BESIDE @ x, F + rows.forces(r), atol=1e-10)
    np.testing.assert_allclose(natural_map(r, rows.motion(x), mu, 1.0), 0.0, atol=1e-10)
