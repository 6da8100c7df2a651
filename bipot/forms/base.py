"""Shared by all forms: the step that a form returns, and the data computed once in a run.

A form turns an iterate and its contact forces into the next ones. What it carries from pass to pass is its state, a
value: ``init`` makes it from the iterate at which an increment starts, and every ``step`` returns a new one. All else
in an increment is shared by the forms, so that comparisons between them are fair.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar, Protocol, TypeVar, runtime_checkable

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import Claim, Timing
from bipot.conic.solver import Handle
from bipot.forms.memory import Pace, Setup, ordered
from bipot.iterate import Increment, Iterate
from bipot.programs.condensation import Split, touched
from bipot.programs.conic import TangentProgram
from bipot.programs.data import ContactRows
from bipot.programs.fixed_point import Coupled, Route
from bipot.programs.frames import Frames
from bipot.programs.ordering import Pattern
from bipot.typing import Floats

S = TypeVar("S")


class FormName(Enum):
    """Names of the forms on the command line and in a history."""

    TANGENT = "tangent"
    DISSIPATION = "dissipation"
    PENALTY = "penalty"
    UZAWA = "uzawa"
    NEWTON = "newton"
    DELASSUS = "delassus"


@dataclass(frozen=True)
class Step:
    """One pass: the next iterate, contact forces r (c, d) of all candidates, the solver's claim, and the cost.

    ``coupled`` says how friction was coupled to the normal forces. If the form *poses* another contact law than
    Coulomb's, ``posed`` is the distance of the answer from that law, over the largest force; acceptance then requires
    this law, equilibrium and yield, and the certificate is only reported. None stands for Coulomb's law, with which the
    whole certificate is required. ``error`` is the distance from equilibrium and the law together, over the contact
    forces; inf if the form does not compute it.
    """

    iterate: Iterate
    r: Floats
    outcome: Claim
    iterations: int
    timing: Timing
    coupled: Coupled = Coupled(Route.EXACT)
    posed: float | None = None
    error: float = math.inf


@dataclass
class Cache:
    """What a march keeps: orderings and patterns, computed once, the predictor, and the solvers' last programs."""

    pace: Pace = field(default_factory=Pace)
    handles: dict[FormName, Handle] = field(default_factory=dict)
    _split: Split | None = None
    _setup: Setup | None = None
    _pattern: Pattern | None = None
    _frames: tuple[bytes, Frames] | None = None

    def begin(self, pace: Pace) -> None:
        """Begin an increment at this ``pace``; drop what depends on numbers of earlier increments."""
        self.pace = pace
        self.handles.clear()

    def split(self, program: TangentProgram) -> Split:
        """The split of the run's stiffness pattern on the unknowns that contact rows touch."""
        K, kept = sp.csc_matrix(program.K), touched(program.contact.rows, len(program.f))
        # Only the last one is kept: a run meets many sets of candidates, and a split is as large as the pattern.
        if self._split is None or not np.array_equal(self._split.kept, kept):
            self._split = Split.of(K, kept)
        return self._split

    def setup(self, iterate: Iterate) -> Setup:
        """The setup of Newton for the run."""
        if self._setup is None:
            self._setup = Setup.of(iterate.increment.system, self._ordered(iterate))
        return self._setup

    def frames(self, rows: ContactRows, iterate: Iterate) -> Frames:
        """Where contact ``rows`` of a program posed at an iterate sit in the run's stiffness; kept for equal rows."""
        parts = [a for G in (rows.G_n, rows.G_t) for a in (G.indptr, G.indices, G.data)]
        key = b"".join(np.ascontiguousarray(a).tobytes() for a in (*parts, rows.frictional, rows.dragged))
        if self._frames is None or self._frames[0] != key:
            self._frames = key, Frames.of(rows, self._ordered(iterate))
        return self._frames[1]

    def _ordered(self, iterate: Iterate) -> Pattern:
        """The run's stiffness pattern in its order of elimination."""
        if self._pattern is None:
            system = iterate.increment.system
            # By what faces each other at rest: of a march that goes on from a course the order is the same.
            rest = Increment(system.facing(system.body.scene.mesh.nodes), system.rest(), 0.0)
            # Within one part and with coordinates of tools, on which all forces act, orders are better without.
            between = system.candidates.between
            self._pattern = ordered(system.body.space, rest.rows.take(between) if between.any() else None)
        return self._pattern


@runtime_checkable
class Form(Protocol[S]):
    """One way to solve a pass; S is its state."""

    name: ClassVar[FormName]
    """Its name in the history."""

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> S:
        """The state before the first pass of an attempt, which starts from ``iterate`` and forces r (c, d)."""
        ...

    def step(self, iterate: Iterate, r: Floats, state: S) -> tuple[Step, S]:
        """One pass, from the last step's iterate and forces or the first ones; may raise any error of an attempt."""
        ...
