"""Tools of drawn bodies in space read as surfaces of the study's own, and what planes of symmetry cut of them."""

from __future__ import annotations

import numpy as np

from bipot.tools.deformable import AnyTool, DeformableTool
from bipot.tools.profiles import Union
from bipot.tools.revolved import Revolved
from bipot.tools.surfaces import Plane, Surface
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from studies.fuzz.surfaces import outlines
from studies.independent.revolved import Face, HalfSpace, Round, nearest

CUT = 1e-9
"""A plane of symmetry cuts a tool that is its own mirror image to this, over its size, or in the angle of its plane."""

PLACES, AWAY = 300, 3.0
"""Places, as far off over the size of a tool, at which its gaps are compared with those of its mirror image."""


def faces(surface: Surface) -> tuple[Face, ...]:
    """The study's own faces of a surface in space, from what it was made of."""
    if isinstance(surface, Plane):
        return (HalfSpace(np.array(surface.point), np.array(surface.normal)),)
    if isinstance(surface, Revolved):
        return (Round(outlines(surface.meridian), np.array(surface.point), np.array(surface.axis)),)
    if isinstance(surface, Union):
        return tuple(face for part in surface.surfaces for face in faces(part))
    raise TypeError(f"no surface known: {surface!r}")


def gap_of(surface: Surface, point: Floats) -> float:
    """That of one point (3,)."""
    return float(nearest(faces(surface), point[None]).gap[0])


def bent(tool: AnyTool) -> bool:
    """Whether the normal of a tool changes with the place or in time."""
    return not isinstance(tool, FlatTool | DeformableTool) and not (
        isinstance(tool.surface, Plane) and tool.turn is None
    )


def cut(tool: AnyTool, way: Floats, position: float) -> bool:
    """Whether the tool is its own mirror image in the plane ``way`` . x = ``position`` of a unit normal."""
    if isinstance(tool.face, Plane):
        return abs(float(way @ tool.face.normal)) <= CUT
    own = faces(tool.face)
    size, rng = max(face.extent for face in own), np.random.default_rng(0)
    middle = np.mean([face.middle for face in own], axis=0)
    foot = middle - (middle @ way - position) * way
    x = foot + AWAY * size * rng.uniform(-1, 1, (PLACES, 3)) * rng.uniform(0.02, 1, (PLACES, 1))
    image = x - 2 * np.outer(x @ way - position, way)
    return bool(np.abs(nearest(own, x).gap - nearest(own, image).gap).max() <= CUT * size)
