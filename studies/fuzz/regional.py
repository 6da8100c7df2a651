"""Scenes of the fuzz study of several materials: those of the other kinds, of the same seed, with regions.

One or two regions have a material of their own: of elements on one side of the middle along an axis, or of any. Their
yield stresses differ from the body's by up to a factor of thirty, their elasticity is drawn as that of a body, and some
never yield.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bipot.laws.material import Elastic, Material
from bipot.laws.von_mises import VonMises
from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from bipot.typing import Bools
from studies.fuzz.meshes import Rng
from studies.fuzz.scenes import Drawn, draw, drawn_material
from studies.fuzz.shaped import draw_shaped, tried
from studies.fuzz.solid_scenes import draw_solid, drawn_solid_material
from studies.fuzz.solid_shaped import draw_solid_shaped

SHAPED, HALVED, TWO, ELASTIC = 0.3, 0.6, 0.3, 0.15
"""How probable shaped tools are, a region of one side, two regions, and that one never yields."""

SPREAD = 1.5
"""Decades by which a region's yield stress is above or below the body's, at most."""

Draw = Callable[[int], Drawn]


def draw_regional(seed: int) -> Drawn:
    """The scene in a plane of ``seed`` with regions; always the same.

    Raises:
        SceneError: no draw made a scene that the library takes.
    """
    return _with_regions(np.random.default_rng([seed, 40]), seed, draw, draw_shaped, drawn_material)


def draw_solid_regional(seed: int) -> Drawn:
    """The same of the body in space of ``seed``."""
    return _with_regions(np.random.default_rng([seed, 41]), seed, draw_solid, draw_solid_shaped, drawn_solid_material)


def _with_regions(
    rng: Rng, seed: int, flat: Draw, shaped: Draw, drawn_metal: Callable[[Rng, float], VonMises]
) -> Drawn:
    drawn = (shaped if rng.random() < SHAPED else flat)(seed)
    scene, stress = drawn.scene, float(drawn.scene.material.yield_stress(np.zeros(1))[0])

    def metal() -> Material:
        own = drawn_metal(rng, stress * 10.0 ** rng.uniform(-SPREAD, SPREAD))
        return Elastic(own.elasticity) if rng.random() < ELASTIC else own

    def made() -> Scene:
        number, mesh = _numbers(rng, scene.mesh), scene.mesh
        marks = {f"region {k}": number == k for k in (1, 2) if (number == k).any()}
        mesh = Mesh(mesh.nodes, mesh.elements, mesh.boundaries, marks)
        return replace(scene, mesh=mesh, regions={name: metal() for name in marks})

    return replace(drawn, scene=tried(made))


def _numbers(rng: Rng, mesh: Mesh) -> np.ndarray:
    """The number (e,) of each element's region, 0 of none; at least one is of some."""
    number = _some(rng, mesh).astype(int)
    if rng.random() < TWO:
        number[_some(rng, mesh)] = 2
    return number


def _some(rng: Rng, mesh: Mesh) -> Bools:
    """Elements (e,) on one side of the middle, or any; one at least."""
    middles = mesh.nodes[mesh.elements].mean(axis=1)
    some = rng.random(len(middles)) < 0.5
    if rng.random() < HALVED:
        x = middles[:, rng.integers(mesh.dimension)]
        some = (x < x.mean()) == bool(rng.random() < 0.5)
    some[rng.integers(len(some))] = True
    return some
