"""Rigid tools: a surface that moves, what may touch it, and its friction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_magnitude, require_tuple, require_type
from bipot.paths import POINTS, Path, checked, multiples, require_components, vector
from bipot.tensors import norm
from bipot.tools.friction import check_friction
from bipot.tools.poses import Force, Moment, Turn, pose_size, rotation
from bipot.tools.surfaces import ACROSS, Plane, Surface, direction
from bipot.typing import Floats, max_abs

STRAIGHT_ON: Path = ((0.0, 0.0), (1.0, 1.0))


class Sampling(StrEnum):
    """Where on a surface the law of contact is posed (:mod:`bipot.contact.sampling`).

    It is at nodes, or in means around the ends of edges and corners of faces. On linear edges and faces the two are the
    same. On quadratic ones the law itself keeps the pressures of ``WEIGHTED`` from being negative.
    """

    NODES = "nodes"
    WEIGHTED = "weighted"


class Tool:
    """A rigid tool of a scene, with a ``surface`` that translates by ``travel`` times the ``path``.

    The path is piecewise linear through (tau, multiple) with tau from 0 to 1. The default moves once by the travel;
    (0, 0), (0.5, 1), (1, 0.9) retracts by a tenth. A multiple may have one number for each component of ``travel``:
    (0, 0), (0.5, (0, 1)), (1, (1, 1)) presses first and then slides. Nodes of the mesh boundaries ``candidates`` may
    touch the tool, with the Coulomb coefficient ``mu``, or ``mu_at`` of the node where given. ``mu = inf`` welds: what
    touches at the start of an increment stays tied.

    ``shear``, m from 0 to 1, caps the shear stress at m times the shear yield stress of the body there,
    |t_t| <= min(mu t_n, m k), k = sigma_Y / sqrt 3 hardened (:mod:`bipot.contact.shear`); ``shear_at`` is m by node;
    inf is no cap. With a cap, ``mu = inf`` welds nothing: the shear stress is m k where the body slides.

    The translation of a tool ``driven_by`` a force is unknown along the force; across it the tool follows its path.
    The angle of a ``turn`` that is driven by a moment is unknown too.

    ``sampling`` chooses where the law is posed: at nodes, or in means around the ends of edges or corners of faces.
    """

    travel: tuple[float, ...]
    candidates: tuple[str, ...]
    mu: float
    path: Path
    mu_at: Mapping[int, float]
    driven_by: Force | None
    sampling: Sampling
    shear: float
    shear_at: Mapping[int, float]
    turn: Turn | None = None

    @cached_property
    def face(self) -> Surface:
        """The surface at rest."""
        raise NotImplementedError

    @property
    def on_mesh(self) -> dict[str, tuple[str, ...]]:
        """The boundaries of the mesh that it names, by field."""
        return {"candidates": self.candidates}

    @property
    def flat(self) -> bool:
        """Whether the normal is the same everywhere and constant."""
        return isinstance(self.face, Plane) and self.turn is None

    def _check(self) -> None:
        """Check the fields and convert them to plain numbers."""
        object.__setattr__(self, "travel", vector(self.travel, "tool.travel"))
        check_friction(self)
        require_type(self.sampling, Sampling, "tool.sampling")
        self._check_path()
        require_type(self.driven_by, Force, "tool.driven_by", optional=True)
        object.__setattr__(self, "candidates", require_tuple(self.candidates, str, "tool.candidates"))
        require(len(self.candidates) > 0, "tool.candidates", self.candidates, "at least one mesh boundary")
        different = len(set(self.candidates)) == len(self.candidates)
        require(different, "tool.candidates", self.candidates, "different boundaries")

    def _check_path(self) -> None:
        allowed = f"{POINTS}, the first multiple 0; a multiple is a number, or one for each component of the travel"
        object.__setattr__(self, "path", checked(self.path, "tool.path", allowed))
        require(not np.any(self.path[0][1]), "tool.path", self.path, allowed)
        fits = all(np.size(multiple) in (1, len(self.travel)) for _, multiple in self.path)
        require(fits, "tool.path", self.path, f"of multiples with as many numbers as the travel {self.travel}")
        for stretch in np.abs(self.stretches).max(axis=1).tolist():
            require_magnitude(stretch, "tool.travel times a stretch of its path", LARGEST_LENGTH)

    def _check_force(self) -> None:
        """Require that the force has as many components as the travel, and that the path has none along it."""
        if self.driven_by is not None:
            require_components(self.driven_by.vector, len(self.travel), "tool.driven_by")
            across, force = self.goes_across(self.driven_by.direction), self.driven_by.vector
            require(across, "tool.travel", self.travel, f"across the force {force}, which moves it along")

    def goes_across(self, way: Floats) -> bool:
        """Whether the path has no component along a unit vector (d,), up to round-off."""
        return max_abs(self.stretches @ way) <= ACROSS * max_abs(self.stretches)

    @property
    def turned_by(self) -> Moment | None:
        """The moment that drives the tool's turn, if one does."""
        return None if self.turn is None else self.turn.driven_by

    @property
    def welded(self) -> bool:
        """Whether contact points are tied instead of sliding."""
        return math.isinf(self.mu) and math.isinf(self.shear)

    @property
    def capped(self) -> bool:
        """Whether the shear yield stress caps friction at any node."""
        return any(map(math.isfinite, (self.shear, *self.shear_at.values())))

    def distance(self, x: Floats, pose: Floats) -> Floats:
        """Gaps (…) of points x (…, d) to the surface where the tool is in the ``pose`` (p,)."""
        if self.turn is None:
            return self.face.gap(x, pose[: x.shape[-1]])
        return self.face.gap(self.own(x, pose), np.zeros(x.shape[-1]))

    def places(self, x: Floats, pose: Floats) -> Floats:
        """Magnitude (…) of the numbers of which :meth:`distance` is the difference: its round-off is relative to it."""
        if self.turn is None:
            return self.face.size(x, pose[: x.shape[-1]])
        gone, angles = np.split(pose, [x.shape[-1]])
        taken = 2 * abs(np.sin(norm(angles) / 2)) * norm(self.turn.arm(x, pose))
        return np.maximum(self.face.size(self.own(x, pose), gone), taken)

    def own(self, x: Floats, pose: Floats) -> Floats:
        """Points x (…, d) in the frame of the tool in the ``pose`` (p,): where they would be if it rested."""
        return x - pose[: x.shape[-1]] if self.turn is None else self.turn.own(x, pose)

    def going(self, x: Floats, by: Floats, pose: Floats, advance: Floats, part: float | Floats = 1.0) -> Floats:
        """Motion (…, d), seen from the tool, of points that move from x (…, d) ``by`` (…, d).

        The tool moves meanwhile by a ``part`` (…) of its ``advance`` (p,).
        """
        if self.turn is None:
            return by - np.asarray(part)[..., None] * advance[: x.shape[-1]]
        return self.turn.going(x, by, pose, advance, part)

    def arm(self, x: Floats, pose: Floats) -> Floats:
        """Vectors (…, d) from the centre about which the tool in the ``pose`` (p,) turns to x; zero if it does not."""
        return np.zeros_like(x) if self.turn is None else self.turn.arm(x, pose)

    def swept(self, x: Floats, pose: Floats, advance: Floats) -> Floats:
        """Displacement (…, d) of the tool's points at x by the turn in its ``advance`` (p,); as :meth:`arm` if none."""
        return np.zeros_like(x) if self.turn is None else self.turn.swept(x, pose, advance)

    def carried(self, middle: Floats, pose: Floats, advance: Floats) -> Floats:
        """The same as :meth:`swept` of points whose paths have their middles at ``middle`` (…, d)."""
        return np.zeros_like(middle) if self.turn is None else self.turn.carried(middle, pose, advance)

    def swirl(self, arm: Floats) -> Floats:
        """Velocities (…, d) per angle of the tool's points at the ends of ``arm`` (…, d); zero if it does not turn."""
        return np.zeros_like(arm) if self.turn is None else self.turn.swirl(arm)

    def turned(self, vectors: Floats, pose: Floats) -> Floats:
        """Vectors (…, d) given in the frame of the tool, turned to its ``pose`` (p,)."""
        return vectors if self.turn is None else vectors @ rotation(pose[vectors.shape[-1] :]).T

    def pose(self, tau: float) -> Floats:
        """Pose (p,): the tool's displacement along its path since rest, and its angles."""
        out = np.zeros(pose_size(len(self.travel)))
        out[: len(self.travel)] = self.moved(0.0, tau)
        if self.turn is not None:
            out[len(self.travel) :] = self.turn.at(tau) * self.turn.about
        return out

    def moved(self, tau: float, tau_end: float) -> Floats:
        """Displacement (d,) along the path from pseudo-time ``tau`` to ``tau_end``.

        >>> FlatTool((0, 1), (0, -1), (0, -2), ("top",), 0.1, ((0, 0), (0.5, 1), (1, 0.9))).moved(0.0, 1.0)
        array([ 0. , -1.8])
        """
        taus, multiples = self._multiples
        start, end = np.transpose([np.interp([tau, tau_end], taus, component) for component in multiples.T])
        return (end - start) * np.array(self.travel, dtype=np.float64)

    @cached_property
    def stretches(self) -> Floats:
        """The tool's displacement (s, d) from each point of its path to the next."""
        return np.diff(self._multiples[1], axis=0) * self.travel

    @cached_property
    def _multiples(self) -> tuple[Floats, Floats]:
        """Pseudo-times (k,) of the path and the multiples (k, d) there, one for each component of the travel."""
        return multiples(self.path, len(self.travel))


@dataclass(frozen=True)
class FlatTool(Tool):
    """A rigid half-space behind the plane through ``point`` with normal ``normal`` (from the tool into the body).

    Vectors have two components in a plane, three in space. The other fields are as in :class:`Tool`.

    Raises:
        SceneError: a vector that is not two or three finite numbers, a normal that is no unit vector, a path that is
            not pairs from (0, 0) to tau = 1, a coefficient below zero, ``mu_at`` where all is welded; a force that
            pulls the tool off the body, a path that goes along the force.
    """

    point: tuple[float, ...]
    normal: tuple[float, ...]
    travel: tuple[float, ...]
    candidates: tuple[str, ...]
    mu: float
    path: Path = STRAIGHT_ON
    mu_at: Mapping[int, float] = field(default_factory=dict)
    driven_by: Force | None = None
    sampling: Sampling = Sampling.NODES
    shear: float = math.inf
    shear_at: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", vector(self.point, "tool.point", LARGEST_LENGTH))
        object.__setattr__(self, "normal", direction(self.normal, "tool.normal"))
        self._check()
        for name in ("point", "travel"):
            require_components(getattr(self, name), len(self.normal), f"tool.{name}")
        self._check_force()
        if self.driven_by is not None:
            presses, allowed = self.driven_by.direction @ self.normal, "not against the normal: it pulls off"
            require(bool(presses >= -ACROSS), "tool.driven_by", self.driven_by.vector, allowed)

    @cached_property
    def face(self) -> Plane:
        """The plane at rest."""
        return Plane(self.point, self.normal)


@dataclass(frozen=True)
class ShapedTool(Tool):
    """A rigid tool of any ``surface``, e.g. ``Circle((0, 12), 2)``; the other fields are as in :class:`Tool`.

    It follows its path and may ``turn`` meanwhile; slips are relative to the point of the tool that is touched.

    Raises:
        SceneError: as :class:`FlatTool`, except that a force may have any direction; a ``turn`` of another type.
    """

    surface: Surface
    travel: tuple[float, ...]
    candidates: tuple[str, ...]
    mu: float
    path: Path = STRAIGHT_ON
    mu_at: Mapping[int, float] = field(default_factory=dict)
    driven_by: Force | None = None
    sampling: Sampling = Sampling.NODES
    shear: float = math.inf
    shear_at: Mapping[int, float] = field(default_factory=dict)
    turn: Turn | None = None

    def __post_init__(self) -> None:
        require_type(self.surface, Surface, "tool.surface")
        require_type(self.turn, Turn, "tool.turn", optional=True)
        self._check()
        self._check_force()

    @cached_property
    def face(self) -> Surface:
        """The surface at rest."""
        return self.surface
