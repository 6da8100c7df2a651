r"""What proofs of collapse have in common in the plane and in space, from plain arrays: nothing of the library.

A motion v of the nodes and w of the driven tools gains F . v + P . w from the loads. Where no volume changes and
contacts open by at least mu times their slip (those that are welded move along), no stress within the yield surface and
no forces within Coulomb's cone do more work than sum_q w sqrt(2/3) sigma_Y |dev D(v)|, sigma_Y the one that hardening
ends with. A load that gains more is carried by none of them. A motion that costs nothing until an open contact lands
proves nothing: the load may be carried from there on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from studies.independent.element import Bools, Floats

HARDENED = 1e9
"""A plastic strain after which a yield stress that has an end has come to it."""

FEW = 8 * float(np.finfo(np.float64).eps)
"""Round-off of what a strain is summed of, over the motion."""

FREE = 1e-12
"""A component of a unit vector below this is none."""

RESTS = 1e-9
"""A rigid motion that moves held nodes by less than this is one that supports allow."""


@dataclass(frozen=True)
class Proof:
    """Over the ``gain`` of the load: change of volume as work of the yield stress, and dissipation, ``carried``.

    Over the largest motion of a node or tool: how far contacts that touch are ``overtaken``, open ones come ``nearer``,
    and held nodes move, ``held``.
    """

    gain: float
    volume: float
    carried: float
    overtaken: float
    nearer: float
    held: float


@dataclass(frozen=True)
class Worked:
    """What a motion (a, d) of nodes and ``ways`` (m,) of driven tools gain under ``loads`` (a, d) and ``force`` (m,).

    ``spent`` is what changes of volume and flow take (:func:`spent`), ``closing`` what :func:`closing` finds, ``held``
    by how much held nodes move at most.
    """

    motion: Floats
    ways: Floats
    loads: Floats
    force: Floats
    spent: tuple[float, float]
    closing: tuple[float, float]
    held: float

    def proof(self) -> Proof:
        """Each over the gain, or over the largest motion; one that gains nothing proves nothing."""
        gain = float(np.vdot(self.loads, self.motion) + self.force @ self.ways)
        largest = float(max(np.abs(self.motion).max(), np.abs(self.ways).max(initial=0.0)))
        if not (gain > 0 and largest > 0):
            return Proof(gain, *[np.inf] * 5)
        (volume, carried), (overtaken, nearer) = self.spent, self.closing
        return Proof(gain, volume / gain, carried / gain, overtaken / largest, nearer / largest, self.held / largest)


def spent(
    G: Floats, blur: Floats, volume: Floats, sigma_y: Floats, fitted: Callable[[Floats], Floats]
) -> tuple[float, float]:
    """Largest change of volume as work of the yield stress, and dissipation, beyond the round-off of the motion.

    Of gradients G (e, q, 3, 3) with their round-off ``blur`` (e, q), in volumes (e, q) with the yield stress (e, q).
    Changes of volume are ``fitted`` as the elements have them. Where the yield stress is infinite nothing may strain.
    """
    strain = (G + G.swapaxes(-1, -2)) / 2
    change = np.trace(strain, axis1=-2, axis2=-1)
    deviator = strain - change[..., None, None] / 3 * np.eye(3)
    size = np.sqrt(np.einsum("eqij,eqij->eq", deviator, deviator))
    change, size = (np.maximum(value - blur, 0.0) for value in (np.abs(fitted(change)), size))
    yields = np.isfinite(sigma_y)
    if size[~yields].any():
        return np.inf, np.inf
    # Volume is asked as the library asks it, by what work it may take: that of the yield stress.
    worst = float(change.max() * volume.sum() * sigma_y.max(initial=0.0, where=yields))
    return worst, float(np.sqrt(2 / 3) * (volume[yields] * sigma_y[yields] * size[yields]).sum())


def closing(opened: Floats, slip: Floats, mu: Floats, welded: Bools, touching: Bools) -> tuple[float, float]:
    """How far (a length) contacts (c,) close or open by less than mu times their slip, and how far open ones approach.

    That by more than contacts open by as they slip: the body itself slips without opening.
    """
    dilated = np.where(welded, 0.0, mu) * slip
    short = np.where(welded, np.abs(opened) + slip, dilated - opened)[touching].max(initial=0.0)
    nearer = -opened[~touching].min(initial=0.0) - 2 * dilated[touching].max(initial=0.0)
    return float(short), max(float(nearer), 0.0)


@dataclass(frozen=True)
class Pressed:
    """How points (c,) go that a flat tool may touch, ``v`` (c, d), and the tool with a ``normal`` and a ``direction``.

    Both are unit vectors (d,): a force drives the tool along the latter. ``mu`` (c,) is the friction of the points,
    ``touching`` and ``welded`` (c,) say which of them touch, and are tied where they do.
    """

    v: Floats
    mu: Floats
    touching: Bools
    welded: Bools
    normal: Floats
    direction: Floats

    def farthest(self, following: bool) -> float:
        """The longest way of the tool on which no contact is overtaken, inf if none and nothing else ends it.

        Where no contact ends it the tool rests if it would land on the body, or goes as far as it comes no nearer to
        it, where it is ``following``.
        """
        tied, rubs = self.touching & self.welded, self.touching & ~self.welded
        ends = np.concatenate([self.v[tied] @ self.direction, self._ends()[rubs]])
        if np.isfinite(ends).any():
            return float(ends.min())
        lands = float(self.normal @ self.direction)
        if lands <= FREE:
            return np.inf
        return float((self.v @ self.normal).min() / lands) if following else 0.0

    def _ends(self) -> Floats:
        r"""Ways (c,) after which n . (v - w d) = mu |v_t - w d_t|, inf of points that the tool leaves.

        From where the slip is least, s, they are the last x of o - x b >= mu sqrt(s^2 + x^2 t^2): with o what is opened
        there, b = n . d and t = |d_t| the smaller root of (b^2 - mu^2 t^2) x^2 - 2 o b x + o^2 - mu^2 s^2 = 0 or, of a
        tool that slips more than it presses, the larger. Where the cone is overtaken whatever the way, x = 0.
        """
        b = float(self.normal @ self.direction)
        across = self.direction - b * self.normal
        t = float(np.linalg.norm(across))
        first = self.v @ across / t**2 if t > FREE else np.zeros(len(self.v))
        left = self.v - first[:, None] * self.direction
        opened = left @ self.normal
        mu, least = self.mu, np.linalg.norm(left - opened[:, None] * self.normal, axis=1)
        steep = b**2 - (mu * t) ** 2
        square = mu**2 * ((t * opened) ** 2 + steep * least**2)
        ends = (b > mu * t) | ((opened >= 0) & (square >= 0))
        root = np.sqrt(np.maximum(square, 0.0))
        divisor = opened * b + root
        sums = divisor > 0
        quotient = (opened**2 - (mu * least) ** 2) / np.where(sums, divisor, 1.0)
        other = (opened * b - root) / np.where(sums | (steep == 0), 1.0, steep)
        x = np.where(ends, np.where(sums, quotient, other), 0.0)
        return np.where(b + mu * t > FREE, first + x, np.inf)


def ways_of(farthest: list[float], force: Floats, loads: Floats, motion: Floats) -> Floats:
    """Ways (m,) of driven tools that go so far at most; those that nothing ends make the whole gain one at least."""
    most = (1 + abs(float(np.vdot(loads, motion)))) / force
    return np.where(np.isinf(farthest), most, farthest)


def rigid(motion: Floats, every: Floats, barred: Floats) -> Floats:
    """The rigid motion (a, d) nearest to ``motion`` (a, d) that supports allow, of ``every`` (k, a, d) there is.

    ``barred`` (k, ...) are what these are where nodes are held. What a search leaves of strain beside a rigid motion
    dissipates nothing by itself, but times a stress that hardens for ever.
    """
    basis, held = every.reshape(len(every), -1).T, barred.reshape(len(every), -1).T
    _, sizes, mixed = np.linalg.svd(held, full_matrices=False)
    allowed = basis @ mixed[sizes <= RESTS * np.abs(basis).max()].T
    if not allowed.size:
        return np.zeros_like(motion)
    return (allowed @ np.linalg.lstsq(allowed, motion.ravel())[0]).reshape(motion.shape)
