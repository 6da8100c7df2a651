"""Tools that are flat, where the fuzz study draws or judges what only those may have."""

from __future__ import annotations

from bipot.scene import Scene
from bipot.tools import AnyTool, FlatTool


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
