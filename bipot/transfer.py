r"""The body that a march has left, drawn anew: its state on the mesh of another scene.

Where elements are about to fold, the deformed body is meshed again. With x_q the integration points of the deformed
body, each field f of sigma, plastic strain and peeq is at the points y of the new mesh

    f(y) = sum_q lambda_q r_q^2 log r_q + c_0 + c . y,    r_q = |y - x_q|,

a thin-plate spline through the values of the points nearest to y. Linear fields are met exactly, up to the surface and
in any elements. Where it is outside the yield surface the deviator of the stress is scaled back to it; peeq is at
least zero; the pressure is the one nearest that the new elements represent (:mod:`bipot.fem.projection`). That stress
is not quite in balance. In one increment without tools and loads, with supports at rest, it comes into balance.

No certificate knows what is lost here: the increments after it are judged from the new state on. :class:`Transfer` says
how much changed, and finer meshes tell the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.control.control import Control
from bipot.control.starting import handed_on, require_start
from bipot.errors import SceneError, require, require_type
from bipot.fem.strain import Configuration
from bipot.laws.material import Materials
from bipot.marching import march
from bipot.meshes.mesh import Mesh
from bipot.meshes.together import Part, parts
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed
from bipot.schedule import Schedule
from bipot.state import State
from bipot.system import System, system_of
from bipot.tensors import deviator, equivalent_stress, identity, norm, trace
from bipot.typing import Floats, max_abs, vdot

NEAREST = 20
"""Points that a spline goes through, and all as near as the farthest of these; more where the point asked is beside
them, as those of a column of flat elements."""

OUTSIDE, FLAT = 6.0, 1e-6
"""Largest distance from the middle of these points, over their standard deviations, and the least ratio of these."""

TIED = 1e-6
"""Part of the distance of the farthest of these points by which others are as near: all of them belong to the spline.
Otherwise round-off would choose some, which differ with the numbers of nodes and in mirror images."""

DRAWN = 0.01
"""Differences of volume, over the volume, and of extents, over the size, from which on it is another body."""


@dataclass(frozen=True)
class Transfer:
    """A body on a new mesh: the ``state`` from which a march of the new scene starts, and what has changed.

    ``volume`` and ``peeq`` are the relative changes of the body's volume and of the mean of peeq over it. ``moved`` is
    the largest displacement, over the body's size, in which the stress has come into balance.
    """

    state: State
    volume: float
    peeq: float
    moved: float


def transferred(state: State, scene: Scene, onto: Scene, control: Control | None = None) -> Transfer:
    """The body of a ``state`` of ``scene``, that no tool presses, as the start of a march ``onto`` another scene.

    The mesh of ``onto`` at rest is the deformed body drawn anew, by any elements. Its tools are off the body, its
    supports hold the body alone. Parts of a body, of the same names in both scenes, are drawn anew and come into
    balance each by itself. Pseudo-time begins anew. ``control`` says how the stress comes into balance: of a material
    that drifts off its yield surface it is that of the marches, which suits it.

    Raises:
        SceneError: a wrong type; contact forces; a state that no march of ``scene`` could start from; scenes of other
            geometries or materials, or of small displacements; points on one line, in space in one plane; a mesh of
            other parts, of another volume, extent or shape; tools as :func:`~bipot.handed_on`.
        IncrementFailed: the stress finds no balance.
    """
    require_type(state, State, "state")
    require_type(scene, Scene, "scene")
    require_type(onto, Scene, "onto")
    control = Control() if control is None else control
    require_type(control, Control, "control")
    require(not state.forces.any(), "state.forces", max_abs(state.forces), "zero: lift the tools off the body first")
    require(scene.geometry is onto.geometry, "onto.geometry", onto.geometry, f"{scene.geometry}, as the other scene's")
    old, new = (parts(one.mesh, f"{name}.mesh") for name, one in (("scene", scene), ("onto", onto)))
    require({*old} == {*new}, "onto.mesh: its parts", [*new], f"{[*old]}, as in the other scene")
    for name in ("material", "regions"):
        one, other = getattr(scene, name), getattr(onto, name)
        require(one == other, f"onto.{name}", other, f"{one}, as the other scene's")
    allowed = f"{[*scene.parts]}, as in the other scene: no name stands for elements of no region"
    require({*scene.parts} == {*onto.parts}, "onto.mesh: its parts of one material", [*onto.parts], allowed)
    for name, one in (("scene", scene), ("onto", onto)):
        moves = "another one: with small displacements equilibrium is posed on the mesh at rest, which stays as it is"
        require(one.configuration is not Configuration.SMALL, f"{name}.configuration", one.configuration.value, moves)
    before, after = system_of(scene), system_of(onto)
    _require_of(state, before, control)
    settled, moved = after.rest(), 0.0
    for name in old:
        released = _released(onto, new[name])
        balanced = _drawn_anew(_of(state, old[name]), _released(scene, old[name]), released, control, name)
        settled = _with(settled, balanced, new[name])
        moved = max(moved, float(norm(balanced.nodes - released.mesh.nodes).max()) / onto.mesh.size)
    had, has = _mean(before, state), _mean(after, settled)
    volume = _volume(after, onto.mesh.nodes) / _volume(before, state.nodes) - 1
    return Transfer(handed_on(settled, onto), volume, has / had - 1 if had > 0 else has, moved)


def _released(scene: Scene, part: Part) -> Scene:
    """The scene of a part of its body alone, without tools and loads, with supports at rest."""
    held = [support for support in scene.supports if support.boundary in part.mesh.boundaries]
    held = tuple(replace(s, displacement=0.0) if isinstance(s, Prescribed) else s for s in held)
    regions = {name: material for name, material in scene.regions.items() if name in part.mesh.regions}
    return replace(scene, mesh=part.mesh, supports=held, tools=(), loads=(), regions=regions)


def _of(state: State, part: Part) -> State:
    """The fields of a part of a body, without contact."""
    nodes, elements, none = part.nodes, part.elements, np.empty(0)
    return replace(
        state,
        nodes=state.nodes[nodes],
        stress=state.stress[elements],
        plastic_strain=state.plastic_strain[elements],
        peeq=state.peeq[elements],
        du=np.zeros((len(nodes), state.nodes.shape[1])),
        forces=np.empty((0, state.nodes.shape[1])),
        gap=none,
        translation=none,
        translated=none,
        length=0.0,
        flow=None,
    )


def _with(whole: State, own: State, part: Part) -> State:
    """The ``whole`` state with the fields of a part."""
    fields = {name: np.array(getattr(whole, name)) for name in ("nodes", "stress", "plastic_strain", "peeq")}
    for name, field in fields.items():
        field[part.nodes if name == "nodes" else part.elements] = getattr(own, name)
    return replace(whole, **fields)


def _drawn_anew(state: State, scene: Scene, onto: Scene, control: Control, part: str) -> State:
    """The state of one connected body, or of a ``part`` of one, on another mesh, in balance there."""
    before, after = system_of(scene), system_of(onto)
    _require_drawn(before, state.nodes, after, f"onto.mesh, part {part!r}" if part else "onto.mesh")
    *_, balanced = march(onto, Schedule(1), control, start=_mapped(state, before, after))
    return balanced.state


def _require_of(state: State, before: System, control: Control) -> None:
    """Require a state from which a march of its own scene could go on."""
    try:
        require_start(state, before, control.limits.bounds.equilibrium)
    except SceneError as wrong:
        raise SceneError(f"state: must be of a march of the scene, as its start: {wrong}") from wrong


def _points(system: System, nodes: Floats) -> Floats:
    """Integration points (e, q, d) of a body whose nodes are at ``nodes`` (a, d)."""
    space = system.body.space
    return space.reference.values @ nodes[space.mesh.elements]


def _volume(system: System, nodes: Floats) -> float:
    return float(system.body.space.gradients(nodes).volume.sum())


def _mean(system: System, state: State) -> float:
    """The mean of peeq over the deformed body."""
    volume = system.body.space.gradients(state.nodes).volume
    return vdot(volume, state.peeq) / float(volume.sum())


def _longest(mesh: Mesh, nodes: Floats) -> float:
    """The largest extent of an element."""
    return float(norm(np.ptp(nodes[mesh.elements], axis=1)).max())


def _require_drawn(before: System, nodes: Floats, after: System, what: str) -> None:
    """Require that the new mesh at rest, ``what`` in words, is the old one at its ``nodes`` (a, d).

    No integration point of either may be farther from all of the other's, of the same part, than its elements are long.
    """
    # scipy.spatial takes long to import.
    from scipy.spatial import cKDTree

    old, new = before.body.scene.mesh, after.body.scene.mesh
    named, given = ({*system.body.scene.parts} for system in (before, after))
    require(named == given, f"{what}: its parts of one material", [*given], f"{[*named]}, as in the other scene")
    had, has = _volume(before, nodes), _volume(after, new.nodes)
    allowed = f"the deformed body's, {had:.6g}, to {DRAWN:g} of it"
    require(abs(has / had - 1) <= DRAWN, f"{what}: its volume", has, allowed)
    asked, found = (np.stack([x.min(axis=0), x.max(axis=0)]) for x in (nodes, new.nodes))
    shown = [[float(f"{place:.6g}") for place in corner] for corner in asked.tolist()]
    allowed = f"the deformed body's, {shown}, to {DRAWN:g} of its size"
    off = max_abs(found - asked)
    require(off <= DRAWN * new.size, f"{what}: its least and largest places", found.tolist(), allowed)
    points = _points(before, nodes), _points(after, new.nodes)
    reach = max(_longest(old, nodes), _longest(new, new.nodes))
    allowed = f"at most {reach:.3g}, the length of an element: is it another shape?"
    for name in before.body.scene.parts:
        each = (x[system.body.scene.parts[name]] for x, system in zip(points, (before, after), strict=True))
        one, other = (x.reshape(-1, new.dimension) for x in each)
        far = max(float(cKDTree(a).query(b)[0].max()) for a, b in ((one, other), (other, one)))
        whose = f"region {name!r}" if name else "all"
        require(far <= reach, f"{what}: distance of a point from {whose} of the deformed body's", far, allowed)


def _mapped(state: State, before: System, after: System) -> State:
    """The fields of the ``state`` on the new mesh, at rest."""
    rest, material = after.rest(), after.body.scene.materials
    size, points, asked = state.stress.shape[-1], _points(before, state.nodes), _points(after, rest.nodes)
    packed = np.concatenate([state.stress, state.plastic_strain, state.peeq[..., None]], axis=-1)
    found = np.empty((*asked.shape[:2], packed.shape[-1]))
    # From one material to another stresses and plastic strains jump.
    for name, old in before.body.scene.parts.items():
        new = after.body.scene.parts[name]
        found[new] = _interpolated(points[old], packed[old], asked[new])
    stress, plastic_strain, peeq = found[..., :size], found[..., size:-1], np.maximum(found[..., -1], 0.0)
    if not material.drifts:
        stress = _within(stress, material, peeq)
    if (projection := after.body.projection) is not None:
        mean = trace(stress) / 3
        stress = stress + (projection.at(np.ones_like(mean)).of(mean) - mean)[..., None] * identity(size)
    return replace(rest, stress=stress, plastic_strain=plastic_strain, peeq=peeq)


def _within(stress: Floats, material: Materials, peeq: Floats) -> Floats:
    """The ``stress`` (e, q, s), its deviator scaled back to the yield surface where it is outside."""
    over = equivalent_stress(stress) / material.yield_stress(peeq)
    return stress + (1 / np.maximum(over, 1.0) - 1)[..., None] * deviator(stress)


def _interpolated(x: Floats, values: Floats, y: Floats) -> Floats:
    """``values`` (e, q, n) at ``x`` (e, q, d), by splines through the nearest ones, at ``y`` (f, p, d): (f, p, n)."""
    # scipy takes long to import.
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    x, known, asked = x.reshape(-1, x.shape[-1]), values.reshape(-1, values.shape[-1]), y.reshape(-1, y.shape[-1])
    found, left, near = np.empty((len(asked), known.shape[1])), np.arange(len(asked)), min(NEAREST, len(x))
    allowed = "such that its integration points are not on one line, in space not in one plane: mesh finer"
    require(bool(np.isfinite(_outside(x[None], x[:1])).all()), "scene.mesh", f"with {len(x)} points", allowed)
    # Kernels of distances far below one are lost beside linear functions; those of distances far above are not.
    unit = float(cKDTree(x).query(x, 2)[0][:, 1].min())
    x, asked = x / unit, asked / unit
    tree = cKDTree(x)
    while left.size:
        places = asked[left]
        far, nearest = (out.reshape(len(left), -1) for out in tree.query(places, min(2 * near, len(x))))
        count = (far <= (1 + TIED) * far[:, near - 1 : near]).sum(axis=1)
        good = np.zeros(len(left), dtype=np.bool_)
        for many in np.unique(count).tolist():
            rows = np.flatnonzero(count == many)
            outside = _outside(x[nearest[rows, :many]], places[rows])
            rows = rows[outside <= (OUTSIDE if many < len(x) else np.inf)]
            if rows.size:
                spline = RBFInterpolator(x, known, many, kernel="thin_plate_spline", degree=1)
                found[left[rows]], good[rows] = spline(places[rows]), True
        left, near = left[~good], min(2 * near, len(x))
    return found.reshape(*y.shape[:-1], -1)


def _outside(near: Floats, y: Floats) -> Floats:
    """Distance (n,) of ``y`` (n, d) from the middle of points (n, k, d), over their standard deviations along it.

    It is inf where the points are on a line, in space in a plane.
    """
    middle = near.mean(axis=1, keepdims=True)
    _, spread, axes = np.linalg.svd(near - middle, full_matrices=False)
    flat = (spread[:, -1] <= FLAT * spread[:, 0]) | (near.shape[1] <= near.shape[2])
    along = (axes @ (y - middle[:, 0])[..., None])[..., 0]
    scaled = along / np.where(flat[:, None], 1.0, spread) * np.sqrt(near.shape[1])
    return np.where(flat, np.inf, norm(scaled))
