"""Random meshes of the fuzz study: bodies, distortions, elements and their rules."""

from __future__ import annotations

import numpy as np

from bipot.fem.elements import RULES, Quadrature
from bipot.fem.projection import VOLUMES, VolumeChange
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder, ring
from bipot.typing import Ints
from studies.independent.element import orientation

Rng = np.random.Generator

OTHERS = (Element.T3, Element.T6, Element.Q4, Element.Q9)
SHARE = 0.3
"""Of the scenes are not of eight-node quadrilaterals."""

LEAST_JACOBIAN = 0.05
"""Of a distorted mesh, over the mean of its element."""


def made(rng: Rng, body: str, size: float) -> Mesh:
    """A body whose longest side is about ``size``, of 1 to 4 elements a side (seldom 5)."""
    n, m = (int(k) for k in rng.choice([1, 2, 3, 4, 5], size=2, p=[0.2, 0.35, 0.27, 0.13, 0.05]))
    aspect = 2.0 ** rng.uniform(-1.5, 1.5)
    width, height = size * min(1.0, aspect), size * min(1.0, 1 / aspect)
    if body == "block":
        return block(width, height, n, m, element=Element.Q8)
    if body == "cylinder":
        return cylinder(width, height, n, m, element=Element.Q8)
    inner = width * rng.uniform(0.2, 2.0)
    return ring(inner, inner + width, height, n, m, element=Element.Q8)


def distorted(rng: Rng, mesh: Mesh) -> Mesh:
    """Inner nodes moved, sides straight or curved, as long as Jacobians stay positive everywhere."""
    if rng.random() < 0.5:
        return mesh
    elements = mesh.elements
    spread = np.linalg.norm(mesh.nodes[elements[:, 0]] - mesh.nodes[elements[:, 2]], axis=1).min()
    outer = mesh.boundary_nodes(*mesh.boundaries)
    curved = rng.random() < 0.5
    shift = rng.uniform(-1, 1, mesh.nodes.shape)
    shift[outer] = 0.0
    for part in (0.25, 0.12, 0.05):
        nodes = mesh.nodes + part * spread * shift
        if not curved:
            corners = np.stack([elements[:, :4], np.roll(elements[:, :4], -1, axis=1)])
            nodes[elements[:, 4:]] = nodes[corners].mean(axis=0)
        if orientation(nodes, elements, axisymmetric=False) > LEAST_JACOBIAN:
            return Mesh(nodes, elements, mesh.boundaries)
    return mesh


def in_other_elements(rng: Rng, mesh: Mesh) -> Mesh:
    """Seldom the same body in other elements, unless they were folded: inner nodes of T6 and Q9 moved a little."""
    element = OTHERS[rng.integers(len(OTHERS))]
    if rng.random() >= SHARE:
        return mesh
    other = mesh.to(Element.Q4)
    if element.corners == 3:
        other = Mesh(other.nodes, _halved(rng, other.elements), other.boundaries)
    other = (mesh if element is Element.Q9 else other).to(element)
    if element.quadratic:
        nodes, size = other.nodes.copy(), np.sqrt(np.prod(np.ptp(other.nodes, axis=0)) / len(other.elements))
        inner = np.setdiff1d(np.arange(len(nodes)), other.boundary_nodes(*other.boundaries))
        nodes[inner] += 0.05 * size * rng.uniform(-1, 1, (len(inner), 2))
        other = Mesh(nodes, other.elements, other.boundaries)
    return other if orientation(other.nodes, other.elements, axisymmetric=False) > LEAST_JACOBIAN else mesh


def _halved(rng: Rng, quads: Ints) -> Ints:
    """Two triangles (2 e, 3) for each of the quadrilaterals (e, 4), along either diagonal."""
    turned = np.where(rng.random((len(quads), 1)) < 0.5, quads, np.roll(quads, 1, axis=1))
    return turned[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def rule(rng: Rng, mesh: Mesh, drawn: str) -> Quadrature:
    """The rule ``drawn`` for eight-node quadrilaterals, one of the element's own kind for others."""
    if mesh.element is Element.Q8:
        return Quadrature(drawn)
    rules = RULES[mesh.element]
    return rules[rng.integers(len(rules))]


def volume(rng: Rng, mesh: Mesh) -> VolumeChange:
    """As it is in half of the scenes, or any representation that the element may have."""
    stable = VOLUMES[mesh.element]
    return VolumeChange.AS_IS if rng.random() < 0.5 else stable[rng.integers(len(stable))]
