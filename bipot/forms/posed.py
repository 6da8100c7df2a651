"""The state of the forms that pose a program in every pass: which candidates get rows, and what friction freezes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.contact.closeness import near_tools
from bipot.forms.base import Cache
from bipot.iterate import Iterate
from bipot.programs.data import ContactRows, Units
from bipot.programs.fixed_point import Coupling, Safeguard, image
from bipot.programs.terms import ContactTerms
from bipot.typing import Bools, Floats


@dataclass(frozen=True)
class Posed:
    """The candidates ``near`` (c,) their tool, their contact ``rows``, the coupling of friction, units of the program.

    ``distance`` is that of the last iterate from equilibrium and law on these rows, None where it is not known;
    ``rose`` says that the last pass did not reduce it.
    """

    cache: Cache
    units: Units
    near: Bools
    rows: ContactRows
    coupling: Coupling
    distance: float | None = None
    rose: bool = False

    @staticmethod
    def of(iterate: Iterate, r: Floats, cache: Cache, rule: Safeguard | None = None) -> Posed:
        """Before the first pass; by ``rule`` a pass may freeze De Saxce's shift too, without it the threshold only.

        Candidates within a few lengths of a tool at the predicted end get rows, and the others once they touch; all get
        rows where body or tool may move by any distance.
        """
        rows, units, system = iterate.rows, iterate.increment.units, iterate.increment.system
        near = near_tools(rows, iterate.x, units.length)
        if system.rigid.size or iterate.translated.size:
            # What supports do not hold may go as far as the next tool.
            near = np.ones_like(near)
        # De Saxce's shift is that of a cone: what is capped has the threshold alone.
        second = rule is not None and not system.candidates.capped
        coupling = Coupling.start(image(rows, r, iterate.x), rule or Safeguard(), second)
        return Posed(cache, units, near, rows.take(near), coupling)

    def at(self, iterate: Iterate) -> Posed:
        """With the rows of an iterate, which then include candidates that have penetrated their tool."""
        entering = ~self.near & (iterate.motion[:, 0] < 0)
        if not entering.any():
            return self.turned(iterate)
        near = self.near | entering
        return replace(self, near=near, rows=iterate.rows.take(near), distance=None)

    def turned(self, iterate: Iterate) -> Posed:
        """With the same candidates' rows of an iterate, which flat tools have once for all but for caps."""
        changes = iterate.increment.system.candidates.changes
        return replace(self, rows=iterate.rows.take(self.near)) if changes else self

    def terms(self, iterate: Iterate, r: Floats) -> ContactTerms:
        """The contact of the next program, with threshold or shift frozen; r (c, d) are the last forces of all."""
        coupling, active = self.coupling, self.near[iterate.rows.frictional]
        if coupling.shift is None:
            return ContactTerms(self.rows, coupling.value[active], None)
        return ContactTerms(self.rows, self.rows.threshold(r[self.near]), coupling.shift[active])

    def spread(self, r: Floats) -> Floats:
        """Forces (c, d) of all candidates from those that have rows."""
        out = np.zeros((len(self.near), r.shape[1]))
        out[self.near] = r
        return out

    def after(self, iterate: Iterate, r: Floats, exact: bool, distance: float | None = None) -> Posed:
        """After a pass that led to ``iterate`` and forces r (c, d) of all; ``exact`` if in the end it froze nothing."""
        coupling = self.coupling.update(image(iterate.rows, r, iterate.x), exact)
        rose = distance is not None and self.distance is not None and distance >= self.distance
        return replace(self, coupling=coupling, distance=distance, rose=rose)
