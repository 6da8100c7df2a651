"""Claims that a load on a body in space is above the limit load, judged by inequalities of the study's own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.fem.strain import Configuration
from bipot.marching import system_of
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.tools.deformable import AnyTool
from bipot.tools.tool import FlatTool
from bipot.typing import Floats, einsum
from studies.fuzz.claims import Claim, tried, unmet
from studies.fuzz.metals import yield_stress_of
from studies.fuzz.placed import Drive
from studies.fuzz.solid_contacts import framed
from studies.fuzz.solid_held import freed, whole_size
from studies.fuzz.solid_loads import loads_on
from studies.fuzz.solid_movable import movable
from studies.fuzz.solid_placed import axis_of, cuts, drives, pose
from studies.fuzz.solid_points import posed
from studies.fuzz.solid_surfaces import bent, faces
from studies.independent.collapse import HARDENED, Proof
from studies.independent.contact import TOUCHING
from studies.independent.revolved import nearest
from studies.independent.sampling import Parts
from studies.independent.solid_limit import Discs, Drives, Solid, SolidCollapse, judged, rigid_part
from studies.independent.solid_tools import about, carried_to


def refuted(scene: Scene, claim: Claim) -> list[str]:
    """Why neither the motion of a claim nor what is in it proves it, in words; nothing if one does."""
    return unmet(proofs(scene, claim), claim.fraction)


def proofs(scene: Scene, claim: Claim) -> list[Proof]:
    """Those of :func:`studies.fuzz.claims.tried`, and the motion once more with the ways that are claimed.

    Flat tools go as far as they can; where others are driven all ways are those that are claimed.
    """
    solid, state, driven = solid_of(scene), claim.state, drives(scene)
    placed = scene.mesh.nodes if scene.configuration is Configuration.SMALL else state.nodes
    loads, points = loads_on(scene, placed, claim.tau), points_at(scene, state)
    collapse = SolidCollapse(placed, claim.motion, loads, drives_at(scene, claim.tau), points)
    ways = None if all(isinstance(scene.tools[drive.number], FlatTool) for drive in driven) else claim.ways

    def judge(motion: Floats, following: bool) -> Proof:
        return judged(solid, replace(collapse, motion=motion, following=following), ways)

    found = tried(claim.motion, rigid_part(solid, placed, claim.motion), judge)
    return [*found, judged(solid, collapse, claim.ways)]


def solid_of(scene: Scene) -> Solid:
    """The body in plain numbers."""
    sigma_y = yield_stress_of(scene)(np.full((len(scene.mesh.elements), 1), HARDENED))
    elements, rest, volume = scene.mesh.elements, scene.mesh.nodes, scene.volume_change.value
    return Solid(elements, rest, scene.rule.value, volume, sigma_y, freed(scene))


def drives_at(scene: Scene, tau: float) -> Drives:
    """What drives tools at a time; of one that planes of symmetry cut a half of the force for each of them."""
    every = drives(scene)
    own = [scene.tools[drive.number] for drive in every]
    parts = np.array([0.5 ** len(cuts(scene, tool)) for tool in own])
    return Drives(
        tool=np.array([drive.number for drive in every], dtype=np.intp),
        normal=np.array([tool.normal if isinstance(tool, FlatTool) else (0.0,) * 3 for tool in own]).reshape(-1, 3),
        direction=np.array([direction(drive, tool) for drive, tool in zip(every, own, strict=True)]).reshape(-1, 3),
        force=np.array([drive.at(tau) * (drive.spin or 1.0) for drive in every]) * parts,
    )


def direction(drive: Drive, tool: AnyTool) -> Floats:
    """The unit vector (3,) along which a force drives a tool; none where a moment does."""
    if drive.spin or tool.driven_by is None:
        return np.zeros(3)
    return np.array(tool.driven_by.vector) / np.linalg.norm(tool.driven_by.vector)


def points_at(scene: Scene, state: State) -> Discs:
    """The candidates at a state, and which of them touch."""
    stored = system_of(scene).candidates
    frames = stored.faces.reference[stored.parts.first]
    found = [_points_of(scene, k, state, frames[stored.tool == k]) for k in range(len(scene.tools))]
    first = np.cumsum([0, *(len(own.tool) for own in found)]).tolist()
    found = [replace(own, owner=own.owner + at) for own, at in zip(found, first, strict=False)]
    if not found:
        return _none()
    joined = {
        name: np.concatenate([getattr(own, name) for own in found]) for name in Discs.__annotations__ if name != "led"
    }
    return Discs(**joined, led=np.concatenate([own.led for own in found], axis=1))


def _none() -> Discs:
    """No points."""
    whole, zero, never, square = np.zeros(0, np.intp), np.zeros(0), np.zeros(0, dtype=bool), np.zeros((0, 3, 3))
    names = {"tool": whole, "mu": zero, "welded": never, "touching": never, "owner": whole, "part": whole}
    return Discs(**names, share=zero, rows=square, kept=square[:, 1:, 1:], moved=square, led=np.zeros((0, 0, 3)))


def _points_of(scene: Scene, k: int, state: State, frames: Floats) -> Discs:
    """Those of the k-th tool of which a node can move along the normal, or the tool can, their ``frames`` at rest."""
    tool, every, here = scene.tools[k], posed(scene, k), pose(scene, k, state)
    centre = np.zeros(3) if tool.turn is None else np.array(tool.turn.centre)
    turn = about(axis_of(tool), here[3])
    nodal = movable(scene, k)
    free = ((every.weights != 0)[:, :, None] & nodal).any(axis=1)
    own, sliding = every.only(free[:, 0]), free[free[:, 0], 1]
    parts = Parts.of(own.weights)
    arm = state.nodes[parts.node] - centre - here[:3]
    seen = nearest(faces(tool.face), arm @ turn + centre)
    normal, gradient = seen.normal @ turn.T, turn @ seen.gradient @ turn.T
    reference = framed(frames)
    tangents = carried_to(reference[parts.owner], normal)[:, 1:]
    mu = np.array([tool.mu_at.get(int(a), tool.mu) for a in own.node])
    return Discs(
        tool=np.full(len(own.node), k),
        mu=np.where(sliding, mu, 0.0) if bent(tool) else mu,
        welded=np.full(len(own.node), tool.welded),
        touching=(parts.mean(seen.gap) <= TOUCHING * whole_size(scene)) & ~parts.any(seen.past),
        owner=parts.owner,
        part=parts.node,
        share=parts.share,
        rows=np.concatenate([normal[:, None], tangents - seen.gap[:, None, None] * tangents @ gradient], axis=1),
        kept=einsum("cij,cjk,clk->cil", reference[:, 1:], own.moved, reference[:, 1:]),
        moved=own.moved,
        led=np.array([_led(scene, drive, k, arm) for drive in drives(scene)]).reshape(-1, len(arm), 3),
    )


def _led(scene: Scene, drive: Drive, k: int, arm: Floats) -> Floats:
    """How the k-th tool's places (w, 3) at an ``arm`` from its centre go, as what drives a tool goes by one."""
    tool = scene.tools[k]
    if drive.number != k:
        return np.zeros_like(arm)
    return direction(drive, tool) + drive.spin * np.cross(axis_of(tool), arm)
