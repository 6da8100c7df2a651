"""The scale of what is left unbalanced of a force or moment that drives a tool."""

from __future__ import annotations

import numpy as np

from bipot.iterate import Iterate
from bipot.tensors import norm
from bipot.typing import Floats


def driving(iterate: Iterate, r: Floats) -> Floats:
    """The scales (m,) of the residuals of driven tools, under contact forces r (c, d).

    It is the driving force itself; for a moment, over its constant lever, the sum of the contact forces times their
    arms if that is larger, as it is for a tool that rolls freely.
    """
    body, contacts = iterate.increment.system.body, iterate.increment.system.candidates
    drives = body.scene.drives
    if not drives:
        return np.zeros(0)
    given = np.abs(body.space.beside(iterate.load))
    if not drives.spins.any():
        return given
    arms = contacts.parts.sums(norm(iterate.meeting.arm) * norm(contacts.parts.spread(r)))
    return np.maximum(given, drives.spins * contacts.driven_sums(arms))
