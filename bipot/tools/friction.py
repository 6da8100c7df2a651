"""Friction on a tool: Coulomb's coefficient and the cap by the body's shear yield stress, of the tool and of nodes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bipot.basics.frozen import FrozenMap
from bipot.errors import require, require_count, require_number, require_type
from bipot.typing import make_floats

LARGEST_MU = 1e12

LARGEST_SHEAR = 1.0
"""A body carries no more than its own shear yield stress along a surface."""


@dataclass(frozen=True)
class Friction:
    """The fields of a :class:`~bipot.tools.tool.Tool` that say how it rubs, checked and as plain numbers.

    Raises:
        SceneError: one out of its range, or of a node where the tool is welded or would be at that node alone.
    """

    mu: float
    shear: float
    mu_at: Mapping[int, float]
    shear_at: Mapping[int, float]

    def __post_init__(self) -> None:
        make_floats(self, "mu", "shear")
        for name, largest in (("mu", LARGEST_MU), ("shear", LARGEST_SHEAR)):
            value = getattr(self, name)
            said = f">= 0, to {largest:g} (inf {'welds' if name == 'mu' else 'caps nothing'})"
            require(0 <= value <= largest or value == math.inf, name, value, said)
        object.__setattr__(self, "mu_at", self._by_node("mu_at", LARGEST_MU, "finite and ", ()))
        object.__setattr__(self, "shear_at", self._by_node("shear_at", LARGEST_SHEAR, "", (math.inf,)))
        for name in ("mu_at", "shear_at"):
            by_node, welded = getattr(self, name), math.isinf(self.mu) and math.isinf(self.shear)
            require(not (welded and by_node), name, dict(by_node), "empty where mu = inf and shear = inf: welded")
        for node, shear in self.shear_at.items():
            bounded = math.isfinite(shear) or math.isfinite(self.mu_at.get(node, self.mu))
            require(bounded, f"shear_at[{node}]", shear, "finite where mu = inf: a tool welds as a whole")

    def _by_node(self, name: str, largest: float, said: str, beyond: tuple[float, ...]) -> FrozenMap[int, float]:
        """The field's numbers by node, from 0 to the ``largest`` or one of those ``beyond``."""
        by_node = getattr(self, name)
        require_type(by_node, Mapping, name)
        for node, value in by_node.items():
            require_count(node, f"{name} node", 0)
            require_number(value, f"{name}[{node}]")
            allowed = 0 <= value <= largest or value in beyond
            require(allowed, f"{name}[{node}]", value, f"{said}>= 0, to {largest:g}" + " or inf" * bool(beyond))
        return FrozenMap({int(node): float(value) for node, value in by_node.items()})
