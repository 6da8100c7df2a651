"""How the increments of a march are solved, as its user chooses."""

from __future__ import annotations

from dataclasses import dataclass

from bipot.control.landing import Locate
from bipot.errors import require, require_count, require_tuple, require_type
from bipot.forms import Dissipation, Form, FormName, Newton, Tangent
from bipot.increment import Limits
from bipot.laws.flow import Integration

PRECISE = 1e-3
"""Largest bound on equilibrium with which answers are precise enough to predict by (:class:`bipot.forms.memory.Pace`).
"""


@dataclass(frozen=True)
class Control:
    """How increments are solved: form and fallbacks, acceptance, how often one may be halved, integration of the flow.

    Where the form fails, the fallbacks are tried in turn, by default the dissipation program last: it takes longest.
    ``locate`` ends an increment where an open candidate lands; None leaves landings inside increments. Where a form did
    not converge, an increment by accuracy is halved up to ``spared`` times, if ``cuts`` allow, before the dissipation
    program is tried: one of its passes takes longer than ten of Newton's, which often converges over half the length.
    If the shortest increments fail too, the program is tried on the longer ones before the march ends. Scheduled
    increments are not halved as long as any form solves them.
    """

    form: Form = Tangent()
    fallbacks: tuple[Form, ...] = (Newton(), Tangent(), Dissipation())
    limits: Limits = Limits()
    cuts: int = 8
    integration: Integration = Integration.BDF2
    locate: Locate | None = None
    spared: int = 2

    def __post_init__(self) -> None:
        require_type(self.form, Form, "control.form")
        object.__setattr__(self, "fallbacks", require_tuple(self.fallbacks, Form, "control.fallbacks"))
        require_type(self.limits, Limits, "control.limits")
        require_count(self.cuts, "cuts", 0)
        require(self.cuts <= 50, "cuts", self.cuts, "at most 50: a pseudo-time has no more digits to halve")
        require_type(self.integration, Integration, "control.integration")
        require_type(self.locate, Locate, "control.locate", optional=True)
        require_count(self.spared, "spared", 0)
        require(self.spared <= 50, "spared", self.spared, "at most 50, as cuts")

    @property
    def forms(self) -> tuple[Form, ...]:
        """The form and its fallbacks without duplicates; the same form with other options counts as another one."""
        forms = (self.form, *self.fallbacks)
        return tuple(form for k, form in enumerate(forms) if form not in forms[:k])

    @property
    def predicts(self) -> bool:
        """Whether an increment starts as the last ones tell beyond a line: where their answers are precise.

        Not in the form ``penalty``: from such starts its fixed point of friction cycles more often, and an increment
        that is cut is another one than the form that it is compared with solves.
        """
        return self.limits.bounds.equilibrium <= PRECISE and self.form.name is not FormName.PENALTY
