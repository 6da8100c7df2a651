"""What every upsetting study marches with: friction, material, increments, form, solver; and what follows of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from bipot.conic.clarabel import Clarabel
from bipot.conic.qoco import Qoco
from bipot.conic.solver import ConicSolver
from bipot.conic.through_cvxpy import Cvxpy, cone_solvers
from bipot.errors import SceneError, require
from bipot.fem.elements import Quadrature
from bipot.fem.strain import Configuration
from bipot.forms import (
    Delassus,
    Dissipation,
    Form,
    FormName,
    Newton,
    Penalty,
    Tangent,
    Uzawa,
    contact_penalty,
)
from bipot.laws.hardening import Hardening
from bipot.marching import Control, Schedule, system_of
from bipot.results.columns import Column
from bipot.scene.scene import Scene
from studies.element_types import AnyType
from studies.hardening_words import hardening_from_text
from studies.upsetting_columns import history_columns

# First yield with friction defeats larger increments (fraction of the height).
FIRST, SETTLING = 0.001, 5
PAPERS_CURVE = "perfect:300"
# Refreshing the traction converges the faster the larger the penalty; it costs no accuracy there.
UZAWA_FACTOR = 1e4


PENALISED = (FormName.PENALTY, FormName.UZAWA)
ROUTED = (FormName.TANGENT, FormName.DISSIPATION)
"""Forms that pose conic programs, which any solver may take."""

DIRECT: Mapping[str, ConicSolver] = {"clarabel": Clarabel()} | ({"qoco": Qoco()} if find_spec("qoco") else {})
THROUGH = "cvxpy:"
DEFAULT_SOLVER = f"{THROUGH}clarabel"
ABOUT_SOLVERS = f"""\
solvers: a conic program reaches its solver by one of two routes, of equal answers. {THROUGH}NAME poses each increment
as the cvxpy statement of its program and gives it to the solver of that name, as tangent and dissipation do here by
default ({DEFAULT_SOLVER}). clarabel and qoco take the same data without cvxpy; the library's Tangent() and
Dissipation() go to clarabel unless told otherwise. newton, penalty, uzawa and delassus solve their passes directly;
fallbacks of newton and delassus take --solver's default. The route is stored with the run's parameters.
"""


def solver_of(text: str) -> ConicSolver:
    """clarabel, qoco, or cvxpy:NAME of a solver that cvxpy finds installed; raises SceneError."""
    if text in DIRECT:
        return DIRECT[text]
    name = text.removeprefix(THROUGH).upper()
    if text.startswith(THROUGH):
        installed = cone_solvers()
        require(name in installed, "--solver", text, f"{THROUGH} and one of {', '.join(installed).lower()}")
        return Cvxpy(name)
    raise SceneError(f"--solver = {text!r}: must be one of {', '.join(DIRECT)}, or {THROUGH}NAME")


@dataclass(frozen=True, kw_only=True)
class Upset(ABC):
    """One run: the choices of the march and of the material, as asked on the command line; a study adds its body's."""

    mu: float
    elements: int
    element: AnyType
    quadrature: Quadrature
    increments: int | None
    form: FormName
    solver: str
    configuration: Configuration
    reduction: float
    hardening: str
    kn: float | None = None
    kt: float | None = None
    accuracy: float | None = None
    height: float = 10.0
    young: float = 210_000.0
    poisson: float = 0.3

    @abstractmethod
    def scene(self) -> Scene:
        """The body between its platens; raises SceneError on bad input."""

    def columns(self) -> list[Column]:
        """The columns of ``history.csv``."""
        return history_columns(self.reduction)

    @property
    def folder(self) -> str:
        """Where its results are: no two coefficients share one."""
        short = f"{self.mu:g}"
        return f"mu{short if float(short) == self.mu else repr(self.mu)}"

    def curve(self) -> Hardening:
        """The hardening curve asked for."""
        return hardening_from_text(self.hardening)

    def schedule(self) -> Schedule:
        """As an accuracy asks; else start-up increments of 0.1 % of the height under friction, none without."""
        if self.accuracy is not None:
            return Schedule(accuracy=self.accuracy)
        if self.mu == 0:
            return Schedule(self.increments)
        shortest = FIRST * SETTLING
        require(
            self.reduction > shortest,
            "reduction",
            self.reduction,
            f"> {shortest}, the start-up under friction",
        )
        return Schedule(self.increments, FIRST / self.reduction, SETTLING)

    def control(self) -> Control:
        """The form with its fallbacks; a penalised one has none, because an exact one would change the law."""
        solver = solver_of(self.solver)
        tangent, dissipation = Tangent(solver=solver), Dissipation(solver=solver)
        choices: dict[FormName, tuple[Form, tuple[Form, ...]]] = {
            FormName.TANGENT: (tangent, (dissipation,)),
            FormName.DISSIPATION: (dissipation, ()),
            FormName.NEWTON: (Newton(), (tangent, dissipation)),
            FormName.DELASSUS: (Delassus(), (dissipation,)),
            FormName.PENALTY: (Penalty(*self.penalties(1.0)), ()),
            FormName.UZAWA: (Uzawa(*self.penalties(UZAWA_FACTOR)), ()),
        }
        form, fallbacks = choices[self.form]
        return Control(form, fallbacks)

    def penalties(self, factor: float) -> tuple[float, float]:
        """K_n and K_t, N/mm per contact point; unless asked ``factor`` E/h of its edges (:func:`contact_penalty`)."""
        default = contact_penalty(system_of(self.scene()).candidates, factor)
        return default if self.kn is None else self.kn, default if self.kt is None else self.kt

    def parameters(self) -> dict[str, Any]:
        """What identifies the run in its folder."""
        asked = {k: getattr(v, "value", v) for k, v in vars(self).items()}
        return asked | {"solver": self.route()}

    def route(self) -> str:
        """How the run's conic programs reach their solver, in words."""
        if self.form in ROUTED:
            return self.solver
        fallbacks = f", fallbacks {self.solver}" if self.control().fallbacks else ""
        return f"direct{fallbacks}"
