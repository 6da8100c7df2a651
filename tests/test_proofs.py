"""Claims of interior points that a program has no answer: what they prove, and what round-off does not."""

import clarabel
import numpy as np
import pytest
import scipy.sparse as sp

from bipot.conic import proofs
from bipot.conic.clarabel import Clarabel, transfer
from bipot.conic.problem import Cone, ConicProgram, Rows
from bipot.conic.solver import Accuracy
from bipot.errors import InfeasibleProgram, ProgramError, UnboundedProgram

FINE = Accuracy(1e-9)


def rows(cone, A, b, width=1):
    return Rows(f"{cone.value} {len(b)}", cone, sp.csr_matrix(np.array(A, float)), np.array(b, float), width)


def program(P, q, *given):
    return ConicProgram(sp.csc_matrix(np.array(P, float)), np.array(q, float), given, {"x": slice(0, len(q))})


def opposed(clearance, steep=0.0):
    """1/2 x^2 where x >= 0 and clearance >= x (1 - steep), and a cone that holds everywhere near."""
    return program(
        [[1.0]],
        [0.0],
        rows(Cone.NONNEGATIVE, [[1.0], [steep - 1.0]], [0.0, clearance]),
        rows(Cone.SECOND_ORDER, [[0.0], [1.0]], [1e3, 0.0], 2),
    )


def test_multipliers_that_balance_prove_that_clearances_exclude_each_other():
    assert proofs.infeasible(opposed(-1e-3), np.array([1.0, 1.0, 0.0, 0.0]))
    with pytest.raises(InfeasibleProgram, match="no displacement"):
        Clarabel().solve(opposed(-1e-3), FINE)


@pytest.mark.parametrize("size", [1.0, 1e16])
def test_what_round_off_excludes_is_not_proved(size):
    assert not proofs.infeasible(opposed(-1e-16), size * np.array([1.0, 1.0, 0.0, 0.0]))


def test_multipliers_that_do_not_balance_prove_nothing_of_what_is_far():
    """0.002 x >= 1 where x = 501."""
    wide = opposed(-1.0, steep=1.002)
    assert all(r.at(np.array([501.0]))[0] >= 0 for r in wide.rows)
    assert not proofs.infeasible(wide, np.array([0.0, 1.0, 0.0, 0.0]))


def test_multipliers_outside_of_the_dual_cone_prove_nothing():
    assert not proofs.infeasible(opposed(1.0), np.array([-1.0, -1.0, 0.0, 0.0]))
    coned = program([[1.0]], [0.0], rows(Cone.SECOND_ORDER, [[0.0], [0.0]], [1.0, 0.5], 2))
    assert not proofs.infeasible(coned, np.array([0.0, -2.5]))
    assert proofs.infeasible(program([[1.0]], [0.0], rows(Cone.ZERO, [[0.0]], [1.0])), np.array([-1.0]))


@pytest.mark.parametrize("size", [1e6, 1e7, 1e8])
def test_a_large_answer_is_no_lack_of_one(size):
    """Half a square less ``size`` times its root, under a cone: Clarabel's own tolerance calls it unbounded."""
    cone = rows(Cone.SECOND_ORDER, [[0.0, 1.0], [1.0, 0.0]], [0.0, 0.0], 2)
    bare = rows(Cone.NONNEGATIVE, np.eye(2), np.zeros(2))
    found, _ = Clarabel().solve(program(np.eye(2), [1.0, -size], bare, cone), FINE)
    assert found.x[1] == pytest.approx(size, rel=1e-6)
    ray = np.array([0.0, 1.0])
    assert not proofs.unbounded(program(np.eye(2), [1.0, -1e5], bare, cone), ray)


def test_a_ray_without_resistance_proves_that_there_is_no_least():
    bare = rows(Cone.NONNEGATIVE, np.eye(2), np.zeros(2))
    free = program(np.diag([1.0, 0.0]), [0.0, -1.0], bare)
    assert proofs.unbounded(free, np.array([0.0, 2.0]))
    assert not proofs.unbounded(free, np.array([1.0, -2.0]))
    assert not proofs.unbounded(program(np.zeros((2, 2)), [0.0, 1.0], bare), np.array([0.0, -1.0]))
    with pytest.raises(UnboundedProgram, match="no minimum"):
        Clarabel().solve(free, FINE)


def test_a_claim_that_its_certificate_does_not_prove_is_none(monkeypatch):
    monkeypatch.setattr(proofs, "infeasible", lambda program, z: False)
    ready = transfer(opposed(-1e-3), FINE)
    assert ready.clarabel.solve().status == clarabel.SolverStatus.PrimalInfeasible
    with pytest.raises(ProgramError, match="PrimalInfeasible") as caught:
        Clarabel().solve(opposed(-1e-3), FINE)
    assert not isinstance(caught.value, InfeasibleProgram)
