r"""Scenes with closed answers on which element types are compared, by how many elements lie along a unit length.

Shear strength k = 1 (sigma_Y = sqrt 3), plane strain, and the answers are limit loads:

* ``block 1``, ``2``, ``4``: a block of width over height w/h between rough parallel platens, mean pressure p/k; a
  quarter, half-height one, uniform or refined towards the platen's end.
* ``punch smooth``, ``punch rough``: Prandtl's strip punch of half-width one, p/k = 2 + pi; half of a body 4 wide and 2
  deep, which holds the mechanism, uniform or refined towards the punch and its end.
* ``notch``: a strip of half-width 2 with semicircular notches of radius one (b/rho = 1), sigma_net/2k = 2 ln 2; a
  quarter, mapped from a square of n by 2 n elements.

Cook's membrane is elastic: the deflection of the middle of its free end. In a plane, plane stress with E, nu is plane
strain with E (1 + 2 nu)/(1 + nu)^2 and nu/(1 + nu): the published 23.96 of E = 1, nu = 1/3 is that of 15/16 and 1/4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bipot import (
    Configuration,
    Control,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Force,
    Geometry,
    Mesh,
    Newton,
    Perfect,
    Quadrature,
    Scene,
    Schedule,
    Support,
    Symmetry,
    Traction,
    VonMises,
    block,
    march,
)
from bipot.meshes.cells import graded
from bipot.typing import Floats
from studies.element_limits import limit_of_mesh
from studies.element_types import ElementType

SHEAR = VonMises(Elasticity(1000.0, 0.3), Perfect(np.sqrt(3.0)))
"""k = 1; its elasticity does not matter to a limit load."""

WIDTH, DEPTH = 4.0, 2.0
"""Of the half body under the punch: the rough mechanism reaches to 3, and sqrt 2 deep."""

CELLS = {1: (44, 44), 2: (62, 32), 4: (88, 22)}
"""Elements along x and y of the refined blocks, by w/h."""


@dataclass(frozen=True)
class Choice:
    """An element type with a rule."""

    type: ElementType
    quadrature: Quadrature


@dataclass(frozen=True)
class Problem:
    """What is asked: the answer, scenes of n elements along a unit length, and what is read off them.

    ``refined``, where there is one, has at most 2000 elements (twice as many triangles).
    """

    name: str
    exact: float
    uniform: Callable[[Choice, int], Scene]
    value: Callable[[Scene], float]
    refined: Callable[[Choice], Scene] | None = None


def tensor(x: Floats, y: Floats, element: Element) -> Mesh:
    """The rectangle of :func:`bipot.block` with its lines at x (m + 1,), y (n + 1,)."""
    m, n = len(x) - 1, len(y) - 1
    return spaced(block(float(m), float(n), m, n, element=element), x, y)


def spaced(even: Mesh, *lines: Floats) -> Mesh:
    """A mesh of elements of size one with its lines, axis by axis, where these (m + 1,) say."""
    at = [np.interp(even.nodes[:, k], np.arange(len(line)), line) for k, line in enumerate(lines)]
    return Mesh(np.column_stack(at), even.elements, even.boundaries)


def pressed(choice: Choice, mesh: Mesh, boundary: str, mu: float, supports: tuple[Support, ...]) -> Scene:
    """A body of strength k = 1 under a platen on the boundary, of total force one."""
    top = float(mesh.nodes[:, 1].max())
    platen = FlatTool((0.0, top), (0.0, -1.0), (0.0, 0.0), (boundary,), mu, driven_by=Force((0.0, -1.0)))
    return Scene(
        mesh=mesh,
        geometry=Geometry.PLANE_STRAIN,
        material=SHEAR,
        supports=supports,
        tools=(platen,),
        quadrature=choice.quadrature,
        volume=choice.type.volume,
    )


def rough_block(choice: Choice, x: Floats, y: Floats) -> Scene:
    """A quarter of the block with these lines."""
    mesh = tensor(x, y, choice.type.element)
    return pressed(choice, mesh, "top", np.inf, (Symmetry("left", 0), Symmetry("base", 1)))


def block_of(width: int, exact: float) -> Problem:
    """The rough block of this w/h. The force on it is that on the whole platen, of width 2 w/h."""

    def uniform(choice: Choice, n: int) -> Scene:
        return rough_block(choice, np.linspace(0, width, width * n + 1), np.linspace(0, 1, n + 1))

    def refined(choice: Choice) -> Scene:
        x, y = (graded(0.0, *side, 1 / 5) for side in zip((width, 1.0), CELLS[width], strict=True))
        return rough_block(choice, x, y)

    return Problem(f"block {width}", exact, uniform, lambda scene: limit_of_mesh(scene) / (2 * width), refined)


def punch(choice: Choice, mu: float, x: Floats, y: Floats) -> Scene:
    """Half of the body under a punch on [0, 1], an end of one of the lines x."""
    mesh = tensor(x, y, choice.type.element)
    top = mesh.boundary("top")
    under = top[(mesh.nodes[top, 0] <= 1 + 1e-9).all(axis=1)]
    mesh = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "under": under})
    held = (Symmetry("left", 0), Support("right", 0), Support("base", 0), Support("base", 1))
    return pressed(choice, mesh, "under", mu, held)


def punch_of(name: str, mu: float) -> Problem:
    """Prandtl's punch with this friction, of width 2."""

    def uniform(choice: Choice, n: int) -> Scene:
        x, y = (np.linspace(0, side, round(side) * n + 1) for side in (WIDTH, DEPTH))
        return punch(choice, mu, x, y)

    def refined(choice: Choice) -> Scene:
        x = np.append(graded(0.0, 1.0, 24, 1 / 20)[:-1], graded(1.0, WIDTH, 26, 40.0))
        return punch(choice, mu, x, graded(0.0, DEPTH, 40, 1 / 20))

    return Problem(f"punch {name}", 2 + np.pi, uniform, lambda scene: limit_of_mesh(scene) / 2, refined)


def notched(choice: Choice, n: int) -> Scene:
    """A quarter of the notched strip, pressed by rigid heads: its limit load is that of pulling."""
    square = block(1.0, 1.0, n, 2 * n, element=choice.type.element)
    s, t = square.nodes.T
    outer = 2 * np.column_stack([np.maximum(2 * t - 1, 0.0), np.minimum(2 * t, 1.0)])
    inner = np.column_stack([2 - np.cos(np.pi / 2 * t), np.sin(np.pi / 2 * t)])
    mesh = Mesh((1 - s)[:, None] * outer + s[:, None] * inner, square.elements, square.boundaries)
    edges = mesh.boundary("left")
    axis = (mesh.nodes[edges, 0] == 0).all(axis=1)
    mesh = Mesh(mesh.nodes, mesh.elements, {"base": mesh.boundary("base"), "axis": edges[axis], "head": edges[~axis]})
    return pressed(choice, mesh, "head", np.inf, (Symmetry("axis", 0), Symmetry("base", 1)))


def cook(choice: Choice, material: Elastic, n: int) -> Scene:
    """Cook's membrane, n (even) elements a side, with a force of one on its free end."""
    square = block(1.0, 1.0, n, n, element=choice.type.element)
    s, t = square.nodes.T
    return Scene(
        mesh=Mesh(np.column_stack([48 * s, 44 * s + t * (44 - 28 * s)]), square.elements, square.boundaries),
        geometry=Geometry.PLANE_STRAIN,
        material=material,
        supports=(Support("left", 0), Support("left", 1)),
        quadrature=choice.quadrature,
        configuration=Configuration.SMALL,
        loads=(Traction("right", (0.0, 1 / 16)),),
        volume=choice.type.volume,
    )


def deflection(scene: Scene) -> float:
    """Of the middle of the membrane's free end, (48, 52)."""
    *_, end = march(scene, Schedule(1), Control(Newton()))
    nodes = scene.mesh.nodes
    middle = int(np.argmin(np.hypot(*(nodes - (48.0, 52.0)).T)))
    return float(end.state.nodes[middle, 1] - nodes[middle, 1])


def cook_of(name: str, material: Elastic, exact: float) -> Problem:
    """Cook's membrane of this material."""
    return Problem(f"cook {name}", exact, lambda choice, n: cook(choice, material, n), deflection)


PROBLEMS = (
    block_of(1, 2.0),
    block_of(2, 2.42766),
    block_of(4, 3.51235),
    punch_of("smooth", 0.0),
    punch_of("rough", np.inf),
    Problem("notch", 2 * float(np.log(2)), notched, lambda scene: limit_of_mesh(scene) / 4),
    cook_of("compressible", Elastic(Elasticity(15 / 16, 0.25)), 23.96),
    cook_of("incompressible", Elastic(Elasticity(1.0, 0.4999)), math.nan),
)
