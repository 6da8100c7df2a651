r"""Finite rigid motions by their rates: what a linear motion without strain goes on to.

A rate v = b + W (x - c) with a skew W moves a point in unit time along

    dy/dt = b + W (y - c),    to the end exp(W) y + ...,

a turn and a translation that strain nothing, however long they are. Points that v leaves at rest stay, and so do planes
and axes along which it moves nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from bipot.typing import Floats, max_abs

ROUND_OFF = 1e-12
"""A turn by less than this part of the way of a body is none."""


def moved_on(places: Floats, rate: Floats) -> Floats:
    """The displacement (a, d) of ``places`` (a, d) by the rigid motion that begins at the ``rate`` (a, d).

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> quarter = np.pi / 2 * np.array([[0.0, 0.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0]])
    >>> (square + moved_on(square, quarter))[1:3].round(12).tolist()
    [[0.0, 1.0], [-1.0, 1.0]]
    """
    d, centre, along = places.shape[1], places.mean(axis=0), rate.mean(axis=0)
    slope: Floats = np.linalg.lstsq(places - centre, rate - along)[0].T
    turn = (slope - slope.T) / 2
    # A translation has the round-off of one.
    turn[np.abs(turn) * np.ptp(places) <= ROUND_OFF * max_abs(rate)] = 0.0
    motion = np.zeros((d + 1, d + 1))
    motion[:d, :d], motion[:d, d] = turn, along
    whole = np.asarray(expm(motion)) - np.eye(d + 1)
    return (places - centre) @ whole[:d, :d].T + whole[:d, d]
