r"""How the results of a march change with parameters of its scene, from that march alone.

An accepted increment has the unknowns x and the contact forces r. The same increment of a scene with one parameter
changed by h, from the start that this scene has by then, has x and r for its own but for terms of order h, which one
step of Newton's method finds to h^2, and a second one to what its matrix leaves out:

    K dx - G' dr = - (rho_h - G_h' r),    law_h at x, r, linearised,

with the residual rho_h, the rows G_h and the law of the changed scene, and the matrix of the accepted increment,
factorised once for all parameters. The state after it is that of any increment. A step with h = 0 takes out what the
answer had left of its own equations, so that

    dq/dp = (q_h - q_0)/h,    h = CHANGE times the size of the parameter.

What a march decides is kept: where its increments end, and what part of the last flow is carried on. The derivative is
that of a march which does the same, on the pieces of the law on which its contacts are. Where a contact is between two
pieces, as one that lands at the very end of an increment, or where the side of one part ends right before the end of
another's, there is none: ``Slope.smooth`` says so. Round-off leaves an
error of some 1e-13 q/h, which is much where a parameter of that size hardly matters: ``Slope.resolved``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bipot.beside import RESOLVED, Beside, Tangent
from bipot.control.accepted import Accepted
from bipot.control.control import Control
from bipot.errors import require, require_number, require_type
from bipot.forms import Cache
from bipot.marching import march
from bipot.scene.scene import Scene
from bipot.schedule import Schedule
from bipot.system import System, system_of
from bipot.typing import Bools, EqualByNumbers, Floats, FrozenMap, Ints, max_abs, read_only

CHANGE = 1e-6
"""Change h of a parameter, over its size: terms of order h are then as small as what round-off leaves over h."""

LEAST = 1e-200
"""A change below this, or above its inverse, leaves no room for slopes among floats."""

LEFT = 1e-3
"""Part of the change of places, or of as much as is resolved, above which a last step says that no answer was found."""


@dataclass(frozen=True, eq=False)
class Slope(EqualByNumbers):
    """Derivatives, by one parameter, of an accepted increment's ``tool_forces`` (k, d) and of its state's fields.

    These are ``nodes`` (a, d), ``stress`` (e, q, s) and ``peeq`` (e, q). ``smooth`` says that all contacts stay on
    their pieces of the law as the parameter grows: touching or not, stuck or sliding; and that what sides of parts
    face has no kink there. ``resolved`` says that round-off is not more than a thousandth of the largest slope of
    forces, or of that of nodes: the parameter matters by then, and the steps to the changed answer have come to their
    end. Arrays are read-only.
    """

    tool_forces: Floats
    nodes: Floats
    stress: Floats
    peeq: Floats
    smooth: bool
    resolved: bool


def sensitivities(
    scene_of: Callable[..., Scene],
    at: Mapping[str, float],
    schedule: Schedule,
    control: Control = Control(),
    sizes: Mapping[str, float] = FrozenMap({}),
) -> Iterator[tuple[Accepted, FrozenMap[str, Slope]]]:
    """March the scene ``scene_of(**at)``, and yield each accepted increment with its slopes by the parameters ``at``.

    ``scene_of`` takes the parameters by name. They may be anything that leaves the mesh its elements, and bodies and
    tools what touches what: coefficients of friction, those of materials, lengths, travels, loads. A parameter that is
    zero, or far from the size at which it matters, needs that size in ``sizes``. Pseudo-times at which paths turn are
    no parameters: increments end there.

    Raises:
        SceneError: at once, a wrong type; no parameter, or one that is no finite number; scenes of other elements,
            supports, tools, candidates or kinds of these, or whose paths turn at other times; a material whose stress
            is not returned; an accuracy or landings that are located, with which the increments
            themselves change with the parameters. With an increment, a form of penalised contact.
        IncrementFailed: as of :func:`~bipot.marching.march`.
        ProgramError: nothing determines how the answer changes, as of a body that is held by nothing.
        InvertedElement: an element of a changed scene is inverted.
    """
    require(callable(scene_of), "scene_of", scene_of, "a function of the parameters that makes a Scene")
    require_type(schedule, Schedule, "schedule")
    require_type(control, Control, "control")
    allowed = "None: lengths by an accuracy change with the parameters"
    require(schedule.accuracy is None, "schedule.accuracy", schedule.accuracy, allowed)
    allowed = "None: with the parameters landings come at other times, where the increments end"
    require(control.locate is None, "control.locate", control.locate, allowed)
    at, changes = _changed(at, sizes)
    system = _system(scene_of, at, "scene_of(**at)")
    material, allowed = system.body.scene.materials, "one whose stress is returned to the yield surface"
    require(not material.drifts, "material", material, allowed)
    others = {
        name: _system(scene_of, {**at, name: at[name] + h}, f"scene_of, {name} changed", system)
        for name, h in changes.items()
    }
    same, beside = Beside.of(system), {name: Beside.of(other) for name, other in others.items()}
    return _slopes(march(system.body.scene, schedule, control), same, beside, changes)


def _changed(at: Mapping[str, float], sizes: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """The parameters ``at`` which to march, and how much they are changed, by name."""
    named = isinstance(at, Mapping) and bool(at) and all(isinstance(name, str) for name in at)
    require(named, "at", at, "one parameter or more, by name")
    require(isinstance(sizes, Mapping) and set(sizes) <= set(at), "sizes", sizes, f"of some of {[*at]}, by name")
    changes: dict[str, float] = {}
    for name, value in at.items():
        require_number(value, f"at[{name!r}]")
        require(abs(value) < np.inf, f"at[{name!r}]", value, "finite")
        size = sizes.get(name, value)
        require_number(size, f"sizes[{name!r}]")
        require(0 < abs(size) < np.inf, f"sizes[{name!r}]", size, "finite, and not zero as the parameter is")
        # The difference of the two numbers that scenes are made of, which round-off of their sum changes.
        changes[name] = float(value) + CHANGE * abs(float(size)) - float(value)
        allowed = f"such that {CHANGE:g} of it is a change of {value} and within {LEAST:g} and {1 / LEAST:g}"
        require(LEAST <= changes[name] <= 1 / LEAST, f"sizes[{name!r}]", size, allowed)
    return {name: float(value) for name, value in at.items()}, changes


def _system(scene_of: Callable[..., Scene], at: Mapping[str, float], said: str, like: System | None = None) -> System:
    """The scene of the parameters ``at``, prepared, with the unknowns and the candidates of another one ``like`` it."""
    scene = scene_of(**at)
    require_type(scene, Scene, said)
    system = system_of(scene)
    if like is not None:
        allowed = "of the same elements, supports, tools and candidates, with friction at the same of them"
        require(all(map(np.array_equal, _numbering(system), _numbering(like))), said, "a scene", allowed)
        allowed = "of the same geometry, configuration, quadrature, volume change and kinds of material and tools"
        require(_kinds(scene) == _kinds(like.body.scene), said, "a scene", allowed)
        kinks, allowed = like.body.scene.kinks, "as at first: increments end where paths turn, and miss later turns"
        require(set(kinks) <= set(scene.kinks), f"{said}.kinks", scene.kinks, f"{kinks} {allowed}")
        system = replace(system, candidates=replace(system.candidates, like=like.candidates))
    return system


def _numbering(system: System) -> tuple[Ints | Bools, ...]:
    """What must be alike for unknowns and contacts to be the same."""
    contacts, space = system.candidates, system.body.space
    law = contacts.mu > 0, np.isinf(contacts.mu), np.isinf(contacts.shear)
    return system.body.scene.mesh.elements, space.position, space.free, contacts.node, contacts.tool, *law


def _kinds(scene: Scene) -> tuple[object, ...]:
    """What must be equal for the body's response and the tools' rows to be the same functions."""
    tools = tuple((tool.flat, type(tool.face), tool.sampling, tool.driven_by is None) for tool in scene.tools)
    body = scene.mesh.element, scene.geometry, scene.configuration, scene.rule, scene.volume_change
    materials = type(scene.material), {name: type(own) for name, own in scene.regions.items()}
    return *body, *materials, tools


def _slopes(
    marched: Iterator[Accepted], same: Beside, others: Mapping[str, Beside], changes: Mapping[str, float]
) -> Iterator[tuple[Accepted, FrozenMap[str, Slope]]]:
    cache = Cache()
    for accepted in marched:
        tangent = Tangent.of(accepted, cache)
        for beside in (same, *others.values()):
            beside.follow(tangent)
        yield accepted, FrozenMap({name: _slope(same, other, changes[name]) for name, other in others.items()})


def _slope(same: Beside, other: Beside, h: float) -> Slope:
    """The slope by a parameter that is changed by ``h`` in the ``other`` scene."""
    (force, now), (changed, then) = ((beside.tool_forces, beside.state) for beside in (same, other))
    least, moved = RESOLVED * same.system.body.scene.size, max_abs(then.nodes - now.nodes)
    matters = max_abs(changed - force) > RESOLVED * max_abs(force) or moved > least
    resolved = matters and same.left + other.left <= LEFT * max(moved, least)
    return Slope(
        tool_forces=read_only((changed - force) / h, np.float64),
        nodes=read_only((then.nodes - now.nodes) / h, np.float64),
        stress=read_only((then.stress - now.stress) / h, np.float64),
        peeq=read_only((then.peeq - now.peeq) / h, np.float64),
        smooth=same.smooth and other.smooth and not same.kinked(other),
        resolved=resolved,
    )
