"""The penalised contact law of (26)-(29) after carrying out its infima, for d = 2 and 3.

With g⁺ = max(g0, 0) and the threshold s = mu t_n frozen, (29) is, per contact point,

    Δb_n(du_n) = inf over v >= -g⁺ of   t_n0 v + K_n/2 (du_n - v)²,
    Δb_t(du_t) = inf over v of          t_t0 · v + s |v| + K_t/2 |du_t - v|²,

whose minimisers are the fictitious increments, max(du_n - t_n0/K_n, -g⁺) and du_t + (t_t - t_t0)/K_t. The potentials
below carry *total* tractions: they are b = Δb - t_0 · du, the Moreau envelopes of the exact contact terms, so that
their gradient is -t, not -Δt.

Where the printed equations need mending: (29) takes its first infimum over all v, which leaves t_n = 0 for
every du; the constraint v >= -g⁺ is what makes contact push. (27) must read -du = -du_f + Δt/K, that is
t = t_0 - K (du - du_f), for (26) and (29) to give a traction that grows as the body penetrates. Penetration
present at the start (g0 < 0) is already carried by t_n0, hence g⁺; an initial one sets t_n0 = -K_n g0.

Shapes: du_n, gap, t_n0, threshold, k_n, k_t are (…) or numbers; du_t, t_t0 are (…, d-1). Tractions and
penalties may as well be nodal forces and forces per length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bipot.errors import require_positive
from bipot.laws.projections import DiscSlope, project_disc
from bipot.typing import Floats


@dataclass(frozen=True)
class Envelope:
    """A potential of du with its derivatives.

    ``value`` (…); ``gradient`` (…) normal or (…, d-1) tangential, minus the traction; ``hessian`` (…) or
    (…, d-1, d-1), a generalised one at kinks, symmetric positive semidefinite.
    """

    value: Floats
    gradient: Floats
    hessian: Floats


def default_penalty(young: float, edge: float, area: float) -> float:
    """Penalty E area / edge of a contact node, force per length: the stiffness of the element behind it.

    ``edge`` is the element's size normal to the contact, ``area`` the node's tributary area. Raises
    SceneError unless all three are finite and positive.

    >>> default_penalty(210e3, 0.5, 0.1)
    42000.0
    """
    require_positive(young=young, edge=edge, area=area)
    return young * area / edge


def normal_traction(du_n: ArrayLike, gap: ArrayLike, t_n0: ArrayLike, k_n: ArrayLike) -> Floats:
    """t_n = max(0, t_n0 - K_n (max(g0, 0) + du_n)), from (27) and (29), (…).

    >>> normal_traction(np.array([-0.1, 0.1]), 0.05, 0.0, 100.0).round(12).tolist()
    [5.0, 0.0]
    """
    room = np.maximum(gap, 0.0) + np.asarray(du_n, float)
    return np.maximum(0.0, np.asarray(t_n0, float) - np.asarray(k_n, float) * room)


def _trial(du_t: Floats, t_t0: Floats, k_t: ArrayLike) -> Floats:
    """t_t0 - K_t du_t, (…, d-1)."""
    return t_t0 - np.asarray(k_t, float)[..., None] * du_t


def tangential_traction(du_t: Floats, t_t0: Floats, threshold: Floats | float, k_t: ArrayLike) -> Floats:
    """t_t = projection of t_t0 - K_t du_t on the disc of radius ``threshold`` = mu t_n, (…, d-1).

    >>> tangential_traction(np.array([[0.1], [1.0]]), np.zeros((2, 1)), 2.0, 10.0).tolist()
    [[-1.0], [-2.0]]
    """
    return project_disc(_trial(du_t, t_t0, k_t), threshold)


def normal_potential(du_n: ArrayLike, gap: ArrayLike, t_n0: ArrayLike, k_n: ArrayLike) -> Envelope:
    """b_n = Δb_n - t_n0 du_n = (t_n² - t_n0²)/(2 K_n); gradient -t_n, Hessian K_n where t_n > 0, else 0."""
    k = np.asarray(k_n, float)
    t_n = normal_traction(du_n, gap, t_n0, k)
    return Envelope((t_n**2 - np.square(t_n0)) / (2.0 * k), -t_n, np.where(t_n > 0, k, 0.0))


def tangential_potential(du_t: Floats, t_t0: Floats, threshold: Floats | float, k_t: ArrayLike) -> Envelope:
    """b_t = Δb_t - t_t0 · du_t with x = t_t0 - K_t du_t and t_t its projection on the disc of radius s.

    Value (t_t · x - |t_t|²/2 - |t_t0|²/2)/K_t, gradient -t_t, Hessian K_t I where |x| <= s and
    K_t (s/|x|) (I - x ⊗ x/|x|²) outside.
    """
    k = np.asarray(k_t, float)
    x = _trial(du_t, t_t0, k)
    t_t = project_disc(x, threshold)
    value = np.sum(t_t * x - 0.5 * t_t**2 - 0.5 * np.square(t_t0), axis=-1) / k
    return Envelope(value, -t_t, k[..., None, None] * DiscSlope.at(x, threshold).by_point)
