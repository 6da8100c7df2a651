r"""The fields, scales and round-off for the certificate of an iterate with contact forces.

The round-off of the internal forces is that of their own assembly,

    eps sum_q w |N,j| (|sigma_n| + (K + 2 G) sum_a |N_a,j| moved),

summed at the node where it is largest, with ``moved`` the sum of the increment's lengths: the largest displacement, the
longest travel of a tool within reach, and the motion that forces may give to tools. It stands for the scale of an
unstressed body. The round-off of a contact's motion is eps times ``moved`` plus its gap, if that is shorter than
``moved``, and, where its gap at the start follows from places, eps times those. Where ten times an estimate from the
largest stress and the mesh at rest is far below every bound, the estimate replaces the sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.certificate import EPS, Balance, Bounds, Certificate, ContactFields, certify, over_bound
from bipot.contact.candidates import Candidates
from bipot.iterate import Increment, Iterate
from bipot.response import Response
from bipot.tensors import norm
from bipot.typing import Floats, max_abs

FAINT = 0.1
"""Round-off below this fraction of a bound does not matter for that bound."""


POSED = ("equilibrium", "tool_equilibrium", "yield_violation")
"""Measures that bound an answer of a form that poses another law than Coulomb's, beside its own."""


@dataclass(frozen=True)
class Examined:
    """An iterate with contact forces r (c, d) on all candidates' rows, to be certified.

    ``largest`` is the largest contact force of the run so far; round-off far below the ``bounds`` is only estimated.
    Equilibrium comes first and is cheap; the other measures are computed where it is met.
    """

    iterate: Iterate
    r: Floats
    largest: float
    bounds: Bounds = Bounds()

    @property
    def increment(self) -> Increment:
        """The increment that is examined."""
        return self.iterate.increment

    @property
    def response(self) -> Response:
        """The body's response."""
        return self.iterate.response

    @cached_property
    def certificate(self) -> Certificate:
        """All measures."""
        body, work = self.increment.system.body, self.iterate.work(self.r)
        return certify(self._contact(), body.fields(self.response), self.balance, body.scene.mesh.size, work)

    def ratios(self) -> dict[str, float]:
        """Each measure over its bound or resolution; the measures of equilibrium alone if one of these is not met."""
        balance, bounds = self.balance, self.bounds
        first = {"equilibrium": over_bound(balance.equilibrium, bounds.equilibrium, balance.resolution)}
        if balance.tool_force.size:
            first["tool_equilibrium"] = over_bound(balance.tools, bounds.tool_equilibrium)
        return self.certificate.ratios(bounds) if max(first.values()) <= 1 else first

    @cached_property
    def balance(self) -> Balance:
        """Nodal residuals and their scales."""
        space, bounds = self.increment.system.body.space, self.bounds
        loads = np.zeros((1, 1))
        if self.increment.system.loading.loads:
            # Loads on held unknowns go into the supports and set no scale.
            loads = space.spread(self.iterate.load)
        force = space.force_scale(self.response.element_forces, loads)
        least = min(bounds.equilibrium, bounds.cone_violation, bounds.law, bounds.relative_gap)
        residual = self.iterate.residual - self.iterate.rows.forces(self.r)
        blur = self.increment.system.force_blur(self.response, self._moved, FAINT * least * force)
        blur += EPS * (max_abs(loads) + max_abs(self.r))
        driven = space.beside(self.iterate.load) != 0
        return Balance(
            residual=norm(space.spread(residual)),
            force=force,
            blur=blur,
            tool_residual=space.beside(residual),
            tool_force=driving(self.iterate, self.r),
            tool_blur=np.where(driven, 0.0, _levered(self.iterate, np.where(self.r != 0, blur, 0.0))),
        )

    @cached_property
    def _moved(self) -> float:
        """The sum of the increment's lengths (module docstring)."""
        # The round-off of a driven tool's place is that of the motion its force could cause, even if it rests.
        driven = self.increment.units.length if self.iterate.translated.size else 0.0
        return float(norm(self.response.du).max()) + self.increment.reach + driven

    def _contact(self) -> ContactFields:
        rows, r, moved, motion = self.iterate.rows, self.r, self._moved, self.iterate.motion
        present = max_abs(r)
        return ContactFields(
            r=r,
            motion=motion,
            mu=rows.mu,
            cap=rows.cap,
            tied=rows.tied,
            stiffness=self.increment.system.stiffness,
            largest=max(self.largest, present),
            present=max(present, max_abs(self.response.state.forces)),
            # The gap of a candidate far from its tool is never small, and its round-off does not matter.
            blur=EPS * (np.minimum(np.abs(motion[:, 0]), moved) + moved),
            placed=EPS * _places(self.increment.system.candidates),
            inside=self.increment.driven_into.depth,
        )


def _places(contacts: Candidates) -> Floats:
    """The size (c,) of the places of which gaps at the start are differences, at deformable tools; zero at others."""
    every = contacts.points
    return contacts.of_points(*(np.zeros(len(at.node)) if at.faced is None else at.faced.places for at in every))


def driving(iterate: Iterate, r: Floats) -> Floats:
    """The scales (m,) of the residuals of driven tools, under contact forces r (c, d).

    It is the driving force itself; for a moment, over its constant lever, the sum of the contact forces times their
    arms if that is larger, as it is for a tool that rolls freely.
    """
    body = iterate.increment.system.body
    given = np.abs(body.space.beside(iterate.load))
    return np.maximum(given, body.scene.drives.spins * _levered(iterate, r)) if given.size else given


def _levered(iterate: Iterate, r: Floats) -> Floats:
    """Sums (m,) of the sizes of contact forces r (c, k) on driven tools; for moments times their arms over levers."""
    contacts, spins = iterate.increment.system.candidates, iterate.increment.system.body.scene.drives.spins
    if not spins.any():
        return contacts.driven_sums(norm(r)) if spins.size else np.zeros(0)
    arms = contacts.parts.sums(norm(iterate.meeting.arm) * norm(contacts.parts.spread(r)))
    return np.where(spins, contacts.driven_sums(arms), contacts.driven_sums(norm(r)))
