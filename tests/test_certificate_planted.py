"""Each measure of the certificate of an increment rises by the right amount under a planted error of known size."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import (
    Bounds,
)
from bipot.checks.examined import Examined
from bipot.iterate import Increment, Iterate
from bipot.marching import system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from tests.scenes import PLANES, fresh, run
from tests.test_independent_sampling import curved, under_a_punch


@pytest.fixture(scope="module")
def accepted():
    return run(0.3)[7]


@pytest.fixture(scope="module")
def system():
    return fresh(0.3, reduction=0.1, elements=4)


def recertify(system, accepted, **changes):
    """The certificate of an accepted increment with some of its fields replaced."""
    solved = accepted.solved
    response, r = changes.get("response", solved.response), changes.get("r", solved.r)
    start = replace(response.state, gap=changes.get("gap", response.state.gap))
    increment = Increment(system, start, accepted.state.tau)
    return Examined(Iterate(increment, response), r, float(np.abs(solved.r).max())).certificate


def test_the_accepted_increment_is_certified(system, accepted):
    clean = recertify(system, accepted)
    assert clean == accepted.solved.certificate
    assert max(clean.ratios(Bounds()).values()) <= 1


def test_nodal_force_shows_in_equilibrium(system, accepted):
    """An extra force of size p on one node gives p over the largest nodal sum of |element forces|."""
    r = accepted.solved.r.copy()
    node = int(np.argmax(r[:, 0]))
    extra = 1e-3 * r[node, 0]
    r[node, 0] += extra
    scale = system.body.space.force_scale(accepted.solved.response.element_forces, np.zeros((1, 2)))
    assert recertify(system, accepted, r=r).equilibrium == pytest.approx(extra / scale, rel=1e-3)


def test_threshold_one_per_cent_off_shows_in_the_cone_and_in_the_gap(system, accepted):
    """|r_t| = 1.01 mu r_n on sliding points: cone by 0.01 mu r_n, gap by 0.01 mu r_n |du_t| each."""
    solved = accepted.solved
    motion = solved.rows.motion(solved.response.x)
    sliding = np.abs(motion[:, 1]) > 1e-6
    assert sliding.sum() >= 2
    r = solved.r.copy()
    r[sliding, 1] *= 1.01
    planted = recertify(system, accepted, r=r)
    excess = 0.01 * 0.3 * solved.r[sliding, 0]
    assert planted.cone_violation == pytest.approx(excess.max() / np.abs(r).max(), rel=1e-2)
    assert planted.contact_gap == pytest.approx(np.sum(excess * np.abs(motion[sliding, 1])), rel=1e-6)


def test_threshold_one_per_cent_low_shows_in_the_gap_alone(system, accepted):
    solved = accepted.solved
    motion = solved.rows.motion(solved.response.x)
    sliding = np.abs(motion[:, 1]) > 1e-6
    r = solved.r.copy()
    r[sliding, 1] *= 0.99
    planted = recertify(system, accepted, r=r)
    missing = 0.01 * 0.3 * solved.r[sliding, 0] * np.abs(motion[sliding, 1])
    assert planted.cone_violation <= accepted.solved.certificate.cone_violation
    assert planted.contact_gap == pytest.approx(missing.sum(), rel=1e-6)


def test_penetration_is_measured_by_the_body_size(system, accepted):
    rows = accepted.solved.rows
    depth = 1e-3
    planted = recertify(system, accepted, gap=accepted.start.gap - depth)
    touching = rows.motion(accepted.solved.response.x)[:, 0].min()
    assert planted.penetration == pytest.approx((depth - touching) / system.body.scene.mesh.size)
    pushed = accepted.solved.r[:, 0].sum() * depth
    assert planted.contact_gap == pytest.approx(pushed, rel=1e-6)


def test_stress_off_the_surface_shows_in_yield_and_in_the_material_gap(system, accepted):
    solved = accepted.solved
    returned = solved.response.returned
    point = np.unravel_index(np.argmax(returned.dpeeq), returned.dpeeq.shape)
    stress = returned.stress.copy()
    pressure = stress[point][:3].mean()
    stress[point] = 1.01 * (stress[point] - pressure * np.array([1, 1, 1, 0])) + pressure * np.array([1, 1, 1, 0])
    response = replace(solved.response, returned=replace(returned, stress=stress))
    planted = recertify(system, accepted, response=response)
    assert planted.yield_violation == pytest.approx(0.01, rel=1e-6)
    weight = solved.response.kinematics.volume[point]
    fenchel = -0.01 * 300.0 * returned.dpeeq[point]
    elastic = (0.01 * 300.0) ** 2 / (6 * system.body.scene.material.elasticity.shear)
    assert planted.material_gap == pytest.approx(weight * (abs(fenchel) + elastic), rel=1e-6)


@pytest.mark.parametrize("geometry", PLANES)
def test_law_is_scaled_by_the_force_that_moves_a_mean_by_one(geometry):
    """The least energy of springs at its nodes, by its own multiplier."""
    system = system_of(under_a_punch(curved(block(10.0, 6.0, 3, 2, element=Element.Q8)), geometry))
    nodal, weights = system.body.rigidity.nodal, system.candidates.means.weights.toarray()
    springs = np.diag(nodal)
    for row, found in zip(weights, system.stiffness, strict=True):
        bordered = np.block([[springs, -row[:, None]], [row[None], np.zeros((1, 1))]])
        assert found == pytest.approx(np.linalg.solve(bordered, np.append(np.zeros(len(row)), 1.0))[-1], rel=1e-10)
    assert (system.stiffness > 1.3 * nodal[system.candidates.node]).any()
