r"""Nodes that two tools jam between them: they come together there, and friction lets the node slide on neither.

Forces f and -f are within the friction of both, whatever their size, where the angle gamma from the one normal to the
opposite of the other is no larger than arctan mu_1 + arctan mu_2: at a right angle, where mu_1 mu_2 >= 1. If each tool
comes nearer to what sticks to the other, n_2 . (m_1 - m_2) < 0 and n_1 . (m_2 - m_1) < 0 with their motions m, the node
has to slide on both. Then friction, at its limit, undoes more of what each pushes by than that is: no forces push the
node where the tools leave it room. What is welded to a tool goes with it, into another one if that is in the way.

What supports or planes of symmetry hold along some directions meets a tool as if its mirror image were a second one:
with the components of its normal and of its motion along these reversed. It is jammed where arctan mu is no smaller
than the angle between the normal and what is held of it, and the tool comes nearer by its motion along that.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from bipot.contact.closeness import carries, touches
from bipot.errors import InvertedElement
from bipot.iterate import Increment
from bipot.tensors import norm
from bipot.typing import Bools, Floats

CLOSES = 1e-9
"""Tools that come together by less than this part of their ways do not; a node less deep, over the body's size, is in
none."""

ALONG = 1e-6
"""Tangent of the angle up to which a normal is along what supports hold."""


def jammed(increment: Increment) -> str | None:
    """The sentence on a node that tools on their paths jam between them in the ``increment``, None if none."""
    contacts = increment.system.candidates
    first = contacts.parts.first
    normal, motion = increment.tools.frames[first, 0], increment.tools.swept(increment.tools.path)[first]
    found = _Pushed(increment, normal / norm(normal)[:, None], motion + increment.tools.travel[contacts.tool])
    by_path = ~np.isin(contacts.tool, increment.system.body.scene.drives.tool)
    return found.welded_in(by_path) or found.rubbed(by_path) or found.rubbed_in_supports(by_path)


class _Pushed(NamedTuple):
    """The candidates (c,) of an ``increment``, where their tools have a ``normal`` (c, d) and go ``motion`` (c, d)."""

    increment: Increment
    normal: Floats
    motion: Floats

    def rubbed(self, chosen: Bools) -> str | None:
        """The sentence on one of the ``chosen`` (c,) that friction of two tools holds."""
        contacts = self.increment.system.candidates
        for node, c, other in self._pairs(self._rubs(chosen)):
            between = _between(*self.normal[[c, other]])
            held = between <= float(np.arctan(contacts.mu[[c, other]]).sum())
            if held and _close(self.normal[[c, other]], self.motion[[c, other]]):
                mu = " and ".join(f"{value:.6g}" for value in contacts.mu[[c, other]].tolist())
                return (
                    f"Node {node} is jammed between tools[{contacts.tool[c]}] and tools[{contacts.tool[other]}], which "
                    f"come together there while friction, mu = {mu}, lets it slide on neither: give them less there "
                    f"(mu_at), so that arctan mu of both adds up to less than {np.degrees(between):.4g} degrees."
                )
        return None

    def rubbed_in_supports(self, chosen: Bools) -> str | None:
        """The sentence on one of the ``chosen`` (c,) that friction of a tool holds against supports of its node."""
        contacts, holding = self.increment.system.candidates, self.increment.system.body.scene.holding
        sides = np.where(holding.held, -1.0, 1.0)[contacts.node]
        beyond = self.motion - self.increment.tools.driven[contacts.node]
        normal, motion = (holding.axes.at(contacts.node, vectors) for vectors in (self.normal, beyond))
        for c in np.flatnonzero(self._rubs(chosen) & (sides < 0).any(axis=1)).tolist():
            both, ways = (np.array([own[c], sides[c] * own[c]]) for own in (normal, motion))
            most, mu = float(np.tan(_between(*both) / 2)), float(contacts.mu[c])
            # Against a tool that comes straight at what is held no friction helps, nor does less of it.
            if ALONG < most <= mu and _close(both, ways):
                return (
                    f"Node {contacts.node[c]} is jammed between tools[{contacts.tool[c]}] and what holds it, its "
                    f"supports or planes of symmetry: the tool comes nearer to these while friction, mu = {mu:.6g}, "
                    f"lets the node not slide out: give it less than {most:.4g} there (mu_at)."
                )
        return None

    def _rubs(self, chosen: Bools) -> Bools:
        """Those of the ``chosen`` (c,) that are at hand and rub by Coulomb's law alone."""
        contacts = self.increment.system.candidates
        rubs = chosen & _at_hand(self.increment) & np.isfinite(contacts.mu) & (contacts.mu > 0)
        return rubs & np.isinf(contacts.shear)

    def welded_in(self, chosen: Bools) -> str | None:
        """The sentence on one of the ``chosen`` (c,) that a weld takes into another tool."""
        contacts, size = self.increment.system.candidates, self.increment.system.body.scene.size
        tied = contacts.welded & self.increment.tools.closed
        for node, *pair in self._pairs(chosen) if tied.any() else ():
            for c, other in (pair, pair[::-1]):
                if tied[c] and (depth := self._depth(c, other)) > CLOSES * size:
                    return (
                        f"Node {node} is welded to tools[{contacts.tool[c]}], which takes it {depth:.3g} deep into "
                        f"tools[{contacts.tool[other]}]: give the former friction, or stop it there."
                    )
        return None

    def _depth(self, c: int, other: int) -> float:
        """How deep the one candidate comes into the tool of the other if it goes with its own."""
        contacts, tools = self.increment.system.candidates, self.increment.tools
        k, x = int(contacts.tool[other]), contacts.means.places(self.increment.start.nodes)[[other]]
        return -float(contacts.scene.tools[k].distance(x + self.motion[c], tools.placed[k] + tools.path[k])[0])

    def _pairs(self, chosen: Bools) -> Iterator[tuple[int, int, int]]:
        """Nodes of two of the ``chosen`` (c,) of different tools, and these."""
        contacts, own = self.increment.system.candidates, np.flatnonzero(chosen)
        nodes, often = np.unique(contacts.node[own], return_counts=True)
        for node in nodes[often > 1].tolist():
            for c, other in combinations(own[contacts.node[own] == node].tolist(), 2):
                if contacts.tool[c] != contacts.tool[other]:
                    yield node, c, other


def _between(one: Floats, other: Floats) -> float:
    """The angle between the one normal (d,) and the opposite of the other."""
    return float(np.arccos(np.clip(-one @ other, -1.0, 1.0)))


def _at_hand(increment: Increment) -> Bools:
    """Which candidates (c,) touch or push at the start, or are reached by the end if the body rests or goes on."""
    start, size = increment.start, increment.system.body.scene.size
    gap = np.minimum(np.minimum(start.gap, increment.rows.gap), _gone_on(increment))
    return carries(start.forces) | touches(gap, size)


def _gone_on(increment: Increment) -> Floats:
    """Gaps (c,) at the end if the body goes on as it came to the start, inf where that folds it."""
    on = increment.past.rates * (increment.tau - increment.start.tau)
    try:
        return increment.at(increment.system.body.space.gather(on)).motion[:, 0]
    except InvertedElement:
        return np.full(len(increment.start.gap), np.inf)


def _close(normal: Floats, motion: Floats) -> bool:
    """Whether two tools of these normals and motions (2, d) each come nearer to what sticks to the other."""
    apart = motion[1] - motion[0]
    least = CLOSES * float(norm(motion).max())
    return bool(normal[0] @ apart < -least and -normal[1] @ apart < -least)
