r"""Overlap: the largest penetration anywhere on the edges that may touch a tool, not only at their nodes.

The law is posed at nodes. A straight edge of two nodes is nearest to a flat tool at one of them. One of three is the
parabola through them, and its gap, n . x(s) - n . x_tool, the parabola through their gaps g_0, g_m, g_1,

    g(s) = g_0 + b s + a s^2,    a = 2 (g_0 - 2 g_m + g_1),    b = 4 g_m - 3 g_0 - g_1,    0 <= s <= 1,

least at an end or, where a > 0, at s = -b/(2 a): exact, without sampling. Overlap is an error of discretisation, which
no certificate of the nodal law holds.
"""

from __future__ import annotations

import numpy as np

from bipot.scene import Scene
from bipot.typing import Floats


def overlap(scene: Scene, nodes: Floats, placed: Floats) -> float:
    """Largest penetration of ``nodes`` (a, 2) and edges into the tools, over the body size; 0 if none.

    The tools are displaced by ``placed`` (k, d) since rest.

    All edges of a tool's candidate boundaries count, whether their nodes are open, closed or held.
    """
    deepest = 0.0
    for tool, moved in zip(scene.tools, placed, strict=True):
        gap = tool.distance(nodes[scene.mesh.edges(*tool.candidates)], moved)
        deepest = max(deepest, -float(least(gap).min()))
    return deepest / scene.mesh.size


def least(gap: Floats) -> Floats:
    """Least values (f,) on 0 <= s <= 1 of the parabolas through ``gap`` (f, 3) at s = 0, 1/2, 1, or lines (f, 2).

    >>> least(np.array([[1.0, -0.5, 1.0], [0.0, 0.75, 2.0]])).tolist()
    [-0.5, 0.0]
    """
    if gap.shape[1] == 2:
        return gap.min(axis=1)
    start, middle, end = gap.T
    a, b = 2 * (start - 2 * middle + end), 4 * middle - 3 * start - end
    inside = (a > 0) & (-b > 0) & (-b < 2 * a)
    drop = np.divide(b**2, 4 * a, out=np.zeros_like(a), where=inside)
    return np.minimum(np.minimum(start, end), start - drop)
