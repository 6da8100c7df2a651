"""One run of ``bipot`` in a process of its own, as a user would start it: ``python -m studies.accuracy.alone JOB``.

``JOB`` is a :class:`~studies.accuracy.choice.Choice` and the marks, as JSON; what comes is a :class:`Came` on one line
of standard output.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import skfem  # noqa: F401 (the library loads it with the first mesh, and imports are not counted)

from bipot.control.accepted import Accepted
from bipot.errors import IncrementFailed
from bipot.fem.elements import Quadrature
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.layout import Layout
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.tools.tool import Sampling
from studies.accuracy.choice import Choice, Pace, job_of
from studies.command import command, say
from studies.element_types import ElementType
from studies.methods import Method, Setting, configured
from studies.upsetting_columns import force
from studies.upsetting_march import FIRST

REDUCTION = 0.45
CUTS = 3
"""Few: a fold is not come round."""


def scene_of(job: Choice) -> Scene:
    """The cylinder."""
    kind = ElementType(job.element)
    return upsetting(
        mu=job.mu,
        reduction=REDUCTION,
        elements=job.elements,
        element=kind.element,
        volume=kind.volume,
        quadrature=Quadrature(job.quadrature),
        layout=Layout(job.layout),
        sampling=Sampling(job.contact),
    )


def schedule_of(job: Choice, marks: Sequence[float], reduction: float) -> Schedule:
    """To a ``reduction``, with an end of an increment at each mark."""
    pace, landings = Pace.of(job.schedule), tuple(mark / reduction for mark in marks if mark < reduction)
    if pace.accuracy:
        return Schedule(accuracy=pace.accuracy, landings=landings)
    return Schedule(pace.increments, 0.0 if pace.plain else FIRST / reduction, landings=landings)


@dataclass(frozen=True)
class Came:
    """Forces (N) at the marks that were reached, cost and processor seconds of the march, and why it stopped."""

    forces: list[float]
    unknowns: int
    increments: int
    passes: int
    seconds: float
    stopped: str


def run(job: Choice, marks: Sequence[float]) -> Came:
    """March; seconds count from the making of the scene on, without the imports."""
    began = time.process_time()
    scene, control = configured(Method(job.form), scene_of(job), Setting())
    return marched(scene, replace(control, cuts=CUTS), schedule_of(job, marks, REDUCTION), marks, REDUCTION, began)


def marched(
    scene: Scene, control: Control, schedule: Schedule, marks: Sequence[float], reduction: float, began: float
) -> Came:
    """March to a ``reduction`` and read the force of the tools, along the last axis, at the marks.

    ``began`` is the processor time from which seconds count.
    """
    passes, increments, stopped, marked = 0, 0, "", list[Accepted]()
    try:
        for accepted in march(scene, schedule, control):
            passes, increments = passes + accepted.passes, accepted.number
            if round(accepted.state.tau * reduction, 9) in marks:
                marked.append(accepted)
    except IncrementFailed as failed:
        stopped = " ".join(str(failed).split())
    seconds, system = time.process_time() - began, system_of(scene)
    forces = [force(system, accepted) for accepted in marked]
    return Came(forces, system.body.space.size, increments, passes, seconds, stopped)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Read a job, run it, say what came."""
    say(json.dumps(asdict(run(*job_of("alone", argv)))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
