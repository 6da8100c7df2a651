"""The hard cases: scenes with the outcome each must have. Numbers in names are those of ``docs/robustness.md``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from bipot.control.accepted import Accepted
from bipot.errors import BipotError
from bipot.laws.hardening import Hardening, Linear, Perfect, Tabulated, Voce
from bipot.marching import Schedule
from bipot.meshes.mesh import Mesh
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.tools.tool import FlatTool

SMALL = 0.001


class Outcome(Enum):
    """How a run ended. CRASHED is any exception the library did not raise on purpose."""

    CERTIFIED = "certified"
    STOPPED = "stopped"
    REFUSED = "refused"
    UNBOUNDED = "unbounded"
    FAILED = "failed"
    CRASHED = "crashed"


@dataclass(frozen=True)
class Settings:
    """Elements a side and uniform increments of a run."""

    elements: int
    increments: int


@dataclass(frozen=True)
class Run:
    """What happened: outcome, accepted increments, and the exception if any."""

    outcome: Outcome
    steps: list[Accepted]
    error: BipotError | Exception | None = None

    @property
    def force(self) -> float:
        """Normal force at the end, on the first tool's candidates and all others."""
        return float(self.steps[-1].solved.r[:, 0].sum()) if self.steps else 0.0


def ends_certified(run: Run) -> bool:
    """To the end, every increment within its bounds."""
    return run.outcome is Outcome.CERTIFIED


@dataclass(frozen=True)
class Case:
    """A named scene, its schedule, and what must come of it.

    ``unit`` of force makes runs of one ``group`` comparable: they must end at the same force.
    """

    name: str
    scene: Callable[[Settings], Scene]
    schedule: Callable[[Settings], Schedule]
    expected: Callable[[Run], bool] = ends_certified
    cuts: int = 8
    group: str = ""
    unit: float = 1.0


def pressed(name: str, *, reduction: float = 0.45, **options: object) -> Case:
    """The seed's cylinder with some data changed."""
    return Case(
        name,
        lambda s: upsetting(reduction=reduction, elements=s.elements, **options),  # type: ignore[arg-type]
        starting(reduction),
    )


def starting(reduction: float, *landings: float) -> Callable[[Settings], Schedule]:
    """A schedule that starts with increments of 0.1 % of the height."""
    return lambda s: Schedule(s.increments, first=SMALL / reduction, settling=4, growth=2.0, landings=landings)


def in_increments(count: int) -> Callable[[Settings], Schedule]:
    """Equal increments from rest."""
    return lambda s: Schedule(count)


def with_punch(scene: Scene, **changes: object) -> Scene:
    """The scene with another first tool."""
    return replace(scene, tools=(replace(scene.tools[0], **changes), *scene.tools[1:]))  # type: ignore[arg-type]


def moved_punch(name: str, gap: float) -> Case:
    """The punch starts ``gap`` above the body (negative: in it)."""
    return Case(
        name,
        lambda s: with_punch(upsetting(mu=0.1, reduction=0.1, elements=s.elements), point=(0.0, 5.0 + gap)),
        starting(0.1),
    )


def unloaded(run: Run) -> bool:
    """Certified; between loading and reloading no force is left but stress is; in the end the punch presses again."""
    apart = [a for a in run.steps if a.state.forces[:, 0].max() <= 1e-9 * abs(run.force)]
    residual = max((float(np.abs(a.state.stress).max()) for a in apart), default=0.0)
    return ends_certified(run) and residual > 1.0 and run.force > 0


def unload_reload() -> Case:
    """20 %, lift by 0.6 % until the punch is clear, reload to 22 %."""
    path = ((0.0, 0.0), (0.5, 1.0), (0.6, 0.97), (1.0, 1.1))
    return Case(
        "6 unload and reload",
        lambda s: with_punch(upsetting(mu=0.3, reduction=0.2, elements=s.elements), path=path),
        starting(0.4, 0.5, 0.6),
        unloaded,
    )


def in_a_die(s: Settings) -> Scene:
    """A wall touches the side from the start: the corner node is held by punch and wall."""
    scene = upsetting(mu=0.1, reduction=0.01, elements=s.elements)
    punch = replace(scene.tools[0], candidates=("top",))
    wall = FlatTool((5.0, 0.0), (-1.0, 0.0), (0.0, 0.0), ("side",), 0.1)
    return replace(scene, tools=(punch, wall))


def pressed_twice(s: Settings) -> Scene:
    """The same punch given twice: every contact row is there two times."""
    scene = upsetting(mu=0.1, reduction=0.1, elements=s.elements)
    return replace(scene, tools=(scene.tools[0], scene.tools[0]))


def distorted(s: Settings) -> Scene:
    """Inner nodes moved by up to a fifth of an element."""
    scene = upsetting(mu=0.1, reduction=0.3, elements=s.elements)
    mesh = scene.mesh
    outer = mesh.boundary_nodes(*mesh.boundaries)
    shift = 0.2 * 5.0 / s.elements * np.random.default_rng(0).uniform(-1, 1, mesh.nodes.shape)
    shift[outer] = 0.0
    # Corners only: mid-sides stay in the middle of their edges, so that edges stay straight.
    return replace(scene, mesh=straightened(mesh, mesh.nodes + shift))


def with_a_thin_row(s: Settings) -> Scene:
    """The second row of elements is a thousand times wider than high."""
    scene = upsetting(mu=0.1, reduction=0.1, elements=s.elements)
    mesh, height = scene.mesh, 5.0 / s.elements
    nodes = mesh.nodes.copy()
    line = np.isclose(nodes[:, 1], 2 * height)
    nodes[line, 1] = height + 1e-3 * height
    return replace(scene, mesh=straightened(mesh, nodes))


def straightened(mesh: Mesh, nodes: np.ndarray) -> Mesh:
    """The mesh on ``nodes`` with every mid-side node in the middle of its edge."""
    nodes = nodes.copy()
    corners = mesh.elements[:, :4]
    ends = np.stack([corners, np.roll(corners, -1, axis=1)])
    nodes[mesh.elements[:, 4:]] = nodes[ends].mean(axis=0)
    return Mesh(nodes, mesh.elements, mesh.boundaries)


def half_greased(s: Settings) -> Scene:
    """mu = 0.3, but zero on every second node of the top."""
    scene = upsetting(mu=0.3, reduction=0.3, elements=s.elements)
    top = scene.mesh.boundary_nodes("top")
    order = top[np.argsort(scene.mesh.nodes[top, 0])]
    return with_punch(scene, mu_at={int(node): 0.0 for node in order[::2]})


def folded(run: Run) -> bool:
    """Certified, or stopped by a mesh distortion whose Jacobian and place are named."""
    named = "Jacobian" in str(run.error) and "element" in str(run.error)
    return ends_certified(run) or (run.outcome is Outcome.STOPPED and named)


def cut_with_reason(run: Run) -> bool:
    """Certified, or stopped with advice; elements never inverted in an accepted state."""
    return ends_certified(run) or run.outcome is Outcome.STOPPED


def in_one(run: Run) -> bool:
    """Certified in a single increment."""
    return ends_certified(run) and len(run.steps) == 1


def hardened(name: str, curve: Callable[[], Hardening], expected: Callable[[Run], bool] = ends_certified) -> Case:
    """Upset by 30 % with a hardening curve made when the case runs."""
    return Case(
        name,
        lambda s: upsetting(mu=0.1, reduction=0.3, hardening=curve(), elements=s.elements),
        starting(0.3),
        expected,
    )


def scaled(name: str, length: float, stress: float) -> Case:
    """The same cylinder in other units: ``length`` per mm, ``stress`` per MPa."""
    return Case(
        name,
        lambda s: upsetting(
            mu=0.1,
            reduction=0.1,
            height=10 * length,
            diameter=10 * length,
            young=210_000 * stress,
            hardening=Perfect(300 * stress),
            elements=s.elements,
        ),
        starting(0.1),
        group="scales",
        unit=stress * length**2,
    )


def cases() -> list[Case]:
    """All scenes, in the order of the table."""
    return [
        pressed("1 mu 0.577", mu=0.577),
        pressed("1 mu 1", mu=1.0),
        pressed("1 mu 10", mu=10.0),
        pressed("1 welded", mu=np.inf),
        replace(pressed("2 folding to 60 %", mu=0.3, reduction=0.6), expected=folded),
        replace(pressed("2 folding to 70 %", mu=0.3, reduction=0.7), expected=folded),
        replace(
            pressed("3 one increment of 10 %", mu=0.1, reduction=0.1),
            schedule=in_increments(1),
            expected=in_one,
            cuts=0,
        ),
        replace(pressed("3 one increment of 45 %", mu=0.1), schedule=in_increments(1), expected=cut_with_reason),
        pressed("4 nu 0.4999", mu=0.1, reduction=0.3, poisson=0.4999),
        *(
            pressed(f"4 E/sigma_Y 1e{k}", mu=0.1, reduction=0.3, hardening=Perfect(210_000 / 10**k))
            for k in range(2, 7)
        ),
        pressed("5 slender H/D 2", mu=0.1, reduction=0.3, height=20.0),
        pressed("5 flat H/D 0.1", mu=0.1, reduction=0.3, height=1.0),
        unload_reload(),
        moved_punch("7 gap 0.05 mm", 0.05),
        moved_punch("7 penetration 1e-3 mm", -1e-3),
        moved_punch("7 gap 1e-14 mm", 1e-14),
        Case("9 corner of punch and die", in_a_die, starting(0.01)),
        Case("9 redundant rows", pressed_twice, starting(0.1)),
        *(
            scaled(f"10 {length} {stress}", per_mm, per_mpa)
            for length, per_mm in (("mm", 1.0), ("m", 1e-3), ("nm", 1e6))
            for stress, per_mpa in (("MPa", 1.0), ("Pa", 1e6))
        ),
        Case("11 distorted mesh", distorted, starting(0.3)),
        Case("11 elements 1000:1", with_a_thin_row, starting(0.1)),
        Case("12 mu zero on every second node", half_greased, starting(0.3)),
        hardened("13 linear", lambda: Linear(300.0, 500.0)),
        hardened("13 Voce", lambda: Voce(300.0, 150.0, 8.0)),
        hardened("13 tabulated", lambda: Tabulated((0.0, 0.05, 0.3), (300.0, 350.0, 420.0))),
        hardened("13 softening", lambda: Linear(300.0, -100.0), lambda run: run.outcome is Outcome.REFUSED),
    ]
