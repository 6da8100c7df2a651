"""Increments at deformable tools: contact is posed in the configuration at their end, which is found step by step.

Means and normals (:mod:`bipot.tools.facing`) of one configuration make an increment with flat tools, in every form. Its
answer ends in another configuration; the increment is solved again with that, from there, until the answer meets all
bounds in the configuration of its own end. Until then an iterate near an answer shows as well where nodes end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from bipot.checks.examined import POSED, Examined
from bipot.checks.passed import refuse_passed
from bipot.coulomb.acceleration import Anderson, Past
from bipot.errors import NotConverged
from bipot.forms import Cache, Form
from bipot.increment import Leave, LeftOff, Limits, Near, Observer, Solved, solve_increment
from bipot.iterate import Increment, Iterate
from bipot.prediction import begin
from bipot.typing import Floats

MOST, MIXED = 30, Anderson(depth=3, weight=1.0, growth=math.inf)
"""Configurations of one increment, and how the next one is mixed of the last.

Where only the dents in its contacts hold a part, a configuration pushes the next one away from the answer, and what
was mixed of several is the only way there: steps that grow must not drop it.
"""

FINER = "Use more increments, or refine the sides where one goes past an end of the other."

ROUGH = 1e-3
"""Error of an iterate that shows where nodes end: the next pass is in the next configuration."""


def solve_facing(
    increment: Increment,
    form: Form[Any],
    limits: Limits,
    cache: Cache,
    largest: float,
    observe: Observer,
    near_to: Near | None,
    leave: Leave | None,
) -> Solved:
    """Solve the increment (:func:`~bipot.increment.solve_increment`), with deformable tools where they are at its end.

    Raises:
        NotConverged: also where configurations do not come nearer to each other; Refused where sides go through each
            other.
    """
    given = form, limits, cache, largest, observe
    if not increment.system.candidates.deformable:
        return solve_increment(increment, *given, near_to, leave)
    there = near_to.iterate if near_to else begin(_facing(increment, increment.start.nodes), cache.pace, limits.bounds)
    nodes, passes, past = there.nodes, 0, Past()
    for _ in range(MOST):
        rough = _Rough(leave)
        try:
            solved = solve_increment(_facing(increment, nodes), *given, near_to, rough)
        except LeftOff as left:
            if rough.asked:
                raise
            near_to, passes = left.near, passes + rough.passes
        else:
            near_to, passes = Near(refaced(solved.iterate), solved.r), passes + solved.passes
            here = Examined(near_to.iterate, near_to.r, largest, limits.bounds)
            ratios = here.ratios()
            if all(ratio <= 1 for name, ratio in ratios.items() if solved.posed is None or name in POSED):
                refuse_passed(here.iterate)
                return replace(solved, iterate=here.iterate, certificate=here.certificate, passes=passes)
        past, mixed = MIXED.advance(past, nodes.ravel(), near_to.iterate.nodes.ravel())
        nodes = mixed.reshape(nodes.shape)
    raise NotConverged("deformable tools and the candidates before them do not rest", advice=FINER)


@dataclass
class _Rough:
    """Decides to leave an increment to the next configuration; ``asked`` if it is others that ``leave`` it.

    ``passes`` are those that were not accepted.
    """

    leave: Leave | None
    asked: bool = False
    passes: int = 0

    def __call__(self, near: Near, error: float) -> bool:
        """As a :data:`~bipot.increment.Leave`."""
        self.asked, self.passes = self.leave is not None and self.leave(near, error), self.passes + 1
        return self.asked or error <= ROUGH


def refaced(iterate: Iterate) -> Iterate:
    """An iterate with deformable tools before their candidates as where its own nodes are."""
    return faced(iterate, iterate.nodes)


def faced(iterate: Iterate, nodes: Floats) -> Iterate:
    """An iterate with deformable tools before their candidates as where nodes are at ``nodes`` (a, d)."""
    return replace(iterate, increment=_facing(iterate.increment, nodes))


def _facing(increment: Increment, nodes: Floats) -> Increment:
    """The increment with deformable tools before their candidates as where nodes are at ``nodes`` (a, d)."""
    return replace(increment, system=increment.system.facing(nodes))
