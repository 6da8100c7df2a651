"""Data that a run computes once for Newton (ordering and scatter), and the prediction of increments."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bipot.contact.closeness import carries
from bipot.fem.assembly import Space
from bipot.fem.strain import Scratch
from bipot.iterate import Increment
from bipot.programs.data import ContactRows
from bipot.programs.frames import SOFTENED, Frames, Touched
from bipot.programs.ordering import LARGE, Pattern
from bipot.state import State
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Bools, EqualByNumbers, Floats, Ints, make_arrays, make_floats

BOUNDED, SMOOTH = 0.3, 0.5
"""Change of the velocity, or of a contact force, over its norm, up to which it is extrapolated; a quadratic's part of a
change over the linear one, up to which the change is smooth.
"""

FASTER = 1.05
"""Ratio of the velocities of two increments above which a maximum of the load is inferred."""


def ordered(space: Space, rows: ContactRows | None = None) -> Pattern:
    """The stiffness pattern of a body in its order of elimination, chosen by the places of nodes at rest.

    Unknowns that contacts couple, as those of two parts, count as neighbours where contact ``rows`` are given.
    """
    nodes = space.mesh.nodes
    places = np.full((space.size, nodes.shape[1]), np.nan)
    places[: len(space.free)] = np.repeat(nodes, nodes.shape[1], axis=0)[space.free]
    divided = space.size >= LARGE[nodes.shape[1]]
    coupled = None if rows is None or divided else Touched.of(rows).coupled(space.size)
    return Pattern.of(space.indices, space.indptr, places, coupled)


@dataclass(frozen=True)
class Setup:
    """The data that a run computes once: ordered pattern, scatter of element matrices into its data, scale, and memory.

    ``stiffness`` (n + 1,) is the diagonal of the tangent at rest (for tools' coordinates the mean) times SOFTENED: it
    balances forces against motions, in the same way wherever a run begins. ``spins`` (s,) are the unknowns that are
    turns of tools under moments, ``held`` (s,) their places on the diagonal in the row-wise data, and ``pushed`` (m,)
    the unknowns that are motions of tools along forces.
    """

    space: Space
    pattern: Pattern
    scatter: Ints
    stiffness: Floats
    scratch: Scratch
    spins: Ints
    held: Ints
    pushed: Ints

    @staticmethod
    def of(system: System, pattern: Pattern) -> Setup:
        """Compose the scatters into the ordered stiffness ``pattern``."""
        body, space = system.body, system.body.space
        scatter = np.append(pattern.place, len(pattern.place))[space.scatter]
        scratch = body.scratch()
        at_rest = body.respond(system.rest(), np.zeros(space.size))
        diagonal = space.matrix(body.tangent(at_rest, scratch)).diagonal()
        # A contact of a held node with a driven tool has no unknown but the tool's coordinates.
        diagonal[len(space.free) :] = diagonal[: len(space.free)].mean()
        spins = np.flatnonzero(body.scene.drives.spins)
        held = pattern.place[space.diagonal[spins]]
        stiffness = np.append(SOFTENED * diagonal, 0.0)
        along = len(space.free) + np.flatnonzero(body.scene.drives.spins == 0)
        return Setup(space, pattern, scatter, stiffness, scratch, len(space.free) + spins, held, along)

    def data(self, element: Floats) -> Floats:
        """Row-wise data (nnz + 1,), the last entry for held unknowns, summed from element matrices (e, dk, dk), or from
        all their entries followed by those of couplings."""
        place, weights = self.scatter[: element.size], self.space.along(element)
        data = np.bincount(place, weights=weights, minlength=len(self.pattern.place) + 1)
        return np.asarray(data, dtype=np.float64)

    def hold(self, data: Floats, resisted: Bools) -> None:
        """Put a spring, without tension at the iterate, on those of the ``spins`` (s,) that are not ``resisted`` (s,).

        A roll that touches nothing then rests, and the solution of a roll that touches something does not change.
        """
        data[self.held[~resisted]] += self.stiffness[self.spins[~resisted]]

    def scale(self, frames: Frames) -> Floats:
        """Stiffness (c,) of each contact's nodes; of its tool's coordinates where no node is free.

        A mean over a graded body would be off by orders of magnitude at its contacts.
        """
        body = self.stiffness.copy()
        body[len(self.space.free) :] = 0.0
        nodal = frames.largest(body)
        nodal = np.where(nodal > 0, nodal, frames.largest(self.stiffness))
        # Held nodes before a deformable tool that they do not face touch no unknown.
        return np.where(nodal > 0, nodal, self.stiffness.max())


@dataclass(frozen=True, eq=False)
class Paced(EqualByNumbers):
    """An accepted increment as the predictor sees it: its end ``tau``, its middle, its velocity, its contact forces.

    The velocity (a d + m,) of nodes and driven tools and the ``forces`` (c, d) at its end are read-only. An unknown end
    is NaN, and so is a middle whose beginning or end is unknown.
    """

    tau: float
    middle: float
    velocity: Floats
    forces: Floats

    def __post_init__(self) -> None:
        make_floats(self, "tau", "middle", of="paced.")
        make_arrays(self, "paced.", velocity="(a d + m,)", forces="(c, d)")

    @staticmethod
    def unknown(state: State) -> Paced:
        """The increment before one that led to ``state`` from an unknown beginning."""
        return Paced(math.nan, math.nan, np.zeros_like(state.rates), np.zeros_like(state.forces))

    def next(self, state: State) -> Paced:
        """The increment after this one, which led to ``state``."""
        return Paced(state.tau, (self.tau + state.tau) / 2, state.rates, state.forces)

    def at_pace(self, quicker: float, now: float) -> Paced:
        """The same increment as if everything up to the pseudo-time ``now`` had gone ``quicker`` times as fast."""
        if quicker == 1:
            return self
        tau, middle = (now - (now - then) / quicker for then in (self.tau, self.middle))
        return Paced(tau, middle, quicker * self.velocity, self.forces)


@dataclass(frozen=True)
class Pace:
    """Predicts an increment's motion: the velocity extrapolated from the last increments, by a quadratic from three.

    Contact forces at the end are extrapolated linearly: those that slip turns in space are then met in one pass, too.
    The velocity of an increment is taken as that at its middle. Where it changes by more than BOUNDED of itself (first
    yield, a landing, a reversal) the last velocity is kept, and where the change is not SMOOTH it goes on linearly.
    ``before`` are the increments before the last one, the later first, as many as are known. All are seen at the pace
    of the one to be predicted (:mod:`bipot.scene.paces`). From answers that are not ``precise``, as of a scheme that
    iterates nothing, errors would grow from start to start: there the velocity goes on linearly and forces stay.
    """

    before: tuple[Paced, ...] = ()
    precise: bool = True

    def predict(self, increment: Increment) -> Floats:
        """Displacements in the ``increment``, node by node, and motions of driven tools (a d + m,)."""
        last, before, earlier = self._seen(increment)
        velocity, length = last.velocity, increment.tau - increment.start.tau
        over = last.middle - before.middle
        if not over > 0:
            return velocity * length
        middle = (increment.start.tau + increment.tau) / 2
        slope = (velocity - before.velocity) / over
        change = slope * (middle - last.middle)
        size = float(np.linalg.norm(change))
        if not size <= BOUNDED * np.linalg.norm(velocity):
            return velocity * length
        if self.precise and before.middle > earlier.middle:
            earlier_slope = (before.velocity - earlier.velocity) / (before.middle - earlier.middle)
            bend = (slope - earlier_slope) / (last.middle - earlier.middle)
            bend *= (middle - last.middle) * (middle - before.middle)
            if np.linalg.norm(bend) <= SMOOTH * size:
                change += bend
        return (velocity + change) * length

    def forces(self, increment: Increment) -> Floats:
        """Contact forces (c, d) at the end of the ``increment``, those at its start where nothing tells their change.

        Of contacts that share a node, a part of the forces may be undetermined, and would go on for ever.
        """
        last, before, _ = self._seen(increment)
        r, over, contacts = last.forces, last.tau - before.tau, increment.system.candidates
        known = self.precise and over > 0 and not increment.past.turns
        if not known or (contacts.weighted and not contacts.alone.all()):
            return r
        change = (r - before.forces) * ((increment.tau - last.tau) / over)
        goes_on = contacts.alone & carries(r) & carries(before.forces) & (norm(change) <= BOUNDED * norm(r))
        return r + np.where(goes_on[:, None], change, 0.0)

    def maximum(self, increment: Increment) -> float | None:
        """The pseudo-time of a maximum of the load, inferred from the acceleration up to the ``increment``, or None.

        Near a maximum at tau_c, |velocity| grows as (tau_c - tau)^(-1/2), so that |velocity|^-2 goes to zero linearly.
        """
        last, before, _ = self._seen(increment)
        over = last.middle - before.middle
        fast, slow = (float(v @ v) for v in (last.velocity, before.velocity))
        if not over > 0 or not fast > FASTER**2 * slow > 0:
            return None
        return last.middle + over / (fast / slow - 1)

    def _seen(self, increment: Increment) -> tuple[Paced, ...]:
        """The last three increments before the ``increment``, the last first, as seen at its pace."""
        state, quicker = increment.start, increment.past.quicker
        missing = 2 - len(self.before)
        before, earlier = self.before + missing * (Paced.unknown(state),) if missing else self.before
        return tuple(paced.at_pace(quicker, state.tau) for paced in (before.next(state), before, earlier))
