"""Random profiles, and their lines as dense samples that are made from corners and fillets alone."""

import numpy as np

from bipot.errors import SceneError
from bipot.tools.profiles import Profile
from bipot.typing import Floats

FAR = 20.0
"""How far open ends are sampled."""


def drawn(seed: int, closed: bool | None = None, sharp: bool | None = None) -> Profile:
    """A line through up to seven random points with one fillet, the first of a seed that is no nonsense."""
    rng = np.random.default_rng(seed)
    closed = bool(rng.integers(2)) if closed is None else closed
    sharp = bool(rng.integers(2)) if sharp is None else sharp
    count = int(rng.integers(3 if closed else 2, 8))
    while True:
        points = tuple(map(tuple, rng.uniform(-1, 1, (count, 2)).tolist()))
        try:
            return Profile(points, 0.0 if sharp else float(rng.uniform(0.01, 0.3)), closed)
        except SceneError:
            continue


def unit(vector):
    return vector / np.hypot(*vector)


def sampled(profile: Profile, step: float = 2e-4) -> Floats:
    """Places (k, 2) of the line in order, ``step`` apart."""
    corners, count = np.array(profile.points), len(profile.points)
    inner = range(count) if profile.closed else range(1, count - 1)
    radii = dict(zip(inner, np.broadcast_to(profile.fillets, len(inner)).tolist(), strict=True))
    ends, arcs = {}, {}
    for i, radius in radii.items():
        back, on = (unit(corners[j % count] - corners[i]) for j in (i - 1, i + 1))
        half = np.arccos(np.clip(back @ on, -1, 1)) / 2
        ends[i] = corners[i] + radius / np.tan(half) * back, corners[i] + radius / np.tan(half) * on
        centre = corners[i] + radius / np.sin(half) * unit(back + on) if half < np.pi / 2 else corners[i]
        first, last = (np.arctan2(*(end - centre)[::-1]) for end in ends[i])
        sweep = (last - first + np.pi) % (2 * np.pi) - np.pi
        angles = first + np.linspace(0, 1, 2 + int(radius * abs(sweep) / step)) * sweep
        arcs[i] = centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    out = []
    for i in range(count - (not profile.closed)):
        j = (i + 1) % count
        along = unit(corners[j] - corners[i])
        start = ends[i][1] if i in ends else corners[i] - FAR * along
        end = ends[j][0] if j in ends else corners[j] + FAR * along
        part = np.linspace(0, 1, 2 + int(np.hypot(*(end - start)) / step))[:, None]
        out += [start + part * (end - start), *([arcs[j]] if j in arcs else [])]
    return np.concatenate(out)


def on_line(profile: Profile, seed: int, count: int = 40) -> Floats:
    """Random places (count, 2) of the line between its open ends."""
    line = sampled(profile, 1e-3)
    return np.random.default_rng(seed).permutation(line[~profile.beyond(line)])[:count]


def turned(profile: Profile, angle: float, shift) -> Profile:
    """The profile turned to the left by an angle (radians) and then shifted."""
    points = np.array(profile.points) @ turn(angle).T + shift
    return Profile(tuple(map(tuple, points.tolist())), profile.fillets, profile.closed)


def turn(angle: float) -> Floats:
    """The rotation matrix to the left."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def reflected(profile: Profile) -> Profile:
    """The mirror image in the plane x = 0, followed the other way."""
    points = tuple((-x, y) for x, y in profile.points[::-1])
    fillets = profile.fillets[::-1] if isinstance(profile.fillets, tuple) else profile.fillets
    return Profile(points, fillets, profile.closed)
