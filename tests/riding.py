"""Slabs under a lid that turns, and what they are taken along."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from bipot.fem.reduction import Geometry
from bipot.iterate import Increment
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.system import system_of
from bipot.tools.deformable import AnyTool
from bipot.tools.poses import Turn
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool

HARD = VonMises(Elasticity(1e3, 0.0), Linear(1e4, 1.0))
"""Never yields here."""


ANGLE, ALONG, MU = 0.02, 0.1, 0.2


def slab(dimension: int, beneath: AnyTool, angle: float = ANGLE, mu: float = np.inf, supports=(), axis=None) -> Scene:
    """A slab under a lid that turns its far end down, about its near end, or in space about another ``axis``."""
    if dimension == 2:
        turn, lid = Turn(-angle, (0.0, 0.1)), Plane((0.0, 0.1), (0.0, -1.0))
        mesh = block(1.0, 0.1, 6, 2, element=Element.Q4)
    else:
        turn = Turn(angle, (0.0, 0.0, 0.1), axis=axis or (0.0, 1.0, 0.0))
        lid, mesh = Plane((0.0, 0.0, 0.1), (0.0, 0.0, -1.0)), brick(1.0, 0.5, 0.1, 6, 2, 1)
    top = ShapedTool(lid, (0.0,) * dimension, ("top",), mu, turn=turn)
    flat = Geometry.PLANE_STRAIN if dimension == 2 else Geometry.SOLID
    return Scene(mesh, flat, HARD, supports, (beneath, top))


def plate(dimension: int, drop: float) -> FlatTool:
    """So far beneath the slab, going along."""
    up = (*(0.0,) * (dimension - 1), 1.0)
    along = (ALONG, *(0.0,) * (dimension - 1))
    return FlatTool((*(0.0,) * (dimension - 1), -drop), up, along, ("base",), MU)


def turned(asked: Scene, x: np.ndarray, part: float = 1.0) -> np.ndarray:
    """Places x (m, d) after a ``part`` of the turn."""
    turn = asked.tools[1].turn
    assert turn is not None
    d, centre = x.shape[1], np.array(turn.centre)
    axis = np.array([0.0, 0.0, 1.0]) if d == 2 else np.array(turn.axis)
    Q = Rotation.from_rotvec(part * turn.angle * axis).as_matrix()[:d, :d]
    return (x - centre) @ Q.T + centre


def taken(asked: Scene, forces=None):
    """What the body is taken along where it meets the tool beneath, and the rigid turn of these nodes."""
    system = system_of(asked)
    rest, own = system.rest(), system.candidates.tool == 0
    start = rest if forces is None else replace(rest, forces=forces(system))
    x = asked.mesh.nodes[system.candidates.node[own]]
    return Increment(system, start, 1.0).tools.taken[own], turned(asked, x) - x
