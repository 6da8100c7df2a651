"""Rigid tools: a surface that moves, what may touch it, and its friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np

from bipot.errors import (
    LARGEST_LENGTH,
    LARGEST_STRESS,
    require,
    require_count,
    require_magnitude,
    require_number,
    require_tuple,
    require_type,
)
from bipot.frozen import FrozenMap
from bipot.paths import POINTS, RAMP, Amplitude, Path, checked, multiples, pair
from bipot.poses import Turn, rotation
from bipot.surfaces import ACROSS, Plane, Surface, direction, place
from bipot.typing import Floats

LARGEST_MU = 1e12

STRAIGHT_ON: Path = ((0.0, 0.0), (1.0, 1.0))


class Sampling(StrEnum):
    """Where on a surface the law of contact is posed (:mod:`bipot.sampling`).

    On linear edges the two are one; on quadratic ones ``WEIGHTED`` has pressures that the law itself keeps above zero.
    """

    NODES = "nodes"
    WEIGHTED = "weighted"


@dataclass(frozen=True)
class Force:
    """What drives a tool: the force ``vector`` (d,) times the ``amplitude``, on the whole tool.

    A force without a direction, or one that would let go of the body (an amplitude that comes back to zero) leaves
    the tool's place open: it is refused.
    """

    vector: tuple[float, float]
    amplitude: Amplitude = RAMP

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", pair(self.vector, "force.vector", "two finite numbers"))
        require_type(self.amplitude, Amplitude, "force.amplitude")
        require(any(self.vector), "force.vector", self.vector, "not zero: without a force use the tool's path")
        for size in (self.size, self.size * self.amplitude.largest):
            require_magnitude(size, "force.vector, its amplitude with it", LARGEST_STRESS)
        allowed = "above zero after tau = 0, where it is not below: to let go, drive the tool by a path alone"
        later = all(multiple > 0 for tau, multiple in self.amplitude.points if tau > 0)
        require(later and self.amplitude.at(0.0) >= 0, "force.amplitude", self.amplitude.points, allowed)

    @property
    def size(self) -> float:
        """|vector|."""
        return float(np.hypot(*self.vector))

    @property
    def direction(self) -> Floats:
        """The unit vector (d,) of the force."""
        return np.array(self.vector) / self.size

    def at(self, tau: float) -> float:
        """The force along its direction at pseudo-time ``tau``."""
        return self.size * self.amplitude.at(tau)


class Tool:
    """What scenes take: a rigid tool with a ``surface`` that translates by ``travel`` times the ``path``.

    The path is piecewise linear through (tau, multiple) with tau from 0 to 1: the default goes once, (0, 0), (0.5, 1),
    (1, 0.9) unloads by a tenth. A multiple may be a pair, one for each component of ``travel``: (0, 0), (0.5, (0, 1)),
    (1, (1, 1)) presses first and then slides. The nodes of the mesh boundaries ``candidates`` may touch it, with
    Coulomb coefficient ``mu``, or ``mu_at`` of that node where given. ``mu = inf`` welds: what touches at the start of
    an increment stays tied.

    ``driven_by`` a force, the tool's translation along that is an unknown; across it the tool goes its path.

    ``sampling`` says where the law is posed: at the nodes, or in the mean around the ends of edges.
    """

    travel: tuple[float, float]
    candidates: tuple[str, ...]
    mu: float
    path: Path
    mu_at: Mapping[int, float]
    driven_by: Force | None
    sampling: Sampling
    turn: Turn | None = None

    @cached_property
    def face(self) -> Surface:
        """The surface at rest."""
        raise NotImplementedError

    @property
    def flat(self) -> bool:
        """Whether the normal is the same everywhere, and stays so."""
        return isinstance(self.face, Plane) and self.turn is None

    def _check(self) -> None:
        """Refuse what no tool has, and keep the rest as plain numbers."""
        object.__setattr__(self, "travel", pair(self.travel, "tool.travel", "two finite numbers"))
        require_number(self.mu, "mu")
        object.__setattr__(self, "mu", float(self.mu))
        require(0 <= self.mu <= LARGEST_MU or self.welded, "mu", self.mu, f">= 0, to {LARGEST_MU:g} (inf welds)")
        require_type(self.mu_at, Mapping, "mu_at")
        require(not (self.welded and self.mu_at), "mu_at", dict(self.mu_at), "empty where mu = inf")
        for node, mu in self.mu_at.items():
            require_count(node, "mu_at node", 0)
            require_number(mu, f"mu_at[{node}]")
            require(0 <= mu <= LARGEST_MU, f"mu_at[{node}]", mu, f"finite and >= 0, to {LARGEST_MU:g}")
        object.__setattr__(self, "mu_at", FrozenMap({int(node): float(mu) for node, mu in self.mu_at.items()}))
        require_type(self.sampling, Sampling, "tool.sampling")
        self._check_path()
        require_type(self.driven_by, Force, "tool.driven_by", optional=True)
        object.__setattr__(self, "candidates", require_tuple(self.candidates, str, "tool.candidates"))
        require(len(self.candidates) > 0, "tool.candidates", self.candidates, "at least one mesh boundary")
        different = len(set(self.candidates)) == len(self.candidates)
        require(different, "tool.candidates", self.candidates, "different boundaries")

    def _check_path(self) -> None:
        allowed = f"{POINTS}, the first multiple 0; a multiple is a number, or a pair"
        object.__setattr__(self, "path", checked(self.path, "tool.path", allowed))
        require(not np.any(self.path[0][1]), "tool.path", self.path, allowed)
        for stretch in np.abs(np.diff(self._multiples[1], axis=0) * self.travel).max(axis=1).tolist():
            require_magnitude(stretch, "tool.travel times a stretch of its path", LARGEST_LENGTH)

    @property
    def welded(self) -> bool:
        """Whether contact points are tied instead of sliding."""
        return bool(np.isinf(self.mu))

    def distance(self, x: Floats, pose: Floats) -> Floats:
        """Gaps (…) of points x (…, d) to the surface where the tool is in the ``pose`` (3,)."""
        return self.face.gap(x, pose[:2]) if self.turn is None else self.face.gap(self.own(x, pose), np.zeros(2))

    def places(self, x: Floats, pose: Floats) -> Floats:
        """Magnitude (…) of the numbers whose difference :meth:`distance` is."""
        return self.face.size(x, pose[:2]) if self.turn is None else self.face.size(self.own(x, pose), pose[:2])

    def own(self, x: Floats, pose: Floats) -> Floats:
        """Points x (…, d) as the tool in the ``pose`` (3,) sees them: where they would be if it rested."""
        return x - pose[:2] if self.turn is None else self.turn.own(x, pose)

    def going(self, x: Floats, by: Floats, pose: Floats, advance: Floats) -> Floats:
        """What points x (…, d) that go ``by`` (…, d) go by as the tool sees it, which goes on by ``advance`` (3,)."""
        return by - advance[:2] if self.turn is None else self.turn.going(x, by, pose, advance)

    def turned(self, vectors: Floats, pose: Floats) -> Floats:
        """Vectors (…, d) of the tool at rest as they are in its ``pose`` (3,)."""
        return vectors if self.turn is None else vectors @ rotation(pose[2]).T

    def pose(self, tau: float) -> Floats:
        """How far (3,) the tool has gone along its path since rest, and by what angle turned."""
        return np.array([*self.moved(0.0, tau), 0.0 if self.turn is None else self.turn.at(tau)])

    def moved(self, tau: float, tau_end: float) -> Floats:
        """Displacement (d,) along the path from pseudo-time ``tau`` to ``tau_end``.

        >>> FlatTool((0, 1), (0, -1), (0, -2), ("top",), 0.1, ((0, 0), (0.5, 1), (1, 0.9))).moved(0.0, 1.0)
        array([ 0. , -1.8])
        """
        taus, multiples = self._multiples
        start, end = np.transpose([np.interp([tau, tau_end], taus, own) for own in multiples.T])
        return (end - start) * np.array(self.travel, dtype=np.float64)

    @cached_property
    def _multiples(self) -> tuple[Floats, Floats]:
        """Pseudo-times (k,) of the path and the multiples (k, d) there, one for each component of the travel."""
        return multiples(self.path)


@dataclass(frozen=True)
class FlatTool(Tool):
    """A rigid half-space behind the plane through ``point`` with normal ``normal`` (from the tool into the body).

    All else is as in :class:`Tool`.

    Raises:
        SceneError: a vector that is not two finite numbers, a normal that is none, a path that is not pairs from
            (0, 0) to tau = 1, a coefficient below zero, ``mu_at`` where all is welded; a force that pulls the tool off
            the body, a path that goes along the force.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    travel: tuple[float, float]
    candidates: tuple[str, ...]
    mu: float
    path: Path = STRAIGHT_ON
    mu_at: Mapping[int, float] = field(default_factory=dict)
    driven_by: Force | None = None
    sampling: Sampling = Sampling.NODES

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", place(self.point, "tool.point"))
        object.__setattr__(self, "normal", direction(self.normal, "tool.normal"))
        self._check()
        if self.driven_by is not None:
            self._check_force(self.driven_by)

    def _check_force(self, force: Force) -> None:
        presses = float(force.direction @ self.normal)
        require(presses >= -ACROSS, "tool.driven_by", force.vector, "not against the normal: it pulls off")
        path = self._multiples[1] * self.travel
        along = bool((np.abs(path @ force.direction) <= ACROSS * np.abs(path).max()).all())
        require(along, "tool.travel", self.travel, f"across the force {force.vector}, which moves it along")

    @cached_property
    def face(self) -> Plane:
        """The plane at rest."""
        return Plane(self.point, self.normal)

    def offset(self, moved: Floats) -> float:
        """n . x of the plane's points where the tool has ``moved`` (d,) since rest."""
        return self.face.offset(moved)


@dataclass(frozen=True)
class ShapedTool(Tool):
    """A rigid tool of any ``surface``, e.g. ``Circle((0, 12), 2)``; all else is as in :class:`Tool`.

    It goes its path, and may ``turn`` meanwhile: what slips on it slips against the point of the tool that it touches.
    So far no force drives it, and the law is posed at the nodes.

    Raises:
        SceneError: as :class:`FlatTool`; a turn that is none, a force that drives it, weighted sampling.
    """

    surface: Surface
    travel: tuple[float, float]
    candidates: tuple[str, ...]
    mu: float
    path: Path = STRAIGHT_ON
    mu_at: Mapping[int, float] = field(default_factory=dict)
    driven_by: Force | None = None
    sampling: Sampling = Sampling.NODES
    turn: Turn | None = None

    def __post_init__(self) -> None:
        require_type(self.surface, Surface, "tool.surface")
        require_type(self.turn, Turn, "tool.turn", optional=True)
        self._check()
        require(self.driven_by is None, "tool.driven_by", self.driven_by, "None: only a FlatTool is driven by a force")
        nodal = self.sampling is Sampling.NODES
        require(nodal, "tool.sampling", self.sampling, "Sampling.NODES: only a FlatTool is met in the mean")

    @cached_property
    def face(self) -> Surface:
        """The surface at rest."""
        return self.surface


AnyTool = FlatTool | ShapedTool
"""The tools that there are."""
