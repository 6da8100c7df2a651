"""What is asked: body, material, supports, tools with friction, loading over pseudo-time, discretisation.

Everything here is a frozen dataclass that refuses bad input when it is made. The library is free of units: use any
consistent set (N, mm, MPa or N, m, Pa).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bipot.errors import InvertedElement, SceneError, require
from bipot.fem.elements import Quadrature
from bipot.fem.kinematics import Configuration, Geometry
from bipot.fem.orientation import refuse_folded
from bipot.laws.hardening import Hardening, Perfect
from bipot.laws.von_mises import Elasticity
from bipot.mesh import Mesh, cylinder

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Material:
    """Isotropic elasticity with von Mises plasticity (5)-(9)."""

    elasticity: Elasticity
    hardening: Hardening


@dataclass(frozen=True)
class Support:
    """The displacement along ``direction`` (0 or 1) is zero on the mesh boundary ``boundary``."""

    boundary: str
    direction: int

    def __post_init__(self) -> None:
        require(self.direction in (0, 1), "support.direction", self.direction, "0 or 1")


@dataclass(frozen=True)
class FlatTool:
    """A rigid half-space behind the plane through ``point`` with normal ``normal`` (from the tool into the body).

    It translates by ``travel`` times the ``path``, piecewise linear through (tau, multiple) with tau from 0 to 1: the
    default goes once, (0, 0), (0.5, 1), (1, 0.9) unloads by a tenth. The nodes of the mesh boundaries ``candidates``
    may touch it, with Coulomb coefficient ``mu``, or ``mu_at`` of that node where given. ``mu = inf`` welds: what
    touches at the start of an increment stays tied.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    travel: tuple[float, float]
    candidates: tuple[str, ...]
    mu: float
    path: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 1.0))
    mu_at: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("point", "normal", "travel"):
            value = getattr(self, name)
            require(bool(np.isfinite(value).all()), f"tool.{name}", value, "finite")
        require(abs(np.hypot(*self.normal) - 1) < 1e-12, "tool.normal", self.normal, "a unit vector")
        require(self.mu >= 0, "mu", self.mu, ">= 0 (inf welds)")
        for node, mu in self.mu_at.items():
            require(0 <= mu < np.inf, f"mu_at[{node}]", mu, "finite and >= 0")
        taus = np.array([tau for tau, _ in self.path])
        rising = len(taus) > 1 and taus[0] == 0 and taus[-1] == 1 and bool((np.diff(taus) > 0).all())
        require(rising, "tool.path", self.path, "pairs (tau, multiple) with tau increasing from 0 to 1")
        require(bool(np.isfinite(self.path).all()), "tool.path", self.path, "finite")
        require(len(self.candidates) > 0, "tool.candidates", self.candidates, "at least one mesh boundary")

    @property
    def welded(self) -> bool:
        """Whether contact points are tied instead of sliding."""
        return bool(np.isinf(self.mu))

    def offset(self, tau: float) -> float:
        """n . x of the plane's points at pseudo-time tau."""
        return float(np.dot(self.normal, np.add(self.point, self.moved(0.0, tau))))

    def moved(self, tau: float, tau_end: float) -> Floats:
        """Displacement (d,) from pseudo-time ``tau`` to ``tau_end``.

        >>> FlatTool((0, 1), (0, -1), (0, -2), ("top",), 0.1, ((0, 0), (0.5, 1), (1, 0.9))).moved(0.0, 1.0)
        array([ 0. , -1.8])
        """
        start, end = np.interp([tau, tau_end], *self._multiples)
        return (end - start) * np.array(self.travel, dtype=np.float64)

    @cached_property
    def _multiples(self) -> tuple[Floats, Floats]:
        """Pseudo-times and multiples of the path."""
        tau, multiple = np.transpose(np.array(self.path, dtype=np.float64))
        return tau, multiple


@dataclass(frozen=True)
class Scene:
    """One body, its supports and tools. ``copies`` says how many times the modelled part makes the whole body.

    Raises:
        SceneError: an unknown boundary, an inverted element, no tool.
    """

    mesh: Mesh
    geometry: Geometry
    material: Material
    supports: tuple[Support, ...]
    tools: tuple[FlatTool, ...]
    quadrature: Quadrature = Quadrature.RADON7
    configuration: Configuration = Configuration.MIDPOINT
    copies: int = 1
    held: Ints = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require(len(self.tools) > 0, "tools", self.tools, "at least one tool")
        require(self.copies >= 1, "copies", self.copies, ">= 1")
        for tool in self.tools:
            self.mesh.boundary_nodes(*tool.candidates)
        try:
            refuse_folded({"at rest": self.mesh.nodes}, self.mesh.elements, self.geometry)
        except InvertedElement as inverted:
            raise SceneError(f"mesh: {inverted}: number nodes anticlockwise, keep r > 0") from inverted
        held = [2 * self.mesh.boundary_nodes(s.boundary) + s.direction for s in self.supports]
        object.__setattr__(self, "held", np.unique(np.concatenate([np.empty(0, np.intp), *held])))


def upsetting(
    *,
    mu: float,
    reduction: float = 0.45,
    height: float = 10.0,
    diameter: float = 10.0,
    young: float = 210_000.0,
    poisson: float = 0.3,
    hardening: Hardening | None = None,
    elements: int = 10,
    quadrature: Quadrature = Quadrature.RADON7,
    configuration: Configuration = Configuration.MIDPOINT,
) -> Scene:
    """The seed paper's cylinder between rigid flat punches, as the quarter r, z >= 0 of its meridian plane.

    The paper's data are the defaults (N, mm, MPa): 10 x 10 mm, E = 210000, nu = 0.3, sigma_Y = 300, perfect
    plasticity, 100 eight-node quads with seven points. At tau = 1 the height is (1 - reduction) of the first.

    Raises:
        SceneError: naming the field, the value and the allowed range.

    >>> upsetting(mu=0.1).tools[0].travel
    (0.0, -2.25)
    """
    require(0 < reduction < 1, "reduction", reduction, "in (0, 1)")
    require(0 < height < np.inf, "height", height, "finite and > 0")
    require(0 < diameter < np.inf, "diameter", diameter, "finite and > 0")
    require(elements >= 1, "elements", elements, ">= 1")
    punch = FlatTool(
        point=(0.0, height / 2),
        normal=(0.0, -1.0),
        travel=(0.0, -reduction * height / 2),
        candidates=("top", "side"),
        mu=mu,
    )
    return Scene(
        mesh=cylinder(diameter / 2, height / 2, elements, elements),
        geometry=Geometry.AXISYMMETRIC,
        material=Material(Elasticity(young, poisson), Perfect(300.0) if hardening is None else hardening),
        supports=(Support("axis", 0), Support("base", 1)),
        tools=(punch,),
        quadrature=quadrature,
        configuration=configuration,
        copies=2,
    )
