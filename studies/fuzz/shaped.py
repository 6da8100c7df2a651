"""Scenes of the fuzz study with tools that are not flat: curved, turning, with friction that the yield stress caps.

Each is that of the same seed with flat tools, of which one or all get another surface: round, hollow, a wedge, a punch
with round edges, a die, a closed roll, several surfaces at once. It is turned to where the flat one looked, and put as
far off the body as that was. Of some the forces that press them and the moments that turn them are given, and some have
supports between the axes (:mod:`studies.fuzz.led`). Quadratic edges some meet in weighted means, as flat ones do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.deformable import AnyTool
from bipot.tools.poses import Turn
from bipot.tools.profiles import Profile, Union, flat_punch, wedge
from bipot.tools.surfaces import Plane, Surface
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from bipot.typing import Floats, Ints
from studies.fuzz.led import aslant, led
from studies.fuzz.meshes import Rng
from studies.fuzz.points import edges_of, sampled
from studies.fuzz.scenes import Drawn, cut_by_planes, draw
from studies.fuzz.surfaces import outlines, pair

ALONE, TURNING = 0.7, 0.75
"""Of the scenes with two tools have one that is shaped; of the tools that may turn do."""

TRIES, HALVINGS = 12, 60
"""Of draws until the library takes a scene, and of the way on which a tool comes down on the body."""

MOST = 0.9
"""Of the angles (radians) that tools turn by."""

AMPLITUDES = (
    Amplitude(),
    Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, -0.2))),
    Amplitude(((0.0, 0.0), (0.4, 0.0), (1.0, 1.0))),
)
"""Of turns: all the way, there and back, later than the tool goes."""

CAPS = ("none", "constant", "orowan")

UNCAPPED = ("delassus",)
"""Forms that know Coulomb's cone alone."""


def draw_shaped(seed: int) -> Drawn:
    """The scene of ``seed``; always the same.

    Raises:
        SceneError: no draw made a scene that the library takes.
    """
    rng, drawn = np.random.default_rng([seed, 10]), draw(seed)

    def made() -> Scene:
        shaped = _shaped(rng, drawn.scene, caps=drawn.form not in UNCAPPED)
        scene = aslant(np.random.default_rng([seed, 14]), led(np.random.default_rng([seed, 12]), shaped))
        return _in_means(np.random.default_rng([seed, 15]), scene)

    return replace(drawn, scene=tried(made))


def tried(made: Callable[[], Scene]) -> Scene:
    """The first scene ``made`` that the library takes.

    Raises:
        SceneError: none of so many was one.
    """
    why: SceneError | None = None
    for _ in range(TRIES):
        try:
            return made()
        except SceneError as error:
            why = error
    assert why is not None
    raise why


def _shaped(rng: Rng, scene: Scene, caps: bool) -> Scene:
    """The scene with other tools, whose friction is capped if there are to be ``caps``.

    Sides that are held are planes of symmetry, or not, as the tools let them.
    """
    held = tuple(Support(s.boundary, s.direction) if isinstance(s, Symmetry) else s for s in scene.supports)
    planes = any(isinstance(s, Symmetry) for s in scene.supports)
    may = [k for k, tool in enumerate(scene.tools) if tool.driven_by is None]
    if not may:
        # The first one goes its way here, whatever drives it in its place.
        may = [0]
    chosen = [int(rng.choice(may))] if len(may) > 1 and rng.random() < ALONE else may
    symmetric = planes and rng.random() < 0.5
    tools = [_tool(rng, scene, tool, symmetric) if k in chosen else tool for k, tool in enumerate(scene.tools)]
    tools = [capped(rng, tool, _touching(scene, tool)) for tool in tools] if caps else tools
    other = replace(scene, supports=held, tools=tuple(tools))
    return cut_by_planes(rng, other) if planes else other


def _in_means(rng: Rng, scene: Scene) -> Scene:
    """The scene with contact in weighted means at its shaped tools as often as at flat ones."""
    shaped = iter(sampled(rng, scene.mesh, tuple(tool for tool in scene.tools if isinstance(tool, ShapedTool))))
    return replace(scene, tools=tuple(next(shaped) if isinstance(tool, ShapedTool) else tool for tool in scene.tools))


def _tool(rng: Rng, scene: Scene, tool: AnyTool, symmetric: bool) -> ShapedTool:
    """A shaped tool for a flat one, its own mirror image across the left side if ``symmetric``, or around an axis."""
    assert isinstance(tool, FlatTool)
    x = scene.mesh.nodes[scene.mesh.boundary_nodes(*tool.candidates)]
    normal, ring = np.array(tool.normal), scene.geometry is Geometry.AXISYMMETRIC
    tangent = np.array([normal[1], -normal[0]])
    extent = max(float(np.ptp(x @ tangent)), 0.3 * scene.mesh.size)
    left = scene.mesh.nodes[:, 0].min()
    upright = abs(normal[0]) < 1e-9
    centred = upright and (symmetric or (ring and rng.random() < 0.7))
    foot = np.array([0.0 if ring else left, 0.0]) if centred else x[rng.integers(len(x))]
    kind = str(rng.choice(list(KINDS), p=SHARES))
    local, gap = KINDS[kind](rng, extent, centred), float(((x - tool.point) @ normal).min())
    own = outlines(_moved(local, normal, foot))
    down = lowered(lambda by: min(float(o.near(x - by * normal).gap.min()) for o in own), gap, 2 * scene.mesh.size)
    surface = _moved(local, normal, foot + down * normal)
    travel = (0.0, tool.travel[1]) if centred else tool.travel
    rests = ring or centred or rng.random() >= TURNING
    turn = None if rests else _turn(rng, surface, foot, normal, (extent, float(np.linalg.norm(travel))))
    return ShapedTool(
        surface, travel, tool.candidates, tool.mu, tool.path, tool.mu_at, sampling=Sampling.NODES, turn=turn
    )


def _turn(rng: Rng, surface: Surface, foot: Floats, normal: Floats, lengths: tuple[float, float]) -> Turn:
    """About the middle of a round tool, or a place above or below ``foot``; by as much as the tool goes, or so.

    The ``lengths`` are those of the body's side and of the tool's way.
    """
    extent, way = lengths
    if isinstance(surface, Circle) and rng.random() < 0.7:
        middle, lever = surface.centre, surface.radius
    else:
        middle, lever = pair(foot + rng.uniform(-2, 0.5) * extent * normal), extent
    angle = min(way / lever * 10.0 ** rng.uniform(-1.5, 1.0), MOST)
    return Turn(angle * float(rng.choice([-1.0, 1.0])), middle, AMPLITUDES[rng.choice(3, p=[0.6, 0.25, 0.15])])


def _touching(scene: Scene, tool: AnyTool) -> Ints:
    """Nodes (n,) at which a tool may have coefficients of its own."""
    edges = edges_of(scene, tool)
    return np.unique(edges[:, [0, -1]] if tool.sampling is Sampling.WEIGHTED else edges)


def capped(rng: Rng, tool: AnyTool, nodes: Ints) -> AnyTool:
    """Friction as it is, or of constant shear, or capped by it: at some ``nodes`` by another part, or not at all."""
    kind = str(rng.choice(CAPS, p=[0.45, 0.3, 0.25]))
    if kind == "none":
        return tool
    shear = float(rng.choice([0.0, rng.uniform(0, 1), 1.0], p=[0.05, 0.85, 0.1]))
    if kind == "constant" or np.isinf(tool.mu):
        return replace(tool, mu=np.inf, mu_at={}, shear=shear)
    some = rng.choice(nodes, size=len(nodes) // 2) if rng.random() < 0.4 else nodes[:0]
    others = {int(a): float(rng.choice([rng.uniform(0, 1), np.inf], p=[0.8, 0.2])) for a in some}
    return replace(tool, shear=shear, shear_at=others)


def lowered(least: Callable[[float], float], gap: float, far: float) -> float:
    """How far, no farther than ``far``, a tool has to go for what is the ``least`` gap there to be the ``gap``."""
    low, high = -far, far
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if least(middle) > gap else (low, middle)
    return low


def _moved(surface: Surface, normal: Floats, foot: Floats) -> Surface:
    """A surface that looks down from the origin, looking along ``normal`` from ``foot``."""
    turn = np.column_stack([(-normal[1], normal[0]), -normal])

    def at(point: tuple[float, ...]) -> tuple[float, float]:
        return pair(turn @ point + foot)

    if isinstance(surface, Circle):
        return replace(surface, centre=at(surface.centre))
    if isinstance(surface, Plane):
        return Plane(at(surface.point), pair(turn @ surface.normal))
    if isinstance(surface, Union):
        return Union(tuple(_moved(part, normal, foot) for part in surface.surfaces))
    assert isinstance(surface, Profile)
    return Profile(tuple(at(point) for point in surface.points), surface.fillets, surface.closed)


def _ball(rng: Rng, extent: float, centred: bool) -> Surface:
    """Round, from a third of the body's side to ten of them."""
    radius = extent * 10.0 ** rng.uniform(-0.5, 1.0)
    return Circle((0.0, radius), radius)


def _bowl(rng: Rng, extent: float, centred: bool) -> Surface:
    """Hollow, wider than the body."""
    radius = extent * 10.0 ** rng.uniform(0.1, 1.0)
    return Circle((0.0, -radius), radius, concave=True)


def _wedge(rng: Rng, extent: float, centred: bool) -> Surface:
    """Blunt, round at its tip but for one of ten."""
    angle, length = float(rng.uniform(50, 87)), 4 * extent
    return wedge((0.0, 0.0), angle, length, 0.0 if rng.random() < 0.1 else extent * float(rng.uniform(0.05, 1.0)))


def _punch(rng: Rng, extent: float, centred: bool) -> Surface:
    """Flat with round edges."""
    width = extent * float(rng.uniform(0.5, 3))
    return flat_punch((0.0, 0.0), width, 2 * extent, width * float(rng.uniform(0.1, 0.45)))


def _die(rng: Rng, extent: float, centred: bool) -> Surface:
    """A line of three to five straights with fillets, or that and its mirror image."""
    count = int(rng.integers(2, 5))
    across = np.sort(rng.uniform(0.1, 1.2, count) if centred else rng.uniform(-1.0, 1.0, count)) * extent
    points = np.column_stack([across, rng.uniform(-0.25, 0.25, count) * extent])
    ends = np.array([(-3 * extent, points[0, 1]), (3 * extent, points[-1, 1])])
    line = np.vstack([points * (-1, 1), points]) if centred else points
    line = line[np.argsort(-line[:, 0])]
    # A mirror image ends as high on the left as on the right.
    ends[0, 1] = line[-1, 1] if not centred else ends[1, 1]
    every = np.vstack([ends[1], line, ends[0]])
    return Profile(tuple(map(pair, every)), extent * float(rng.uniform(0.02, 0.15)))


def _roll(rng: Rng, extent: float, centred: bool) -> Surface:
    """Closed, of four to seven corners with fillets."""
    count, radius = int(rng.integers(4, 8)), extent * 10.0 ** rng.uniform(-0.2, 0.5)
    # Clockwise, a corner or a side at the bottom.
    angle = -np.pi / 2 - 2 * np.pi * (np.arange(count) + 0.5 * float(rng.integers(2))) / count
    corners = radius * np.column_stack([np.cos(angle), 1 + np.sin(angle)])
    side = 2 * radius * np.sin(np.pi / count)
    return Profile(tuple(map(pair, corners)), side * float(rng.uniform(0.1, 0.4)), closed=True)


def _several(rng: Rng, extent: float, centred: bool) -> Surface:
    """Two balls beside each other, a ball through a plane, or two planes."""
    radius, kind = extent * 10.0 ** rng.uniform(-0.3, 0.7), int(rng.integers(3))
    apart = radius * float(rng.uniform(0.3, 2.5))
    if kind == 0:
        return Union((Circle((-apart / 2, radius), radius), Circle((apart / 2, radius), radius)))
    if kind == 1:
        height = float(rng.uniform(0.05, 0.5)) * extent
        return Union((Circle((0.0, radius), radius), Plane((0.0, height), (0.0, -1.0))))
    angle = float(rng.uniform(0.02, 0.4))
    sides = [(float(sign * np.sin(angle)), -float(np.cos(angle))) for sign in (-1.0, 1.0)]
    return Union((Plane((0.0, 0.0), sides[0]), Plane((0.0, 0.0), sides[1])))


KINDS: dict[str, Callable[[Rng, float, bool], Surface]] = {
    "ball": _ball,
    "bowl": _bowl,
    "wedge": _wedge,
    "punch": _punch,
    "die": _die,
    "roll": _roll,
    "several": _several,
}

SHARES = (0.24, 0.12, 0.1, 0.14, 0.14, 0.1, 0.16)
