"""Simple shear and rigid rotation of an elastic body by the rate of Jaumann."""

from __future__ import annotations

import numpy as np

from bipot import Configuration, Elasticity, Element, Geometry, Mesh, Quadrature, block
from bipot.fem.elements import tabulated
from bipot.fem.kinematics import Kinematics
from bipot.typing import Floats
from studies.verification.case import Asked, Case, Subject, Watch

ELASTIC = Elasticity(2.6, 0.3)
TURNED = 3.0
"""Angle of the rigid rotation, in one increment."""


def increment(mesh: Mesh, du: Floats, nodes: Floats, configuration: Configuration) -> Kinematics:
    """Strain and rotation of an increment ``du`` (a, d) from ``nodes`` (a, d), in plane strain."""
    table = tabulated(Element.Q8, Quadrature.RADON7)
    return configuration.measure.increment(nodes, du, mesh.elements, table, Geometry.PLANE_STRAIN)


def sheared(steps: int) -> tuple[float, float]:
    """(s12/G, s11/G) after shear 1 in equal steps."""
    mesh, C = block(1.0, 1.0, 1, 1, element=Element.Q8), ELASTIC.stiffness(4)
    nodes, stress = mesh.nodes, np.zeros((1, 7, 4))
    for _ in range(steps):
        du = np.column_stack([nodes[:, 1] / steps, np.zeros(len(nodes))])
        kin = increment(mesh, du, nodes, Configuration.MIDPOINT)
        stress = kin.turned(stress) + kin.strain @ C
        nodes = nodes + du
    return float(stress[0, 0, 3] / np.sqrt(2) / ELASTIC.shear), float(stress[0, 0, 0] / ELASTIC.shear)


def turned(angle: float) -> float:
    """Largest difference of a uniaxial stress of one, rotated with the body in one increment, from the exact one."""
    mesh = block(2.0, 1.0, 2, 2, element=Element.Q8)
    c, s = np.cos(angle), np.sin(angle)
    du = mesh.nodes @ np.array([[c, s], [-s, c]]) - mesh.nodes
    kin = increment(mesh, du, mesh.nodes, Configuration.MIDPOINT)
    found = kin.turned(np.tile([1.0, 0.0, 0.0, 0.0], (4, 7, 1)))
    return float(np.abs(found - [c**2, s**2, 0.0, np.sqrt(2) * s * c]).max())


def run(steps: int, watch: Watch) -> list[float]:
    """Both stresses, and the error of the rotation."""
    return [*sheared(steps), turned(TURNED)]


CASE = Case(
    name="simple_shear",
    subject=Subject.MATERIAL,
    source="closed form: s12/G = sin g, s11/G = 1 - cos g",
    purpose="The objective rate alone: of second order in shear, exact in rotation.",
    setup=(
        "Simple shear to g = 1 in equal increments, elastic, Jaumann's rate, the strain increment rotated by half of"
        " the increment's rotation; in addition a stressed body that is rotated by 3 (172 degrees) in one increment."
    ),
    asked=(
        Asked("s12/G", float(np.sin(1.0)), 1e-5),
        Asked("s11/G", float(1 - np.cos(1.0)), 1e-5),
        Asked("error of a rigid rotation", 0.0, 1e-12),
    ),
    counted="increments",
    meshes=(10, 20, 40, 100),
    run=run,
    marched=False,
)
