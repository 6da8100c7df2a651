"""The columns of an upsetting's history, of a cylinder or a block: both are pressed along their last axis.

A radius is a distance from that axis through the middle of the body.
"""

from __future__ import annotations

from functools import reduce

import numpy as np

from bipot.contact.closeness import carries
from bipot.control.accepted import Accepted
from bipot.fem.kinematics import gradients
from bipot.results import columns
from bipot.results.columns import Column
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Floats

UNITS = {"length": "mm", "force": "N", "stress": "MPa", "energy": "N mm"}
JOULE = 1e-3


def history_columns(reduction: float) -> list[Column]:
    """The columns of ``history.csv``, for the full body."""

    def height_lost(_: System, accepted: Accepted) -> float:
        # Exactly the asked value at the end of the path.
        return accepted.state.tau * reduction

    return [
        columns.INCREMENT,
        Column("reduction", "reduction in height, fraction", height_lost),
        Column("force_N", "force on the upper punch, N", force),
        Column("contact_radius_mm", "outermost candidate with force, mm", contact_radius),
        Column("top_corner_radius_mm", "radius of the top edge's node, mm", top_corner_radius),
        Column("max_radius_mm", "largest radius, mm", lambda _, a: float(radii(a.state.nodes).max())),
        Column("max_peeq", "largest equivalent plastic strain", lambda _, a: float(a.state.peeq.max())),
        Column("volume_ratio", "volume over initial volume", volume_ratio),
        *columns.energies("J", JOULE),
        *columns.COURSE,
        *columns.certificate("J", JOULE),
        columns.OVERLAP,
        columns.MIN_JACOBIAN,
        columns.FLOW_GAP,
        columns.ERROR_ESTIMATE,
        columns.SECONDS,
    ]


def radii(nodes: Floats) -> Floats:
    """Distances (a,) of nodes (a, d) from the axis of pressing, the last one, mm."""
    return norm(nodes[:, :-1])


def force(_: System, accepted: Accepted) -> float:
    """Force on the upper punch, which may be several tools, N: that of the modelled part is the full one."""
    return float(-sum(accepted.tool_force(k)[-1] for k in range(len(accepted.tool_forces))))


def contact_radius(system: System, accepted: Accepted) -> float:
    """Radius of the outermost candidate that carries a force, mm."""
    carrying = system.candidates.node[carries(accepted.solved.r)]
    return float(radii(accepted.state.nodes[carrying]).max(initial=0.0))


def top_corner_radius(system: System, accepted: Accepted) -> float:
    """Radius of the node that top and sides share, mm."""
    scene = system.body.scene
    names = [name for tool in scene.tools for name in tool.candidates]
    corner = reduce(np.intersect1d, [scene.mesh.boundary_nodes(name) for name in names])
    return float(radii(accepted.state.nodes[corner])[0])


def volume_ratio(system: System, accepted: Accepted) -> float:
    """Volume of the deformed mesh over the initial one."""
    scene, reference = system.body.scene, system.body.space.reference
    now, start = (
        gradients(nodes, scene.mesh.elements, reference, scene.geometry).volume.sum()
        for nodes in (accepted.state.nodes, scene.mesh.nodes)
    )
    return float(now / start)
