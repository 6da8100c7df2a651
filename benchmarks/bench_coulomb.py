"""Cost of each Coulomb solver on the same problem: a pile of 53 contacts, hyperstatic, mu = 1.

    pytest benchmarks/bench_coulomb.py --benchmark-enable

Every solver is asked for 1e-8 in 10 s; the residual it reached is recorded with its time.
"""

from pathlib import Path

import pytest

from bipot import coulomb
from studies.coulomb_profiles import SOLVERS

PILE = Path(__file__).parents[1] / "tests" / "data" / "fclib" / "pile_mu1p0-00060-nc53.hdf5"
LIMITS = coulomb.Limits(tol=1e-8, seconds=10.0)


@pytest.mark.parametrize("name", SOLVERS)
def test_one_problem(benchmark, name):
    problem, solver = coulomb.reduced(coulomb.read_fclib(PILE)), SOLVERS[name]

    def once():
        return coulomb.solve(problem, LIMITS) if solver is None else coulomb.run(solver, problem, LIMITS)

    answer = benchmark.pedantic(once, rounds=3)
    benchmark.extra_info.update(outcome=answer.outcome.value, residual=answer.residual(), steps=answer.iterations)


def test_existence(benchmark):
    problem = coulomb.reduced(coulomb.read_fclib(PILE))
    assert benchmark(coulomb.existence, problem).verdict is not coulomb.Existence.NONE
