"""The description of a run in its file: the scene in plain numbers and words, and the versions used."""

from __future__ import annotations

import platform
import sys
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import VonMises
from bipot.scene.drives import lever
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.poses import Turn
from bipot.tools.surfaces import Plane, Surface

Parameters = Mapping[str, Any]
"""The parameters that identify a run: JSON values by name."""

PACKAGES = ("bipot", "numpy", "scipy", "cvxpy", "clarabel")


def versions() -> dict[str, str]:
    """Versions of this package, of its numerical dependencies, and of Python."""
    return {**{name: version(name) for name in PACKAGES}, "python": platform.python_version()}


def describe(scene: Scene) -> dict[str, Any]:
    """The scene in plain numbers and words, for readers of the file; arrays of materials and loads whole and exact."""
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
        return _described(scene)


def _described(scene: Scene) -> dict[str, Any]:
    material = scene.material
    return {
        "geometry": scene.geometry.value,
        "element": scene.mesh.element.value,
        "quadrature": scene.rule.value,
        "volume": scene.volume_change.value,
        "configuration": scene.configuration.value,
        "young": material.elasticity.young,
        "poisson": material.elasticity.poisson,
        "yield_stress": float(material.yield_stress(0.0)),
        "material": repr(material),
        "perfectly_plastic": isinstance(material, VonMises) and isinstance(material.hardening, Perfect),
        "supports": [_support(s) for s in scene.supports],
        "loads": [repr(load) for load in scene.loads],
        "tools": [
            {
                **_surface(t.face),
                **{name: getattr(t, name) for name in ("travel", "path", "candidates", "mu", "shear")},
                "mu_at": {str(node): mu for node, mu in t.mu_at.items()},
                "shear_at": {str(node): shear for node, shear in t.shear_at.items()},
                "sampling": t.sampling.value,
                **({} if t.turn is None else _turn(scene, t.turn, t.face)),
                "driven_by": t.driven_by and {"vector": t.driven_by.vector, "amplitude": t.driven_by.amplitude.points},
            }
            for t in scene.tools
        ],
    }


def _turn(scene: Scene, turn: Turn, surface: Surface) -> dict[str, Any]:
    """A turn in words; for one driven by a moment with the lever that multiplies its angle in ``translation``."""
    said = {"turn": repr(turn)}
    return said if turn.driven_by is None else {**said, "lever": lever(surface, turn, scene.mesh.size)}


def _surface(surface: Surface) -> dict[str, Any]:
    """A plane's numbers by name, any other surface in words."""
    if isinstance(surface, Plane):
        return {"point": surface.point, "normal": surface.normal}
    return {"surface": repr(surface)}


def _support(support: Support) -> dict[str, Any]:
    """The boundary of a support, whether it is a plane of symmetry, and its motion if it is driven."""
    said = {"boundary": support.boundary, "direction": support.direction, "symmetry": isinstance(support, Symmetry)}
    if not isinstance(support, Prescribed):
        return said
    return {**said, "displacement": support.displacement, "amplitude": support.amplitude.points}
