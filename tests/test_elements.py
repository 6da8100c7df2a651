"""Quadrature: all monomials of the rule's degree on the square, exactly; and shape functions."""

import numpy as np
import pytest

from bipot.fem.elements import Quadrature, line3, quad8, radon7


def moment(i, j):
    return (2 / (i + 1) if i % 2 == 0 else 0.0) * (2 / (j + 1) if j % 2 == 0 else 0.0)


def integral(i, j):
    points, weights = radon7()
    return float(weights @ (points[:, 0] ** i * points[:, 1] ** j))


@pytest.mark.parametrize(("i", "j"), [(i, j) for i in range(6) for j in range(6 - i)])
def test_radon_integrates_the_21_monomials_of_degree_five(i, j):
    assert integral(i, j) == pytest.approx(moment(i, j), abs=1e-15)


def test_radon_first_failures():
    assert integral(6, 0) == pytest.approx(12 / 25)
    assert integral(0, 6) != pytest.approx(moment(0, 6))
    assert integral(2, 4) != pytest.approx(moment(2, 4))


def test_radon_is_not_symmetric_and_its_axis_pair_lies_along_the_second_axis():
    points, _ = radon7()
    assert np.sum((points[:, 0] == 0) & (points[:, 1] != 0)) == 2
    assert np.sum((points[:, 1] == 0) & (points[:, 0] != 0)) == 0


@pytest.mark.parametrize(("rule", "points"), [(Quadrature.RADON7, 7), (Quadrature.GAUSS2, 4), (Quadrature.GAUSS3, 9)])
def test_shapes_are_a_partition_of_unity(rule, points):
    table = quad8(rule)
    assert table.values.shape == (points, 8)
    np.testing.assert_allclose(table.values.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(table.gradients.sum(axis=1), 0.0, atol=1e-14)
    assert table.weights.sum() == pytest.approx(1.0)


def test_line_reproduces_quadratics():
    table, nodes = line3(), np.array([0.0, 0.5, 1.0])
    x = table.points[:, 0]
    np.testing.assert_allclose(table.values @ nodes**2, x**2, atol=1e-15)
    np.testing.assert_allclose(table.gradients[:, :, 0] @ nodes**2, 2 * x, atol=1e-14)
