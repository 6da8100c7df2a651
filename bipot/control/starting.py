"""From which state or course a march starts: checks that it belongs to its scene, and bodies under other tools."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from bipot.contact.closeness import ROUND_OFF
from bipot.control.course import SHORTEST, Course
from bipot.errors import LARGEST_STRESS, InvertedElement, SceneError, require, require_number, require_type
from bipot.fem.assembly import Space, element_force
from bipot.fem.strain import Configuration
from bipot.iterate import Increment
from bipot.load_change import BALANCED
from bipot.response import STILL
from bipot.scene.fitting import inside
from bipot.scene.scene import Scene
from bipot.scene.symmetry import image_depth
from bipot.state import ARRAYS, State
from bipot.system import System, system_of
from bipot.tensors import equivalent_stress, norm
from bipot.typing import Bools, Floats, max_abs, require_within, vdot

PLACED = 1e-9
"""Distance (over the body size) of nodes from the positions given by supports and stored gaps: round-off."""

RELEASED = "begin with the loads and supports that the body is under, or release it in a scene without tools before"
"""What to do where loads or supports have been taken off a body that no tool presses."""

OF_TOOLS = ("forces", "gap", "translation", "translated")
"""What of a state depends on the tools of its scene."""

TAKEN_OVER = "a state of another scene is taken over by handed_on"
"""What to do with a state that fits the mesh and not the tools."""

VOLUMES = 10.0
"""Factor between volumes that errors of finite increments do not reach, and other units exceed: of areas, too."""

YIELDED = 1e-8
"""Relative distance of a stress outside the yield surface, or of its pressure from what elements can represent."""

FAINT = 1e-12
"""Pressure over the bulk modulus that counts as round-off, which is all that a body has from which loads were taken."""


def course_of(start: State | Course | None, system: System, equilibrium: float) -> Course:
    """The course from which a march starts: the given one, one that begins at a state, or for None one at rest.

    Raises:
        SceneError: another type; as :func:`require_start`; a course with arrays that do not fit the scene, a length
            beyond the end of the path, or a last increment that did not begin before its end, naming the field.
    """
    if start is None:
        return Course.of(system.rest())
    if isinstance(start, State):
        require_start(start, system, equilibrium)
        return Course.of(start)
    require(isinstance(start, Course), "start", start, "a State, a Course or None")
    require_start(start.state, system, equilibrium)
    at_rest, tau = Course.of(system.rest()), start.state.tau
    allowed = f"at most {1 - tau:g}, what is left of the path"
    require(not start.size > 1 - tau, "start.size", start.size, allowed)
    _require_like(start.landed, at_rest.landed, "start.landed")
    for k, paced in enumerate(start.before):
        for name in ("velocity", "forces"):
            like = getattr(at_rest.before[k], name)
            _require_like(getattr(paced, name), like, f"start.before[{k}].{name}")
    later, earlier = start.before
    require(not later.tau >= tau, "start.before[0].tau", later.tau, f"below start.state.tau, {tau:g}")
    # Seen at a pace many times as fast, they come so near to now that round-off may make them equal.
    allowed = f"at most start.before[0].tau, {later.tau:g}"
    require(not earlier.tau > later.tau, "start.before[1].tau", earlier.tau, allowed)
    for k, paced in enumerate(start.before):
        allowed = f"at most start.before[{k}].tau, {paced.tau:g}"
        require(not paced.middle > paced.tau, f"start.before[{k}].middle", paced.middle, allowed)
    return start


def handed_on(state: State, scene: Scene) -> State:
    """The body of a ``state`` that no tool presses, as the start of a march of another ``scene`` of the same mesh.

    Pseudo-time begins anew. Gaps are those to the tools of ``scene`` where they are at rest. The march refuses a body
    out of balance with the loads and supports of a ``scene`` with tools; without tools it springs back.

    Raises:
        SceneError: contact forces; arrays of another mesh, or not finite; a tool, or its mirror image, in
            the body, naming it; a scene of small displacements after a march of finite ones, or the other way round,
            where balance on the mesh at rest and on the nodes differ.
    """
    require_type(state, State, "state")
    require_type(scene, Scene, "scene")
    require(not state.forces.any(), "state.forces", max_abs(state.forces), "zero: lift the tools off the body first")
    system, none = system_of(scene), np.zeros(len(scene.drives))
    at_rest = system.rest()
    for name in ARRAYS:
        if name not in OF_TOOLS:
            _require_like(getattr(state, name), getattr(at_rest, name), f"state.{name}")
    contacts = system.facing(state.nodes).candidates
    gap = contacts.distance(state.nodes, scene.at_rest)
    if gap.min(initial=0.0) < -PLACED * scene.mesh.size:
        k, depth = int(contacts.tool[gap.argmin()]), -float(gap.min())
        raise SceneError(f"tools[{k}]: must be off the body, not {depth:.3g} in it: let its way begin farther off")
    for k, tool in enumerate(scene.tools):
        wrong = inside(scene.surroundings, tool, state.nodes, PLACED * scene.mesh.size)
        require(wrong is None, f"tools[{k}]", tool.face, f"off the body: {wrong}")
        for plane in scene.planes:
            depth = image_depth(plane, scene.mesh, tool, state.nodes, scene.at_rest[k])
            apart = f"such that its mirror image beyond {plane.words} is off the body, not {depth:.3g} in it"
            require(depth <= plane.roundoff, f"tools[{k}]", tool.face, apart)
    forces = np.zeros((len(gap), scene.mesh.dimension))
    start = replace(state, tau=0.0, gap=gap, forces=forces, translation=none, translated=none)
    _require_posed(start, system)
    return start


def require_start(start: State, system: System, equilibrium: float) -> None:
    """Refuse a start state of another scene: its arrays, held nodes and gaps to tools must be those of this scene.

    Its contact forces must balance its stress within :data:`BALANCED`, or within the march's bound on ``equilibrium``
    if that is larger; with the loads, or at the beginning of the path also without them. Where nothing may touch the
    body there are no contact forces to set a scale, and a stress out of balance relaxes in the first increment.

    Raises:
        SceneError: a time outside [0, 1], an array of another shape or not finite, peeq below zero, a held node
            elsewhere, gaps that are not those to the tools, a length that is neither 0 nor from SHORTEST to 1, a stress
            outside the yield surface, contact forces that its stress does not balance; the message names the field.
    """
    scene, at_rest = system.body.scene, system.rest()
    require_within(start.tau, "start.tau", "in [0, 1]")
    require_number(start.length, "start.length")
    allowed = f"0, or from {SHORTEST:g} to 1"
    require(start.length == 0 or SHORTEST <= start.length <= 1, "start.length", start.length, allowed)
    for name in ARRAYS:
        otherwise = TAKEN_OVER if name in OF_TOOLS else ""
        _require_like(getattr(start, name), getattr(at_rest, name), f"start.{name}", otherwise)
    if start.flow is not None:
        _require_like(start.flow.strain, at_rest.plastic_strain, "start.flow.strain")
        _require_like(start.flow.peeq, at_rest.peeq, "start.flow.peeq")
    require(bool((start.peeq >= 0).all()), "start.peeq", float(start.peeq.min()), ">= 0")
    _require_yielded(start, system)
    _require_pressure(start, system)
    _require_volume(start, system)
    placed = scene.mesh.nodes + scene.driven(start.tau)
    holding = scene.holding
    moved = max_abs(holding.axes.components(start.nodes - placed)[holding.held])
    allowed = f"where the supports hold them, not {moved:.3g} away: is it another scene's?"
    require(moved <= PLACED * scene.mesh.size, "start.nodes", "held ones", allowed)
    system = system.facing(start.nodes)
    contacts, at = system.candidates, (start.nodes, scene.placed(start.tau, start.translation))
    # Gaps of a start have the round-off of motions, distances that of places, which is large for a large circle.
    off = np.abs(start.gap - contacts.distance(*at)) - ROUND_OFF * contacts.faces.places(
        contacts.met.places(at[0]), at[1]
    )
    apart = float(off.max(initial=0.0))
    allowed = f"those of start.nodes to the scene's tools, not {apart:.3g} away: {TAKEN_OVER}"
    require(apart <= PLACED * scene.mesh.size, "start.gap", "distances", allowed)
    if start.gap.size:
        _require_balanced(start, system, max(BALANCED, equilibrium))


def _require_yielded(start: State, system: System) -> None:
    """Require a stress within the yield surface, unless the material's stress may leave it."""
    material = system.body.scene.materials
    if not material.drifts:
        sigma_y = material.yield_stress(start.peeq)
        largest = max_abs(start.stress)
        require(largest <= LARGEST_STRESS, "start.stress", largest, f"at most {LARGEST_STRESS:g}")
        ratio = float((equivalent_stress(start.stress) / sigma_y).max())
        allowed = "within it: is it another material's?"
        require(ratio <= 1 + YIELDED, "start.stress", f"{ratio:.9g} of the yield stress", allowed)


def _require_pressure(start: State, system: System) -> None:
    """Require a pressure in the span of the volume projection, on which forces rely (bipot.fem.projection)."""
    projection, pressure = system.body.projection, start.pressure
    if projection is not None:
        off = max_abs(projection.at(np.ones(pressure.shape)).of(pressure) - pressure)
        volume, bulk = system.body.scene.volume_change.name, max_abs(system.body.scene.materials.elasticity.bulk)
        allowed = f"of a pressure of {volume} in each element: is it another scene's?"
        require(off <= YIELDED * max_abs(start.stress) + FAINT * bulk, "start.stress", f"{off:.3g} off", allowed)


def _require_volume(start: State, system: System) -> None:
    """Require the volume of the mesh, changed by the pressure alone: that of nodes in another unit is far off.

    Strains that are not taken in the middle of increments do not add up to the volume of the nodes.
    """
    if system.body.scene.configuration is not Configuration.MIDPOINT:
        return
    space, bulk = system.body.space, system.body.scene.materials.elasticity.bulk
    with _unfolded():
        now, at_rest = (space.gradients(nodes).volume for nodes in (start.nodes, space.mesh.nodes))
    with np.errstate(over="ignore"):
        ratio = float(now.sum()) / vdot(at_rest, np.exp(-start.pressure / bulk))
    allowed = f"of the mesh's volume under the stress, not {ratio:.3g} times that: is the scene in other units?"
    require(1 / VOLUMES <= ratio <= VOLUMES, "start.nodes", "positions", allowed)


def _require_balanced(start: State, system: System, tolerance: float) -> None:
    """Require contact forces that the stress balances, because the largest force so far is a scale for later ones.

    They must balance in the configuration in which the scene asks for equilibrium.
    """
    body, contacts = system.body, system.candidates
    none_where_held = not start.forces[~contacts.tangent_free, 1:].any()
    require(none_where_held, "start.forces", "tangential ones", "zero where supports hold a node against them")
    with _unfolded():
        off, scale = _imbalance(start, system, system.balanced(start))
    arrived = Increment(system, replace(start, tau=start.tau - start.length), start.tau)
    # A body that rested in an increment moved by what was left of balance.
    moved = float(norm(start.du).max()) + (arrived.reach if start.length > 0 else STILL * body.scene.mesh.size)
    noise = system.round_off(start.stress, moved)
    why = "is it another scene's?" if start.forces.any() else RELEASED
    allowed = f"in balance with start.stress, not {off:.3g} off where that carries {scale:.3g}: {why}"
    # Written so that inf (no bound) times a scale of zero, which is NaN, refuses nothing.
    require(not off > tolerance * scale + noise, "start.forces", "contact forces", allowed)


def _imbalance(start: State, system: System, nodes: Floats) -> tuple[float, float]:
    """How far stress and contact forces of a start are off balance on ``nodes`` (a, d), and their scale there."""
    space, scene = system.body.space, system.body.scene
    forces = element_force(space.gradients(nodes), start.stress)
    pushed = system.facing(start.nodes).candidates.load(
        start.forces, start.nodes, scene.placed(start.tau, start.translation)
    )
    loads = system.load(system.loading.forces(nodes, start.tau), start.tau)
    # Loads that are on at tau = 0 come in the first increment: a start there carries them already, or not yet.
    carried = [loads] if start.tau > 0 else [loads, np.zeros_like(loads)]
    off = min(_size(space, space.vector(forces) - pushed - load) for load in carried)
    return off, space.force_scale(forces, space.spread(loads))


def _require_posed(start: State, system: System) -> None:
    """Require a configuration that poses balance where the stress is in balance: small displacements at rest."""
    scene, du = system.body.scene, start.du
    places = [("the state's nodes", (start.nodes, start.nodes - du)), ("the mesh at rest", (scene.mesh.nodes,))]
    (here, posed), (there, other) = places[::-1] if scene.configuration is Configuration.SMALL else places
    noise = system.round_off(start.stress, float(norm(du).max()) + STILL * scene.mesh.size)

    def balanced(nodes: Floats) -> bool:
        off, scale = _imbalance(start, system, nodes)
        return off <= BALANCED * scale + noise

    with _unfolded():
        right = any(map(balanced, posed)) or not any(map(balanced, other))
    allowed = f"that of the march before: the stress is in balance on {there}, not on {here}, where this one poses it"
    require(right, "scene.configuration", scene.configuration.value, allowed)


@contextmanager
def _unfolded() -> Iterator[None]:
    """Within it, elements of a start must not be folded."""
    try:
        yield
    except InvertedElement as folded:
        raise SceneError(f"start.nodes: must be those of elements that are not folded: {folded}") from folded


def _size(space: Space, residual: Floats) -> float:
    """The largest residual (n,) of nodes and driven tools, for which the nodes' scale is near enough."""
    return max(float(norm(space.spread(residual)).max()), max_abs(space.beside(residual)))


def _require_like(given: ArrayLike, at_rest: Floats | Bools, field: str, otherwise: str = "") -> None:
    """Require finite numbers in the shape of the scene's array ``at_rest``; ``otherwise`` says what to do."""
    shape, allowed = np.shape(given), f"of shape {at_rest.shape}, as in the scene{otherwise and ': '}{otherwise}"
    require(shape == at_rest.shape, field, f"of shape {shape}", allowed)
    require(bool(np.isfinite(np.asarray(given)).all()), field, "NaN or infinite", "finite")
