r"""Nodes that two tools jam between them: they come together there, and friction lets the node slide on neither.

Forces f and -f are within the friction of both, whatever their size, where the angle gamma from the one normal to the
opposite of the other is no larger than arctan mu_1 + arctan mu_2: at a right angle, where mu_1 mu_2 >= 1. If each tool
comes nearer to what sticks to the other, n_2 . (m_1 - m_2) < 0 and n_1 . (m_2 - m_1) < 0 with their motions m, the node
has to slide on both. Then friction, at its limit, undoes more of what each pushes by than that is: no forces push the
node where the tools leave it room.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from bipot.contact.closeness import carries, touches
from bipot.iterate import Increment
from bipot.response import State
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Bools, Floats

CLOSES = 1e-9
"""Tools that come together by less than this part of their ways do not."""


def jammed(system: System, state: State, tau: float) -> str | None:
    """The sentence on a node that tools on their paths jam between them from ``state`` to ``tau``, None if none."""
    contacts, increment = system.candidates, Increment(system, state, tau)
    first, tool = contacts.parts.first, contacts.tool
    normal, motion = increment.tools.frames[first, 0], increment.tools.swept(increment.tools.path)[first]
    normal, motion = normal / norm(normal)[:, None], motion + increment.tools.travel[tool]
    rubs = np.flatnonzero(_at_hand(increment) & (contacts.mu > 0) & np.isinf(contacts.shear) & ~_driven(system)[tool])
    for node in np.unique(contacts.node[rubs]).tolist():
        for c, other in combinations(rubs[contacts.node[rubs] == node].tolist(), 2):
            pair = [c, other]
            between = float(np.arccos(np.clip(-normal[c] @ normal[other], -1.0, 1.0)))
            within = between <= float(np.arctan(contacts.mu[pair]).sum())
            if tool[c] != tool[other] and within and _close(normal[pair], motion[pair]):
                mu = " and ".join(f"{value:.6g}" for value in contacts.mu[pair].tolist())
                return (
                    f"Node {node} is jammed between tools[{tool[c]}] and tools[{tool[other]}], which come together "
                    f"there while friction, mu = {mu}, lets it slide on neither: give them less there (mu_at), so that "
                    f"arctan mu of both adds up to less than {np.degrees(between):.4g} degrees."
                )
    return None


def _at_hand(increment: Increment) -> Bools:
    """Which candidates (c,) touch or push at the start, or are reached by the end if the body rests."""
    start, size = increment.start, increment.system.body.scene.size
    return carries(start.forces) | touches(np.minimum(start.gap, increment.rows.gap), size)


def _driven(system: System) -> Bools:
    """Which tools (k,) a force or a moment drives: they give way."""
    out = np.zeros(len(system.body.scene.tools), dtype=bool)
    out[system.body.scene.drives.tool] = True
    return out


def _close(normal: Floats, motion: Floats) -> bool:
    """Whether two tools of these normals and motions (2, d) each come nearer to what sticks to the other."""
    apart = motion[1] - motion[0]
    least = CLOSES * float(norm(motion).max())
    return bool(normal[0] @ apart < -least and -normal[1] @ apart < -least)
