"""Claims that a load on a body in space is above the limit load, judged by inequalities of the study's own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.fem.strain import Configuration
from bipot.laws.von_mises import VonMises
from bipot.response import State
from bipot.scene.scene import Scene
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from studies.flat import flat, flat_tools
from studies.fuzz.claims import Claim, tried, unmet
from studies.fuzz.record import curve_of
from studies.fuzz.solid_contacts import TOUCHING
from studies.fuzz.solid_held import freed, multiple
from studies.fuzz.solid_loads import loads_on
from studies.fuzz.solid_movable import movable
from studies.fuzz.solid_placed import cuts, pose
from studies.fuzz.solid_points import posed
from studies.independent.collapse import HARDENED, Proof
from studies.independent.solid_limit import Discs, Drives, Solid, SolidCollapse, judged, rigid_part


def refuted(scene: Scene, claim: Claim) -> list[str]:
    """Why neither the motion of a claim nor what is in it proves it, in words; nothing if one does, or none is judged.

    The driven tools go as far as they can, or as is claimed.
    """
    return unmet(proofs(scene, claim), claim.fraction) if judgeable(scene) else []


def judgeable(scene: Scene) -> bool:
    """Whether the study knows all tools of a scene: those that are flat."""
    return all(isinstance(tool, FlatTool) for tool in scene.tools)


def proofs(scene: Scene, claim: Claim) -> list[Proof]:
    """Those of :func:`studies.fuzz.claims.tried`, and the motion once more with the ways that are claimed."""
    solid, state = solid_of(scene), claim.state
    placed = scene.mesh.nodes if scene.configuration is Configuration.SMALL else state.nodes
    loads, drives = loads_on(scene, placed, claim.tau), drives_at(scene, claim.tau)
    collapse = SolidCollapse(placed, claim.motion, loads, drives, points_at(scene, state))

    def judge(motion: Floats, following: bool) -> Proof:
        return judged(solid, replace(collapse, motion=motion, following=following))

    found = tried(claim.motion, rigid_part(solid, placed, claim.motion), judge)
    return [*found, judged(solid, collapse, claim.ways)]


def solid_of(scene: Scene) -> Solid:
    """The body in plain numbers."""
    assert isinstance(scene.material, VonMises)
    sigma_y = curve_of(scene.material.hardening)(np.array([HARDENED]))
    elements, rest, volume = scene.mesh.elements, scene.mesh.nodes, scene.volume_change.value
    return Solid(elements, rest, scene.rule.value, volume, float(sigma_y[0]), freed(scene))


def drives_at(scene: Scene, tau: float) -> Drives:
    """The driven tools at a time; of one that planes of symmetry cut a half of the force for each of them."""
    number, force = list[int](), list[float]()
    for k, tool in enumerate(flat_tools(scene)):
        if (drive := tool.driven_by) is not None:
            number.append(k)
            whole = float(np.linalg.norm(drive.vector)) * multiple(drive.amplitude, tau)
            force.append(whole / 2 ** len(cuts(scene, tool)))
    own = [flat(scene.tools[k]) for k in number]
    ways = np.array([tool.driven_by.vector for tool in own if tool.driven_by is not None]).reshape(-1, 3)
    return Drives(
        tool=np.array(number, dtype=np.intp),
        normal=np.array([tool.normal for tool in own]).reshape(-1, 3),
        direction=ways / np.linalg.norm(ways, axis=1, keepdims=True),
        force=np.array(force),
    )


def points_at(scene: Scene, state: State) -> Discs:
    """The candidates at a state, and which of them touch."""
    found = [_points_of(scene, k, state) for k in range(len(scene.tools))]
    if not found:
        return Discs.none(len(scene.mesh.nodes))
    return Discs(**{name: np.concatenate([getattr(own, name) for own in found]) for name in Discs.__annotations__})


def _points_of(scene: Scene, k: int, state: State) -> Discs:
    """Those of the k-th tool of which a node can move along the normal, or the tool can."""
    tool, every = flat(scene.tools[k]), posed(scene, k)
    own = every.only(((every.weights != 0) & movable(scene, k)[:, 0]).any(axis=1))
    gap = (own.weights @ state.nodes - np.array(tool.point) - pose(scene, k, state)[:3]) @ np.array(tool.normal)
    mu = np.array([tool.mu_at.get(int(a), tool.mu) for a in own.node])
    return Discs(
        tool=np.full(len(own.node), k),
        normal=np.broadcast_to(np.array(tool.normal), (len(own.node), 3)),
        weights=own.weights,
        within=own.moved,
        mu=mu,
        welded=np.full(len(own.node), tool.welded),
        touching=gap <= TOUCHING * scene.mesh.size,
    )
