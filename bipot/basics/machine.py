"""What the machine has, so that what cannot fit is refused before it is tried."""

from __future__ import annotations

import os

from bipot.errors import require

BYTES_A_NODE = 20_000
"""Of memory that a march by :class:`~bipot.forms.Newton` takes for each node of a square mesh, response, stiffness and
its factors together: measured from T3 to Q9 on 40 x 40 elements, 14 000 to 30 000. Cone programs take three times it.
"""

GIGABYTE = 1e9


def memory() -> int | None:
    """Bytes of memory that the machine has; None where it does not say.

    >>> (memory() or 2**30) > 2**20
    True
    """
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def require_memory(nodes: int, field: str, value: object) -> None:
    """Refuse a ``value`` of ``field`` that makes a mesh of so many ``nodes`` that no march on it fits into memory.

    Raises:
        SceneError: it does not; the message has the memory that it would need, and what there is.
    """
    need, there = nodes * BYTES_A_NODE, memory()
    if there is not None:
        amounts = f"{there / GIGABYTE:.3g} GB of memory here, where a march would need about {need / GIGABYTE:.2g} GB"
        require(need <= there, field, value, f"so few that they fit into the {amounts}")
