"""Reasons why a form failed, flow was not carried on or an increment was cut: data that also prints as a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from bipot.errors import InvertedElement, NotConverged, UnsuitedForm
from bipot.forms import FormName


class ReasonKind(Enum):
    """What happened."""

    UNSUITED = "unsuited"
    """A form cannot treat the scene."""
    NOT_CONVERGED = "not converged"
    """Measures stayed above their bounds."""
    PROGRAM = "program"
    """A program was singular, infeasible, unbounded or not solved."""
    FOLDED = "folded"
    """An iterate or the answer had an element that is folded."""
    DISSIPATION = "dissipation"
    """A dissipation of the answer is negative."""
    FLOW = "flow"
    """The last flow was not carried on."""
    CUT = "cut"
    """The increment was halved."""
    ACCURACY = "accuracy"
    """Shortened because its estimated error was above the accuracy, or a face landed just before it was to end."""
    LANDING = "landing"
    """Cut to where a node lands."""
    ALMOST = "almost"
    """Passes whose solver claimed less than the requested accuracy."""


@dataclass(frozen=True)
class Reason:
    """A reason in words and numbers: measures over their bounds, energies, a node, counts."""

    kind: ReasonKind
    said: str
    form: FormName | None = None
    measures: Mapping[str, float] = field(default_factory=dict)

    @staticmethod
    def of(form: FormName, failure: Exception) -> Reason:
        """Why ``form`` failed."""
        kinds = {
            UnsuitedForm: ReasonKind.UNSUITED,
            NotConverged: ReasonKind.NOT_CONVERGED,
            InvertedElement: ReasonKind.FOLDED,
        }
        kind = next((kind for error, kind in kinds.items() if isinstance(failure, error)), ReasonKind.PROGRAM)
        return Reason(kind, str(failure), form, getattr(failure, "residuals", None) or {})

    def __str__(self) -> str:
        """The sentence, after the name of the form if it is about one."""
        return self.said if self.form is None else f"{self.form.value}: {self.said}"
