"""Least squares by unknowns that are not negative: what is found meets the conditions of the least.

Before version 1.16 what scipy found did not.
"""

import numpy as np

from bipot.basics.nonnegative import nonnegative


def test_what_is_found_is_least():
    """Gradients g = A'(A w - b) are not negative, and zero where w is positive."""
    random = np.random.default_rng(0)
    for _ in range(500):
        A = random.standard_normal(random.integers(1, 7, 2))
        b = random.standard_normal(len(A))
        w = nonnegative(A, b)
        assert w is not None
        g = A.T @ (A @ w - b)
        assert w.min() >= 0
        assert g.min() >= -1e-10
        assert abs(g @ w) <= 1e-10


def test_of_two_columns_the_better_one_is_taken():
    found = nonnegative(np.array([[-1.0, -0.8], [1.0, 1.0]]), np.array([0.0, 1.0]))
    assert found is not None
    np.testing.assert_allclose(found, [0.0, 1 / 1.64], rtol=1e-12)
