"""One run of the block in a process of its own: ``python -m studies.accuracy.block_alone JOB``.

As :mod:`studies.accuracy.alone` has the cylinder.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, replace

from bipot.fem.elements import Quadrature
from bipot.fem.strain import Configuration
from bipot.forms import FormName
from bipot.scene.scene import Scene
from bipot.tools.tool import Sampling
from studies.accuracy.alone import CUTS, Came, marched, schedule_of
from studies.accuracy.choice import Choice, job_of
from studies.block import Block
from studies.command import command, say
from studies.element_types import SolidType
from studies.methods import Method, Setting, configured
from studies.upsetting_march import DEFAULT_SOLVER, PAPERS_CURVE


def scene_of(
    mu: float,
    elements: int,
    reduction: float,
    kind: SolidType = SolidType.H8P0,
    rule: Quadrature | None = None,
    sampling: Sampling = Sampling.NODES,
) -> Scene:
    """The study's cube, perfectly plastic."""
    return Block(
        mu=mu,
        elements=elements,
        element=kind,
        sampling=sampling,
        quadrature=rule or kind.quadrature,
        increments=None,
        form=FormName.NEWTON,
        solver=DEFAULT_SOLVER,
        configuration=Configuration.MIDPOINT,
        reduction=reduction,
        hardening=PAPERS_CURVE,
    ).scene()


def run(job: Choice, marks: Sequence[float]) -> Came:
    """March to the last of the marks; seconds count from the making of the scene on, without the imports."""
    began, end = time.process_time(), marks[-1]
    kind, rule, sampling = SolidType(job.element), Quadrature(job.quadrature), Sampling(job.contact)
    cube = scene_of(job.mu, job.elements, end, kind, rule, sampling)
    scene, control = configured(Method(job.form), cube, Setting())
    return marched(scene, replace(control, cuts=CUTS), schedule_of(job, marks, end), marks, end, began)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Read a job, run it, say what came."""
    say(json.dumps(asdict(run(*job_of("block_alone", argv)))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
