"""Tools that are flat and supports along axes, where the fuzz study draws or judges what only those may have."""

from __future__ import annotations

from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.deformable import AnyTool
from bipot.tools.tool import FlatTool


def flat_tools(scene: Scene) -> tuple[FlatTool, ...]:
    """The scene's tools.

    Raises:
        TypeError: one is not flat.
    """
    return tuple(map(flat, scene.tools))


def flat(tool: AnyTool) -> FlatTool:
    """The tool itself.

    Raises:
        TypeError: it is not flat.
    """
    if not isinstance(tool, FlatTool):
        raise TypeError(f"a flat tool is asked for here, not {tool!r}")
    return tool


def axis_of(support: Support) -> int:
    """The number of the axis that a support is along.

    Raises:
        TypeError: it is along none.
    """
    if not isinstance(support.direction, int):
        raise TypeError(f"a support along an axis is asked for here, not {support!r}")
    return support.direction
