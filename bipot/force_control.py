r"""Force control: the force of a tool is given, how far the tools go is what an increment is solved for.

The one free unknown is the increment's end tau. With F(tau) the tool's normal force at the end of the increment solved
from the *same* start to tau, by any form, the asked F is bracketed by doubling the travel and found by Brent's method.
The answer is an ordinary accepted increment with its certificate, whose equilibrium bounds what F itself is worth.

Above a limit load no tau exists. What tells is that F stands still while the travel doubles: between the last two
ends the stress does not change, so the difference of the displacements is plastic flow at the limit load, a collapse
mechanism. It is the ray of :class:`~bipot.errors.UnboundedProgram`; the Farkas inequalities

    tr B v = 0,    sum_q w sqrt(2/3) sigma_Y |dev B v| < F V,    V the tool's speed along its force,

then prove, without friction and hardening and in a frozen geometry, that the asked load has no equilibrium, whoever
found v. They are left to the caller; elsewhere a force that stands still is an observation, not a proof.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bipot.carrying import Attempt
from bipot.errors import NotConverged, UnboundedProgram, require, require_count, require_number, require_positive
from bipot.increment import Solved
from bipot.response import State
from bipot.system import System
from bipot.typing import Floats


@dataclass(frozen=True)
class Seek:
    """How an end of given force is sought.

    ``tolerance`` is that of the force, relative. The first travel tried, doubled ``doublings`` times, ends the tools'
    straight path. The body collapses when the force has ``flat`` times in a row grown by no more than ``still`` of what
    is missing and of itself (what is missing alone is met by any stiffening body far below it). Where an attempt fails,
    the middle between it and the last end that was solved is tried, ``retries`` times. ``solves`` is the most
    increments solved in all.

    Raises:
        SceneError: a value out of its range.
    """

    tolerance: float = 1e-9
    doublings: int = 10
    still: float = 1e-3
    flat: int = 3
    retries: int = 4
    solves: int = 60

    def __post_init__(self) -> None:
        require_number(self.tolerance, "seek.tolerance")
        require_number(self.still, "seek.still")
        require_count(self.doublings, "seek.doublings")
        require(0 < self.tolerance < 1, "seek.tolerance", self.tolerance, "in (0, 1)")
        require(1 <= self.doublings <= 40, "seek.doublings", self.doublings, "in [1, 40]")
        require(0 < self.still < 1, "seek.still", self.still, "in (0, 1)")
        require_count(self.flat, "seek.flat")
        require_count(self.retries, "seek.retries", 0)
        require_count(self.solves, "seek.solves")


@dataclass(frozen=True)
class Loaded:
    """The increment that ends at the asked force: its end, how it was solved, its force, and all passes spent."""

    tau: float
    attempt: Attempt
    solved: Solved
    force: float
    passes: int


def press(
    system: System,
    state: State,
    force: float,
    solve: Callable[[float], Attempt],
    tool: int = 0,
    how: Seek = Seek(),
) -> Loaded:
    """The increment from ``state`` in which the normal force of ``tool`` rises to ``force``.

    ``solve(tau)`` attempts the increment from ``state`` to tau. The force is that on the modelled part (of an
    axisymmetric body: on the whole circle). The first crossing that doubling meets is the one returned.

    Raises:
        SceneError: no such tool; a force that is not finite, or not above the present one; a path at its end.
        UnboundedProgram: the force stands still below the asked one. ``ray`` is dx/dtau (n,) of the free
            displacements from the last end but one to the last: the collapse mechanism.
        NotConverged: an attempt failed, the path ended below the asked force, or the solves were used up.
    """
    require_count(tool, "tool", 0)
    require(0 <= tool < len(system.body.scene.tools), "tool", tool, f"below {len(system.body.scene.tools)}, >= 0")
    require_positive(force=force)
    present = tool_force(system, state.forces, tool)
    require(present < force, "force", force, f"above the present {present:.6g}")
    search = _Search(system, force, solve, tool, how)
    return search.between(*search.bracket(state, present))


class End(NamedTuple):
    """An end of the increment, and the tool's force there."""

    tau: float
    force: float


class _Search:
    """A search and what it has cost."""

    def __init__(self, system: System, force: float, solve: Callable[[float], Attempt], tool: int, how: Seek) -> None:
        self.system, self.force, self.solve, self.tool, self.how = system, force, solve, tool, how
        self.solves, self.passes = 0, 0

    def to(self, tau: float) -> Loaded:
        """The increment solved to ``tau``."""
        if self.solves == self.how.solves:
            raise NotConverged(f"{self.solves} increments solved, none ends at the force {self.force:.9g}")
        attempt = self.solve(tau)
        self.solves, self.passes = self.solves + 1, self.passes + attempt.passes
        if attempt.solved is None:
            why = "; ".join(map(str, attempt.failures))
            raise NotConverged(f"no increment to tau = {tau:.6g} on the way to the force {self.force:.9g}: {why}")
        return Loaded(tau, attempt, attempt.solved, tool_force(self.system, attempt.solved.r, self.tool), self.passes)

    def bracket(self, state: State, present: float) -> tuple[End, Loaded]:
        """An end below the asked force, and an increment at or above it."""
        end = straight(self.system, state.tau)
        below, before, flat = End(state.tau, present), None, 0
        for left in reversed(range(self.how.doublings + 1)):
            tau = state.tau + (end - state.tau) / 2**left
            try:
                here = self.to(tau)
            except NotConverged as failure:
                return self._short_of(below, tau, failure)
            if self._reaches(here):
                return below, here
            # Without force nothing presses yet: a gap that closes is no collapse.
            growth = self.how.still * min(self.force - here.force, here.force)
            still = here.force > 0 and here.force - below.force <= growth
            flat = flat + 1 if still else 0
            if before is not None and flat >= self.how.flat:
                raise self._collapse(before, here)
            below, before = End(tau, here.force), here
        raise NotConverged(
            f"the tools go straight to tau = {end:.6g}, where the force is {below.force:.9g}, "
            f"below the asked {self.force:.9g}"
        )

    def _short_of(self, below: End, failed: float, failure: NotConverged) -> tuple[End, Loaded]:
        """The bracket short of an end that no form solves; the last failure if there is none."""
        for _ in range(self.how.retries):
            tau = (below.tau + failed) / 2
            try:
                here = self.to(tau)
            except NotConverged as again:
                failed, failure = tau, again
                continue
            if self._reaches(here):
                return below, here
            below = End(tau, here.force)
        raise failure

    def _reaches(self, here: Loaded) -> bool:
        return here.force >= self.force * (1 - self.how.tolerance)

    def between(self, below: End, above: Loaded) -> Loaded:
        """The increment that ends at the asked force, from an end below it and an increment at or above it."""
        tried = {above.tau: above}

        def missing(tau: float) -> float:
            if tau == below.tau:
                return below.force / self.force - 1
            if tau not in tried:
                tried[tau] = self.to(tau)
            here = tried[tau]
            error = here.force / self.force - 1
            # Brent's method stops at a zero: all within the tolerance are.
            return 0.0 if abs(error) <= self.how.tolerance else error

        # scipy.optimize takes long to import, and only a run led by a force searches.
        from scipy.optimize import brentq

        least = 4 * np.finfo(float).eps
        tau, _ = brentq(missing, below.tau, above.tau, xtol=least * above.tau, rtol=least, full_output=True, disp=False)
        left = missing(tau)
        if left != 0:
            raise NotConverged(
                f"the force jumps past the asked {self.force:.9g} at tau = {tau:.9g}, by {left:.3g} of it"
            )
        return replace(tried[tau], passes=self.passes)

    def _collapse(self, before: Loaded, here: Loaded) -> UnboundedProgram:
        """The exception with the mechanism between two ends of equal force."""
        ray = (here.solved.response.x - before.solved.response.x) / (here.tau - before.tau)
        return UnboundedProgram(
            f"the body collapses: the force of tool {self.tool} stays at {here.force:.9g} from tau = {before.tau:.6g} "
            f"to {here.tau:.6g}, below the asked {self.force:.9g}",
            ray,
        )


def tool_force(system: System, r: Floats, tool: int) -> float:
    """Normal force of a tool on the modelled body from contact forces r (c, d)."""
    return float(np.dot(system.candidates.resultant(r)[tool], system.body.scene.tools[tool].normal))


def straight(system: System, tau: float) -> float:
    """Where the first of the tools' paths bends or ends after ``tau``: until then travel is proportional to tau."""
    ahead = [t for tool in system.body.scene.tools for t, _ in tool.path if t > tau]
    require(len(ahead) > 0, "state.tau", tau, "before the end of the path")
    return min(ahead)
