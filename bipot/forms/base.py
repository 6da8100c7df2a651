"""What every form shares: the pass it is given, the answer it returns, and what it may keep between passes.

A form turns a :class:`Pass` (response at the last iterate, contact rows, frozen threshold) into the next
displacement and contact forces. Everything else of an increment is shared, so comparisons are fair by construction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.conic.solver import Handle
from bipot.forms.memory import Memory, Pace
from bipot.programs.condensation import Split, touched
from bipot.programs.data import ContactRows, Outcome, Stopwatch, Timing, Units
from bipot.programs.polish import Elimination
from bipot.response import Body, Response

Floats = NDArray[np.float64]


class FormName(Enum):
    """Names of the forms on the command line and in a history."""

    TANGENT = "tangent"
    DISSIPATION = "dissipation"
    PENALTY = "penalty"
    UZAWA = "uzawa"
    NEWTON = "newton"
    DELASSUS = "delassus"


@dataclass(frozen=True)
class Pass:
    """What a form is given for one pass.

    Body and response at the iterate, contact rows of c candidates, their frozen threshold s (f,), gap at the start
    of the increment (c,), contact forces (c, d) at that start and after the last pass, load F (n,), units; De Saxce's
    shift (f,) where that is frozen in the place of the threshold.
    """

    body: Body
    response: Response
    rows: ContactRows
    threshold: Floats
    start_gap: Floats
    start_forces: Floats
    last_forces: Floats
    force: Floats
    units: Units
    shift: Floats | None = None


@dataclass(frozen=True)
class Answer:
    """The next iterate: free displacement x (n,), contact forces r (c, d), and what the solver claimed.

    ``posed`` is how far (x, r) is from the contact law the form *poses*, over the largest force; exact forms leave
    it to the certificate. ``response`` is the body's response to x, when the form has evaluated it already.
    ``coupled`` marks an answer that obeys Coulomb's law on its model: what was frozen to get there no longer counts.
    """

    x: Floats
    r: Floats
    outcome: Outcome
    iterations: int
    timing: Timing
    posed: float = 0.0
    response: Response | None = None
    coupled: bool = False


class Measured(NamedTuple):
    """How far a response with contact forces on ``rows`` was from equilibrium and law."""

    response: Response
    rows: ContactRows
    distance: float


@dataclass
class Workspace:
    """What the forms keep during a run: the one mutable thing, owned by the march.

    ``handles`` are what their solvers keep of the last program; ``assembly`` counts the seconds of the body's
    responses and tangents.
    """

    newton: Memory | None = None
    pace: Pace = field(default_factory=Pace)
    last_split: Split | None = None
    elimination: Elimination | None = None
    assembly: Stopwatch = field(default_factory=Stopwatch)
    measured: Measured | None = None
    handles: dict[FormName, Handle] = field(default_factory=dict)

    def split(self, K: sp.csc_matrix, rows: ContactRows) -> Split:
        """The split of the run's stiffness pattern on the unknowns that ``rows`` touch."""
        kept = touched(rows, len(K.indptr) - 1)
        # The last one only: a run meets many sets of candidates, and each split is as large as the pattern.
        if self.last_split is None or not np.array_equal(self.last_split.kept, kept):
            self.last_split = Split.of(K, kept)
        return self.last_split

    def eliminate(self, K: sp.csc_matrix, rows: ContactRows) -> None:
        """How the polish eliminates the contacts of ``rows`` (the last ones only) from a stiffness of K's pattern."""
        self.elimination = Elimination.of(K, rows, self.elimination)


@runtime_checkable
class Form(Protocol):
    """One way to solve a pass."""

    name: ClassVar[FormName]
    """How the history calls it."""

    exact: ClassVar[bool]
    """Whether it poses the exact law: acceptance then asks for the whole certificate.

    Otherwise equilibrium, yield and ``Answer.posed`` decide, and the certificate only reports.
    """

    shifts: ClassVar[bool]
    """Whether a pass may freeze De Saxce's shift instead of the threshold."""

    nearby: ClassVar[bool]
    """Whether contact rows cost it: then only candidates near their tool get any."""

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """Next displacement and forces; raises ProgramError and its kin."""
        ...
