"""A study of jobs that do nothing, through the pool and the command that every study goes through; no test itself.

    python -m tests.tiny_study FOLDER WORKERS JOBS WAITING

Every job leaves the number of its process in FOLDER, every result a line in FOLDER/rows. Jobs from WAITING on do not
end by themselves.
"""

import os
import signal
import sys
import time
from contextlib import closing
from functools import partial
from pathlib import Path

from bipot.errors import NotConverged
from studies import leave
from studies.command import command, say
from studies.pool import completed

FAILS = -1
"""In the place of WAITING: the last job fails."""


def job(number, folder, jobs, waiting):
    """One of the jobs."""
    (folder / f"{os.getpid()}.pid").touch()
    while number >= waiting != FAILS:
        time.sleep(0.05)
    if waiting == FAILS and number == jobs - 1:
        raise NotConverged("job refused")
    return number


@command
def main():
    """All jobs."""
    folder, workers, jobs, waiting = Path(sys.argv[1]), *map(int, sys.argv[2:])
    with closing(completed(partial(job, folder=folder, jobs=jobs, waiting=waiting), range(jobs), workers)) as results:
        for result in results:
            with (folder / "rows").open("a") as rows:
                rows.write(f"{result}\n")
    say("done")
    return 0


if __name__ == "__main__":
    # As it is of a study that is run by its name.
    signal.signal(signal.SIGINT, leave)
    sys.exit(main())
