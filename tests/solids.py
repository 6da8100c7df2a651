"""Bodies in space for tests: distorted and curved blocks of every element."""

from __future__ import annotations

import numpy as np

from bipot.fem.elements import RULES
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick

SOLIDS = elements_of(3)
COMBINATIONS = [(element, rule) for element in SOLIDS for rule in RULES[element]]


def distorted(element: Element, seed: int = 0) -> Mesh:
    """A block with inner nodes moved about, faces and edges straight; it has some of its own kind inside."""
    straight = brick(2.0, 2.0, 2.0, 2, 2, 2, element=Element.H8 if element.shape.cube else Element.T4)
    inner = np.setdiff1d(np.arange(len(straight.nodes)), straight.boundary_nodes(*straight.boundaries))
    nodes = straight.nodes.copy()
    nodes[inner] += np.random.default_rng(seed).uniform(-0.2, 0.2, (len(inner), 3))
    return Mesh(nodes, straight.elements, straight.boundaries).to(element)


def curved(element: Element, seed: int = 0) -> Mesh:
    """The same with every node moved a little more: edges and faces are no longer straight."""
    mesh = distorted(element, seed)
    rng = np.random.default_rng(seed + 1)
    return Mesh(mesh.nodes + rng.uniform(-0.03, 0.03, mesh.nodes.shape), mesh.elements, mesh.boundaries)


def turned(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """The rotation by an angle about an axis, after Rodrigues."""
    e = np.array(axis) / np.linalg.norm(axis)
    W = np.cross(np.eye(3), -e)
    return np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W
