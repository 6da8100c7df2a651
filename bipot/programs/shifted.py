r"""The natural map of contact with De Saxce's shift frozen: the associated law of a shifted motion, for the polish.

    r - P_K(r - rho (u + shift n)) = 0,    K = {|r_t| <= mu r_n},    u = (g + du_n, du_t).

Exact Coulomb friction where shift = mu |du_t|.
"""

from __future__ import annotations

import numpy as np

from bipot.coulomb.functions import ConeMap
from bipot.programs.data import ContactRows
from bipot.typing import Floats, Ints


def shifted_map(
    rows: ContactRows, shift: Floats, rho: float, motion: Floats, r: Floats
) -> tuple[Floats, Floats, Floats]:
    """The map (m,) and its derivatives with respect to motion and to r, (m, m) each.

    ``motion`` and ``r`` (m,) are stacked: normal parts of all candidates, then the friction rows; ``shift`` (f,).
    """
    size, place = len(r), _places(rows)
    u, force = np.append(motion, 0.0)[place], np.append(r, 0.0)[place]
    u[rows.frictional, 0] += shift
    mu = np.zeros(rows.count)
    mu[rows.frictional] = np.where(rows.tied[rows.frictional], 0.0, rows.mu[rows.frictional])
    found = ConeMap().linearise(force, rho * u, mu)
    tied = rows.tied[:, None]
    value = np.where(tied, rho * u, found.value)
    identity = np.eye(place.shape[1])
    du = rho * np.where(tied[..., None], identity, found.du)
    dr = np.where(tied[..., None], 0.0, found.dr)
    # One row and column too many: what has no friction row ends there.
    stacked, by_motion, by_r = np.zeros(size + 1), np.zeros((size + 1, size + 1)), np.zeros((size + 1, size + 1))
    stacked[place] = value
    i, j = place[:, :, None], place[:, None, :]
    by_motion[i, j], by_r[i, j] = du, dr
    return stacked[:size], by_motion[:size, :size], by_r[:size, :size]


def _places(rows: ContactRows) -> Ints:
    """Where (n, t_1 ..) of each candidate (c, d) stand in a stacked vector; one past its end without friction row."""
    size = rows.count + rows.slip.size
    place = np.full((rows.count, 1 + rows.tangents), size, dtype=np.intp)
    place[:, 0] = np.arange(rows.count)
    place[rows.frictional, 1:] = rows.count + np.arange(rows.slip.size).reshape(rows.slip.shape)
    return place
