"""The tools of scenes whose tools are all flat, as the fuzz study draws and judges them."""

from __future__ import annotations

from bipot.scene import Scene
from bipot.tools import FlatTool


def flat_tools(scene: Scene) -> tuple[FlatTool, ...]:
    """The scene's tools.

    Raises:
        TypeError: one is not flat.
    """
    flat = tuple(tool for tool in scene.tools if isinstance(tool, FlatTool))
    if len(flat) < len(scene.tools):
        raise TypeError("this study knows flat tools only")
    return flat
