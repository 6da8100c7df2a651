"""Friction on a tool: Coulomb's coefficient and the cap by the body's shear yield stress, of a tool and by node."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from bipot.errors import require, require_count, require_number, require_type
from bipot.typing import FrozenMap, make_floats

LARGEST_MU, LARGEST_SHEAR = 1e12, 1.0
"""A body carries no more than its own shear yield stress along a surface: the second is in units of it."""


def check_friction(tool: Any) -> None:
    """Check the friction fields of a :class:`~bipot.tools.tool.Tool`, and make plain numbers of them.

    Raises:
        SceneError: a field out of its range, or by node where the tool is welded, or would be at that node alone.
    """
    make_floats(tool, "mu", "shear")
    for name, largest in (("mu", LARGEST_MU), ("shear", LARGEST_SHEAR)):
        value = getattr(tool, name)
        allowed = f">= 0, to {largest:g} (inf {'welds' if name == 'mu' else 'caps nothing'})"
        require(0 <= value <= largest or value == math.inf, name, value, allowed)
    object.__setattr__(tool, "mu_at", _by_node(tool.mu_at, "mu_at", LARGEST_MU, "finite and ", ()))
    object.__setattr__(tool, "shear_at", _by_node(tool.shear_at, "shear_at", LARGEST_SHEAR, "", (math.inf,)))
    for name in ("mu_at", "shear_at"):
        by_node = dict(getattr(tool, name))
        require(not (tool.welded and by_node), name, by_node, "empty where mu = inf and shear = inf: welded")
    for node, shear in tool.shear_at.items():
        bounded = math.isfinite(shear) or math.isfinite(tool.mu_at.get(node, tool.mu))
        require(bounded, f"shear_at[{node}]", shear, "finite where mu = inf: a tool welds as a whole")


def _by_node(
    by_node: Mapping[int, float], name: str, largest: float, prefix: str, beyond: tuple[float, ...]
) -> FrozenMap[int, float]:
    """The numbers of a field by node, each in [0, ``largest``] or ``beyond``; messages have a ``prefix``."""
    require_type(by_node, Mapping, name)
    for node, value in by_node.items():
        require_count(node, f"{name} node", 0)
        require_number(value, f"{name}[{node}]")
        allowed = 0 <= value <= largest or value in beyond
        require(allowed, f"{name}[{node}]", value, f"{prefix}>= 0, to {largest:g}" + " or inf" * bool(beyond))
    return FrozenMap({int(node): float(value) for node, value in by_node.items()})
