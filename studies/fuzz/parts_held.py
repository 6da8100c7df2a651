"""The parts of a scene of several, and how their own supports would carry them as they are."""

from __future__ import annotations

import numpy as np

from bipot.scene.scene import Scene
from bipot.typing import Floats, Ints
from studies.fuzz.solid_held import asked


def parts_of(scene: Scene) -> dict[str, Ints]:
    """The nodes (n,) of each part, by its name."""
    return {name: np.unique(scene.mesh.elements[of]) for name, of in scene.mesh.regions.items()}


def carried(scene: Scene, begun: float, ended: float) -> Floats:
    """Translations (a, d) of the parts between two times, by least squares nearest to what their supports ask for."""
    out, dimension = np.zeros(scene.mesh.nodes.shape), scene.mesh.dimension
    for members in parts_of(scene).values():
        own = [s for s in scene.supports if np.isin(scene.mesh.boundaries[s.boundary], members).any()]
        if own:
            ways = np.array([support.along(dimension) for support in own])
            far = [asked(support, ended) - asked(support, begun) for support in own]
            out[members] = np.linalg.lstsq(ways, far, rcond=None)[0]
    return out
