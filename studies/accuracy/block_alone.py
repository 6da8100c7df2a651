"""One run of the block in a process of its own: ``python -m studies.accuracy.block_alone JOB``.

As :mod:`studies.accuracy.alone` has the cylinder.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict

from studies import block
from studies.accuracy.alone import Came, marched, schedule_of
from studies.accuracy.choice import Choice
from studies.command import command, say


def run(job: Choice, marks: Sequence[float]) -> Came:
    """March to the last of the marks; seconds count from the making of the scene on, without the imports."""
    began, end = time.process_time(), marks[-1]
    asked = ["--mu", f"{job.mu:g}", "--elements", str(job.elements), "--element-type", job.element]
    (case,) = block.cases(block.parser().parse_args([*asked, "--form", job.form, "--reduction", f"{end:g}"]))
    return marched(case.scene(), case.control(), schedule_of(job, marks, end), marks, end, began)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Read a job, run it, say what came."""
    job, *marks = json.loads((sys.argv[1:] if argv is None else argv)[0])
    say(json.dumps(asdict(run(Choice(**job), marks))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
