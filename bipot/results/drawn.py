r"""Tools as lines for drawing: at rest, and at their places in a step.

A line is stored at rest; in the pose (a, theta) of its tool its points X are at C + a + Q(theta) (X - C), with C the
centre about which the tool turns (:mod:`bipot.tools.poses`). Infinite straight tools are drawn near the body. In space
a plane is drawn by an outline, a surface of revolution by meridians and circles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.scene.scene import Scene
from bipot.tools.poses import rotation
from bipot.typing import Floats, Ints

REACH = 1.25
"""Distance from the middle of the body at rest, over its size, to which a plane is drawn."""


@dataclass(frozen=True)
class Line:
    """A line through ``points`` (p, d) of the tool of that number, which in a plane is on its right."""

    tool: int
    points: Floats


@dataclass(frozen=True)
class Lines:
    """Lines at rest: ``points`` (p, d), the beginnings of the lines and the end of the last (l + 1,), their tools (l,).

    Tools turn about their ``centres`` (k, d).
    """

    points: Floats
    starts: Ints
    tool: Ints
    centres: Floats

    @staticmethod
    def of(scene: Scene) -> Lines:
        """Those of a scene's tools."""
        nodes, d = scene.mesh.nodes, scene.mesh.dimension
        middle, reach = (nodes.min(axis=0) + nodes.max(axis=0)) / 2, REACH * scene.mesh.size
        found = [(k, line) for k, tool in enumerate(scene.tools) for line in tool.face.lines(middle, reach)]
        centres = [(0.0,) * d if tool.turn is None else tool.turn.centre for tool in scene.tools]
        return Lines(
            np.concatenate([np.empty((0, d)), *(line for _, line in found)]),
            np.cumsum([0, *(len(line) for _, line in found)]),
            np.array([k for k, _ in found], dtype=np.intp),
            np.array(centres).reshape(-1, d),
        )

    def at(self, poses: Floats) -> list[Line]:
        """The lines where the tools are in the ``poses`` (k, p)."""
        lines, d = [], self.centres.shape[1]
        for k, first, last in zip(self.tool.tolist(), self.starts[:-1], self.starts[1:], strict=True):
            out = self.points[first:last] - self.centres[k]
            lines.append(Line(k, self.centres[k] + poses[k, :d] + out @ rotation(poses[k, d:]).T))
        return lines
