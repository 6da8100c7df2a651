"""What is read off a ring in plane strain, expanded from its bore."""

from __future__ import annotations

import numpy as np

from bipot import Accepted


def pressure_on(accepted: Accepted, boundary: str) -> float:
    """Mean pressure that supports put on a boundary of the ring, over its area where the body is in equilibrium."""
    iterate = accepted.solved.iterate
    nodes = iterate.increment.system.body.scene.mesh.boundary_nodes(boundary)
    force = iterate.reactions(accepted.solved.r)[nodes, 0].sum()
    radius, heights = iterate.balanced[nodes].T
    return float(force / (2 * np.pi * radius.mean() * np.ptp(heights)))
