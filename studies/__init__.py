"""One script a question: ``python -m studies.NAME [--fast] [--out DIR]``. Studies write results only.

Thread counts are set here, before numpy is imported: the matrices are small and threads only contend. And so is what
becomes of Ctrl-C while all that is imported, which takes seconds: a sentence. :mod:`studies.command` goes on with it.
"""

import os
import signal
import sys

INTERRUPTED = 130
"""Exit code after Ctrl-C or SIGTERM."""

STOPPED = "stopped; what was computed is on disk"

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")


def leave(number: int, frame: object) -> None:
    """End at once: an exception would pass through modules half imported, some of which print or swallow it."""
    try:
        if sys.stderr is not None:
            os.write(sys.stderr.fileno(), f"{STOPPED}\n".encode())
    finally:
        os._exit(INTERRUPTED)


def _begin() -> None:
    """Take signals, unless they are ignored, and keep files from the numbers of streams that are closed."""
    for number, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, signal.SIG_DFL)):
        if signal.getsignal(number) == usual:
            signal.signal(number, leave)
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # The lowest number that is free: what compiled code prints goes nowhere, and not into a table.
            os.open(os.devnull, os.O_RDWR)
    # Python leaves None in the place of a closed stream, and some versions of NumPy ask it for its ``write``.
    sys.stdout = sys.stdout or os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
    sys.stderr = sys.stderr or os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")


# Python says "-m" until it has found the module to run: here a study or a benchmark runs, nobody imports one.
if sys.argv[:1] == ["-m"]:
    _begin()
