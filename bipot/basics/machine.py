"""The memory of the machine, so that tasks that cannot fit are refused before they start."""

from __future__ import annotations

import os

from bipot.errors import require

BYTES_A_NODE = 20_000
"""Memory that a march by :class:`~bipot.forms.Newton` needs per node of a square mesh, for response, stiffness and its
factors: measured from T3 to Q9 on 40 x 40 elements, 14 000 to 30 000. Cone programs need three times as much.
"""

GIGABYTE = 1e9


def memory() -> int | None:
    """Bytes of memory of the machine; None if unknown.

    >>> (memory() or 2**30) > 2**20
    True
    """
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def require_memory(nodes: int, field: str, value: object) -> None:
    """Refuse a ``value`` of ``field`` that makes a mesh of so many ``nodes`` that no march on it fits into memory."""
    need, there = nodes * BYTES_A_NODE, memory()
    if there is not None:
        amounts = f"{there / GIGABYTE:.3g} GB of memory here, where a march would need about {need / GIGABYTE:.2g} GB"
        require(need <= there, field, value, f"so few that they fit into the {amounts}")
