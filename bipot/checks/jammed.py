r"""Nodes that two tools jam between them: the tools come together there, and friction lets the node slide on neither.

Forces f and -f are within the friction cones of both tools, whatever their size, if the angle gamma between one normal
and the opposite of the other is at most arctan mu_1 + arctan mu_2 (for normals at a right angle, if mu_1 mu_2 >= 1). If
each tool, moving by m_i, approaches a node that sticks to the other, n_2 . (m_1 - m_2) < 0 and n_1 . (m_2 - m_1) < 0,
the node has to slide on both. Friction at its limit then opposes this by more than each tool pushes: no forces move the
node to where the tools leave room. A node welded to a tool goes with it, also into another tool that is in the way.

A node that supports or planes of symmetry hold along some directions meets a tool as if the tool's mirror image were a
second one, whose normal and motion have reversed components along these directions. It is jammed if arctan mu is at
least the angle between the normal and its held part, and the tool approaches by the held part of its motion.
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
"""Tools that approach by less than this part of their ways do not come together; a node less deep in a tool than this,
over the body's size, is not in it."""

ALONG = 1e-6
"""Tangent of the angle up to which a normal counts as along the directions that supports hold."""


def jammed(increment: Increment) -> str | None:
    """The sentence on a node that tools on their paths jam between them in the ``increment``, None if none."""
    contacts = increment.system.candidates
    first = contacts.parts.first
    normal, motion = increment.tools.frames[first, 0], increment.tools.swept(increment.tools.path)[first]
    by_path = ~np.isin(contacts.tool, increment.system.body.scene.drives.tool)
    motion = motion + increment.tools.travel[contacts.tool]
    found = _Pushed(increment, normal / norm(normal)[:, None], motion, by_path)
    return found.welded_in() or found.rubbed() or found.rubbed_in_supports()


class _Pushed(NamedTuple):
    """The candidates (c,) of an ``increment``, where their tools have a ``normal`` (c, d) and go ``motion`` (c, d).

    Those of tools that go ``by_path`` (c,) are judged.
    """

    increment: Increment
    normal: Floats
    motion: Floats
    by_path: Bools

    def rubbed(self) -> str | None:
        """The sentence on a node that friction of two tools holds."""
        contacts = self.increment.system.candidates
        for node, c, other in self._pairs(self._rubs()):
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

    def rubbed_in_supports(self) -> str | None:
        """The sentence on a node that friction of a tool holds against supports of it."""
        contacts, holding = self.increment.system.candidates, self.increment.system.body.scene.holding
        sides = np.where(holding.held, -1.0, 1.0)[contacts.node]
        beyond = self.motion - self.increment.tools.driven[contacts.node]
        normal, motion = (holding.axes.at(contacts.node, vectors) for vectors in (self.normal, beyond))
        for c in np.flatnonzero(self._rubs() & (sides < 0).any(axis=1)).tolist():
            normals, motions = (np.array([real[c], sides[c] * real[c]]) for real in (normal, motion))
            most, mu = float(np.tan(_between(*normals) / 2)), float(contacts.mu[c])
            # If the tool comes straight along the held directions, less friction would not help.
            if ALONG < most <= mu and _close(normals, motions):
                return (
                    f"Node {contacts.node[c]} is jammed between tools[{contacts.tool[c]}] and what holds it, its "
                    f"supports or planes of symmetry: the tool comes nearer to these while friction, mu = {mu:.6g}, "
                    f"lets the node not slide out: give it less than {most:.4g} there (mu_at)."
                )
        return None

    def _rubs(self) -> Bools:
        """Those judged (c,) that are at hand and have friction by Coulomb's law alone."""
        contacts = self.increment.system.candidates
        rubs = self.by_path & _at_hand(self.increment) & np.isfinite(contacts.mu) & (contacts.mu > 0)
        return rubs & np.isinf(contacts.shear)

    def welded_in(self) -> str | None:
        """The sentence on a node that a weld takes into another tool."""
        contacts, size = self.increment.system.candidates, self.increment.system.body.scene.size
        tied = contacts.welded & self.increment.tools.closed
        for node, *pair in self._pairs(self.by_path) if tied.any() else ():
            for c, other in (pair, pair[::-1]):
                if tied[c] and (depth := self._depth(c, other)) > CLOSES * size:
                    return (
                        f"Node {node} is welded to tools[{contacts.tool[c]}], which takes it {depth:.3g} deep into "
                        f"tools[{contacts.tool[other]}]: give the former friction, or stop it there."
                    )
        return None

    def _depth(self, c: int, other: int) -> float:
        """How deep candidate ``c``, moving with its own tool, comes into the tool of the ``other``."""
        contacts, tools = self.increment.system.candidates, self.increment.tools
        k, x = int(contacts.tool[other]), contacts.means.places(self.increment.start.nodes)[[other]]
        return -float(contacts.scene.tools[k].distance(x + self.motion[c], tools.placed[k] + tools.path[k])[0])

    def _pairs(self, chosen: Bools) -> Iterator[tuple[int, int, int]]:
        """Each node and two of the ``chosen`` (c,) there, of different tools."""
        contacts, every = self.increment.system.candidates, np.flatnonzero(chosen)
        nodes, often = np.unique(contacts.node[every], return_counts=True)
        for node in nodes[often > 1].tolist():
            for c, other in combinations(every[contacts.node[every] == node].tolist(), 2):
                if contacts.tool[c] != contacts.tool[other]:
                    yield node, c, other


def _between(one: Floats, other: Floats) -> float:
    """The angle between ``one`` normal (d,) and the opposite of the ``other``."""
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
    """Whether each of two tools, of this ``normal`` and ``motion`` (2, d), approaches what sticks to the other."""
    apart = motion[1] - motion[0]
    least = CLOSES * float(norm(motion).max())
    return bool(normal[0] @ apart < -least and -normal[1] @ apart < -least)
