"""The discrete Coulomb problem u = W r + q as a library of its own: arrays and sparse operators only.

problem = reduced(read_fclib("pile.hdf5"))      # or CoulombProblem(W, q, mu, dim)
answer = solve(problem)                         # measured, never taken on a solver's word
answer.residual(), answer.bipotential_gap(), answer.reason
"""

from bipot.coulomb.acceleration import Anderson, Damped
from bipot.coulomb.chain import DEFAULT_CHAIN, Stage, solve
from bipot.coulomb.conic import AssociatedSolution, ConicSettings, solve_associated
from bipot.coulomb.fclib import FclibError, read_fclib, read_solution, reduced, write_fclib
from bipot.coulomb.fixed_point import DeSaxceFixedPoint, TrescaFixedPoint
from bipot.coulomb.functions import AlartCurnier, NaturalMap
from bipot.coulomb.gauss_seidel import GaussSeidel
from bipot.coulomb.modes import MultiplicityReport, enumerate_modes, multiplicity
from bipot.coulomb.newton import LineSearch, Newton
from bipot.coulomb.problem import CoulombProblem, GlobalCoulombProblem
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.solution import CoulombSolution, Outcome, natural_residual, residual, unit_free_residual
from bipot.coulomb.solvability import Existence, ExistenceReport, existence
from bipot.coulomb.solver import Limits, Solver, run
from bipot.coulomb.uzawa import Uzawa
from bipot.laws.coulomb import Status

__all__ = [
    "DEFAULT_CHAIN",
    "AlartCurnier",
    "Anderson",
    "AssociatedSolution",
    "ConicSettings",
    "CoulombProblem",
    "CoulombSolution",
    "Damped",
    "DeSaxceFixedPoint",
    "Existence",
    "ExistenceReport",
    "FclibError",
    "GaussSeidel",
    "GlobalCoulombProblem",
    "Limits",
    "LineSearch",
    "MultiplicityReport",
    "NaturalMap",
    "Newton",
    "Outcome",
    "ProximalPoint",
    "Solver",
    "Stage",
    "Status",
    "TrescaFixedPoint",
    "Uzawa",
    "enumerate_modes",
    "existence",
    "multiplicity",
    "natural_residual",
    "read_fclib",
    "read_solution",
    "reduced",
    "residual",
    "run",
    "solve",
    "solve_associated",
    "unit_free_residual",
    "write_fclib",
]
