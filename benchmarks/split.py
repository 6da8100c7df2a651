"""Where the time of a run goes, by what its passes say they cost.

Steps report seconds by the wall clock: on an idle machine they are parts of a pass's processor time, what is left of it
is the judgement of the answer.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

from bipot.conic.problem import Timing
from bipot.increment import Trial

T = TypeVar("T")


@dataclass
class Split:
    """Processor seconds of all, of the passes (judged), and of the passes by what their steps report."""

    seconds: float = 0.0
    passes: float = 0.0
    timing: Timing = Timing()

    def reset(self) -> None:
        """Forget what was charged."""
        self.seconds, self.passes, self.timing = 0.0, 0.0, Timing()

    def see(self, trial: Trial) -> None:
        """One pass."""
        self.passes += trial.seconds
        self.timing += trial.step.timing

    def while_running(self, steps: Iterator[T]) -> Iterator[T]:
        """The steps of a generator, charged only while it runs."""
        while True:
            began = time.process_time()
            try:
                step = next(steps)
            except StopIteration:
                return
            finally:
                self.seconds += time.process_time() - began
            yield step

    def parts(self) -> dict[str, float]:
        """Seconds on the body, stating and solving programs (wall clock); of starts and ends of increments."""
        return {**vars(self.timing), "other": self.seconds - self.passes}
