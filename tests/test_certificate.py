"""Measures of the certificate on fields made by hand: what they are relative to, and what round-off may hide."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from bipot.certificate import (
    Balance,
    Bounds,
    Certificate,
    ContactFields,
    MaterialFields,
    certify,
    contact_gaps,
    material_gaps,
    over_bound,
)
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises, radial_return

ELASTIC, HARDENING = Elasticity(210_000.0, 0.3), Linear(300.0, 1000.0)


def test_associated_sliding_shows_in_the_gap():
    """Dilatant sliding opens by mu |du_t|: r . (du_n, du_t) is then zero, and the gap is mu r_n |du_t| of real work."""
    mu, r_n, slip = 0.3, 2.0, 0.5
    r = np.array([[r_n, -mu * r_n]])
    lifted = np.array([[mu * slip, slip]])
    assert contact_gaps(contact_fields(r, lifted, mu)) == pytest.approx(mu * r_n * slip)
    assert contact_gaps(contact_fields(r, [[0.0, slip]], mu)) == pytest.approx(0.0, abs=1e-15)


def material_fields(plastic_factor=1.0):
    """One point returned to the surface, its plastic strain times ``plastic_factor``."""
    trial = np.array([[900.0, -200.0, 50.0, 120.0]])
    found = radial_return(trial, np.array([0.1]), ELASTIC, HARDENING)
    e_p = plastic_factor * found.plastic_strain
    sigma_e = trial - e_p @ ELASTIC.stiffness(4)
    peeq = np.array([0.1]) + plastic_factor * found.dpeeq
    fields = MaterialFields(
        before=np.zeros((1, 4)),
        stress=found.stress,
        plastic_strain=e_p,
        elastic_stress=sigma_e,
        peeq=peeq,
        weight=np.array([2.0]),
        material=VonMises(ELASTIC, HARDENING),
    )
    return fields, found


def contact_fields(r, motion, mu=0.3, *, cap=np.inf, tied=False, largest=None, present=None, stiffness=1.0):
    """One contact whose numbers have no round-off."""
    size = float(np.abs(r).max()) if largest is None else largest
    return ContactFields(
        r=np.array(r, dtype=float),
        motion=np.array(motion, dtype=float),
        mu=np.array([mu]),
        cap=np.array([cap]),
        tied=np.array([tied]),
        stiffness=np.array([stiffness]),
        largest=size,
        present=size if present is None else present,
        blur=np.zeros(1),
    )


def certified(contact, material, residual=0.0, force=1.0, blur=0.0, size=1.0, work=0.0):
    balance = Balance(np.array([residual]), force, blur, *np.zeros((3, 0)))
    return certify(contact, material, balance, size, work)


def test_material_gap_is_zero_after_a_return_and_positive_off_it():
    exact, found = material_fields()
    assert abs(material_gaps(exact)[0]) < 1e-12
    wrong, _ = material_fields(0.9)
    lost = 0.1 * found.plastic_strain @ ELASTIC.stiffness(4)
    mismatch = 0.5 * float(np.sum(lost * (lost @ ELASTIC.compliance(4))))
    hardening = 0.9 * found.dpeeq[0] * (HARDENING.yield_stress(wrong.peeq)[0] - HARDENING.yield_stress(exact.peeq)[0])
    assert material_gaps(wrong)[0] == pytest.approx(2.0 * (mismatch + abs(hardening)), rel=1e-9)


EMPTY = contact_fields([[0.0, 0.0]], [[0.0, 0.0]], largest=1.0)


@pytest.mark.parametrize(
    ("residual", "force", "blur", "found"),
    [(1e-17, 2e-17, 1e-16, 0.0), (1e-15, 1e-17, 1e-16, np.inf), (1e-9, 1.0, 1e-16, 1e-9), (0.0, 0.0, 0.0, 0.0)],
)
def test_a_tool_without_forces_but_round_off_is_in_balance(residual, force, blur, found):
    tools = (np.array([number]) for number in (residual, force, blur))
    assert Balance(np.zeros(1), 1.0, 0.0, *tools).tools == found


def test_zero_over_zero_counts_as_met_and_a_force_without_scale_does_not():
    exact, _ = material_fields()
    calm = certified(EMPTY, exact, force=0.0)
    assert (calm.equilibrium, calm.cone_violation, calm.law) == (0.0, 0.0, 0.0)
    assert certified(EMPTY, exact, residual=1.0, force=0.0).equilibrium == np.inf


def test_what_round_off_alone_makes_is_neither_passed_nor_refused():
    exact, _ = material_fields()
    blurred = certified(EMPTY, exact, residual=0.9, force=1.0, blur=1.0)
    assert blurred.equilibrium == 0.9
    assert blurred.ratios(Bounds())["equilibrium"] == pytest.approx(0.9)
    assert "equilibrium" in blurred.below_resolution(Bounds())
    sharp = certified(EMPTY, exact, residual=0.9, force=1.0, blur=1e-9)
    assert sharp.ratios(Bounds())["equilibrium"] == pytest.approx(0.9 / Bounds().equilibrium)
    assert sharp.below_resolution(Bounds()) == ()


def test_the_gap_is_relative_to_the_energy_that_occurred():
    """Here what the point dissipated and stored, or the work where that is more; pulling is a cone violation."""
    exact, found = material_fields()
    contact = contact_fields([[-0.5, 0.0]], [[0.2, 0.0]], largest=2.0)
    sigma_y = HARDENING.yield_stress(exact.peeq)[0]
    stored = found.stress[0] @ ELASTIC.compliance(4) @ found.stress[0] / 2
    occurred = 2.0 * max(sigma_y * found.dpeeq[0], stored)
    measured = certified(contact, exact)
    assert measured.cone_violation == 0.25
    assert measured.relative_gap == pytest.approx(0.1 / occurred)
    assert certified(contact, exact, work=-40.0).relative_gap == pytest.approx(0.1 / 40.0)


def test_a_long_slide_does_not_excuse_the_material():
    """A pad that slides a kilometre works a million times what its body dissipates."""
    wrong, _ = material_fields(0.9)
    resting = certified(EMPTY, wrong)
    sliding = certified(contact_fields([[1.0, -0.3]], [[0.0, 1e6]], largest=1.0), wrong, work=0.3e6)
    assert sliding.contact_gap < 1e-9
    assert sliding.relative_gap == pytest.approx(resting.relative_gap)
    assert resting.relative_gap > 1e-4


def test_a_body_that_is_only_moved_has_no_material_gap():
    """Its stress is turned with it: no strain, no energy, and nothing to be measured by them."""
    exact, found = material_fields()
    carried = replace(
        exact,
        before=found.stress,
        elastic_stress=found.stress,
        plastic_strain=np.zeros((1, 4)),
    )
    moved = certified(contact_fields([[1.0, -0.3]], [[0.0, 1e6]], largest=1.0), carried, work=0.3e6)
    assert moved.relative_gap < 1e-15


def test_a_wrong_force_without_slip_shows_in_the_law_alone():
    """Sliding by 1e-12 with half the friction force: no energy, but half of mu r_n is missing."""
    mu, slip = 0.3, 1e-12
    measured = certified(contact_fields([[1.0, -mu / 2]], [[0.0, slip]], mu, stiffness=1e13), material_fields()[0])
    assert measured.contact_gap < 1e-12
    assert measured.law > 0.1
    right = certified(contact_fields([[1.0, -mu]], [[0.0, slip]], mu, stiffness=1e13), material_fields()[0])
    assert right.law < 1e-15


@pytest.mark.parametrize(("depth", "blur", "law"), [(1e-12, 0.0, np.inf), (1e-12, 2e-9, 0.0), (-1e-12, 0.0, 0.0)])
def test_without_a_force_the_law_is_met_to_round_off_or_not_met(depth, blur, law):
    """A contact penetrated by ``depth`` that carries nothing, where no contact carries anything."""
    none = contact_fields([[0.0, 0.0]], [[-depth, 0.0]], stiffness=1e3)
    assert certified(none, material_fields()[0], blur=blur).law == law


@pytest.mark.parametrize(("slip", "blur", "gap"), [(1e-12, 0.0, np.inf), (1e-12, 1e-11, 0.0), (0.0, 0.0, 0.0)])
def test_without_energy_the_gap_is_met_to_round_off_or_not_met(slip, blur, gap):
    """A tool and a body at rest: what is left of a gap under a force is round-off, and there is no work beside it."""
    resting, _ = material_fields(plastic_factor=0.0)
    still = replace(
        resting,
        before=0 * resting.stress,
        stress=0 * resting.stress,
        plastic_strain=0 * resting.plastic_strain,
        elastic_stress=0 * resting.stress,
    )
    contact = replace(contact_fields([[1.0, 0.0]], [[slip, 0.0]], largest=1.0, present=1.0), blur=np.array([blur]))
    found = certified(contact, still)
    assert found.relative_gap == gap
    assert found.ratios(Bounds())["relative_gap"] == gap


def test_nan_is_never_within_bounds():
    certificate = Certificate(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert max(certificate.ratios(Bounds()).values()) == 0.0
    broken = replace(certificate, equilibrium=float("nan"))
    assert not broken.ratios(Bounds())["equilibrium"] <= 1


def test_welded_points_count_the_work_on_the_motion_they_forbid():
    contact = contact_fields([[-1.0, 5.0]], [[0.1, -0.2]], np.inf, tied=True)
    assert contact_gaps(contact) == pytest.approx(0.1 + 1.0)


def test_each_resolution_is_what_round_off_of_forces_and_motions_may_give():
    """By hand: forces are good to 1e-8, the motion to 1e-9; on springs of 4 forces move it by a quarter of theirs."""
    exact, _ = material_fields()
    exactly = partial(pytest.approx, rel=1e-9, abs=0.0)
    eps, slip = 8 * np.finfo(float).eps, 3e-4
    contact = contact_fields([[2.0, -0.5]], [[0.0, slip]], largest=5.0, present=4.0, stiffness=4.0)
    found = certified(replace(contact, blur=np.array([1e-9])), exact, force=2.0, blur=1e-8, work=1e3).resolution
    assert found.equilibrium == exactly(1e-8 / 2.0)
    assert found.cone_violation == exactly(1e-8 / 5.0)
    assert found.law == exactly((1e-8 + 4.0 * 1e-9) / 4.0)
    by_motion, by_force = np.hypot(2.0, 0.5) * (1e-9 + 1e-8 / 4.0), 1e-8 * slip
    assert found.relative_gap == exactly((by_motion + by_force) / 1e3)
    surface = float(HARDENING.yield_stress(exact.peeq)[0])
    assert found.yield_violation == exactly(2 * eps * np.abs(exact.stress).max() / surface)
    # A motion shorter than what forces move it by, and one that is itself all round-off.
    short = contact_fields([[2.0, -0.5]], [[0.0, 1e-10]], largest=5.0, present=4.0, stiffness=4.0)
    found = certified(replace(short, blur=np.array([1e-11 * eps])), exact, blur=1e-2, work=1e3).resolution
    by_motion, by_force = np.hypot(2.0, 0.5) * (1e-11 * eps + 1e-10), 1e-2 * 1e-11
    assert found.relative_gap == exactly((by_motion + by_force) / 1e3)


def test_where_nothing_may_touch_no_contact_force_has_round_off():
    exact, _ = material_fields()
    none = replace(
        contact_fields([[0.0, 0.0]], [[0.0, 0.0]], largest=1.0),
        **{name: np.zeros((0, *shape)) for name, shape in {"r": (2,), "motion": (2,), "mu": (), "cap": ()}.items()},
        tied=np.zeros(0, dtype=bool),
        stiffness=np.zeros(0),
        blur=np.zeros(0),
    )
    found = certified(none, exact, blur=1e-8, work=1e3).resolution
    assert (found.cone_violation, found.law, found.relative_gap) == (0.0, 0.0, 0.0)
    assert found.equilibrium == 1e-8


def test_a_large_coefficient_softens_the_scale_of_the_law():
    """Within the cone nothing is cut off: the residual is rho (mu |u_t|, u_t), with rho a third of the stiffness."""
    slip = 1e-3
    found = certified(contact_fields([[1.0, 0.0]], [[0.0, slip]], 3.0, stiffness=6.0), material_fields()[0])
    assert found.law == pytest.approx(2.0 * slip * np.hypot(3.0, 1.0))


def test_the_cone_is_over_the_largest_force_of_the_run_and_the_law_over_that_of_the_increment():
    """A pull of one on a closed contact: one outside of the cone, and by the law one too much."""
    exact, _ = material_fields()
    found = certified(contact_fields([[-1.0, 0.0]], [[0.0, 0.0]], largest=8.0, present=4.0), exact)
    assert found.cone_violation == 1.0 / 8.0
    assert found.law == 1.0 / 4.0


def test_what_held_nodes_are_inside_tools_is_penetration_too():
    exact, _ = material_fields()
    shallow = contact_fields([[1.0, 0.0]], [[-0.1, 0.0]])
    assert certified(replace(shallow, inside=0.2), exact, size=4.0).penetration == pytest.approx(0.05)
    assert certified(replace(shallow, inside=0.05), exact, size=4.0).penetration == pytest.approx(0.025)


@pytest.mark.parametrize(("blur", "hidden"), [(0.99, ()), (1.01, ("equilibrium",))])
def test_a_measure_decides_while_round_off_is_less_than_its_bound(blur, hidden):
    exact, _ = material_fields()
    found = certified(EMPTY, exact, blur=blur * Bounds().equilibrium)
    assert found.below_resolution(replace(Bounds.none(), equilibrium=Bounds().equilibrium)) == hidden


def test_an_infinite_measure_without_a_bound_is_met():
    """Beside no forces the law is: it was infinity over infinity, which no increment met."""
    exact, _ = material_fields()
    found = certified(contact_fields([[0.0, 0.0]], [[-0.1, 0.0]], present=0.0), exact)
    assert found.law == np.inf
    assert found.ratios(Bounds())["law"] == np.inf
    assert not any(found.ratios(Bounds.none()).values())


def test_what_is_no_number_is_met_by_no_measure():
    """Without bounds forces that are not numbers were taken: the march ended at the energies they had made."""
    assert np.isnan(over_bound(np.nan, np.inf))
