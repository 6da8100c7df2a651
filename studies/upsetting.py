r"""The seed paper's example: a cylinder upset between rigid punches with exact Coulomb friction.

    python -m studies.upsetting --mu 0.1 0.3 [--beside] [--form tangent|dissipation|newton|penalty|uzawa|delassus]

A 10 x 10 mm cylinder, E = 210 GPa, nu = 0.3, sigma_Y = 300 MPa, is compressed by 45 %; ``--height``, ``--diameter``,
``--E``, ``--nu``, ``--sigma-Y`` or ``--hardening csv:FILE``, and ``--reduction`` ask for others. For each mu the
folder ``DIR/mu{mu}`` receives ``history.csv`` (full cylinder, one row an accepted increment), ``run.vtkhdf`` (fields,
for ParaView) and ``tools.vtkhdf`` (the punch). A folder that holds a run is left alone unless ``--resume`` goes on with
it or ``--overwrite`` begins anew.
``--beside`` runs each case with Q4/P0 too, the element without locking, in ``DIR/q4p0``. The tables at the end say how
far the answer is from the law, and how far the force is from what refined meshes tend to.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bipot.marching import Control, Schedule, march
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from bipot.scene.scene import Scene
from studies.command import command, say
from studies.progress import terminal
from studies.upsetting_beside import BESIDE, trustworthy
from studies.upsetting_case import cases, parser
from studies.upsetting_columns import UNITS
from studies.upsetting_fclib import Problems
from studies.upsetting_limits import against_limits
from studies.upsetting_march import Upset
from studies.upsetting_table import Result, table


@dataclass(frozen=True)
class Planned:
    """A case with everything that can be refused already made: scene, schedule, control, recorder."""

    case: Upset
    scene: Scene
    schedule: Schedule
    control: Control
    recorder: Recorder
    problems: Problems

    @staticmethod
    def of(case: Upset, out: Path, existing: Existing = Existing.REFUSE, fclib: bool = False) -> Planned:
        """Make them; raises SceneError or ResultsError."""
        scene, schedule, control = case.scene(), case.schedule(), case.control()
        parameters = case.parameters()
        recorder = Recorder(out / case.folder, scene, case.columns(), parameters, UNITS, existing=existing)
        problems = Problems(recorder.folder, fclib)
        problems.require_whole(existing)
        return Planned(case, scene, schedule, control, recorder, problems)

    def run(self) -> Result:
        """March to the end, recording every accepted increment."""
        progress = terminal()
        with self.recorder as recorder:
            self.problems.cut_back(recorder.start.number)
            if recorder.note:
                say(f"{recorder.folder}: {recorder.note}", to=sys.stderr)
            progress.start(f"mu = {self.case.mu:g}, {self.case.element.value}, {self.case.form.value}")
            try:
                for accepted in march(self.scene, self.schedule, self.control, recorder.start):
                    # Before it is recorded, so that no recorded increment lacks it when the run is resumed.
                    self.problems.write(accepted)
                    recorder.record(accepted)
                    progress.advance(accepted.state.tau, f"increment {accepted.number}")
            finally:
                progress.close()
        return Result(self.case.mu, open_results(self.recorder.folder))


def complete(planned: Sequence[Planned], out: Path) -> int:
    """Run all and print one table, of those that are complete where one is not."""
    done: list[Result] = []
    try:
        done.extend(one.run() for one in planned)
    finally:
        if done:
            say(table(done))
            if forces := against_limits([result.history for result in done]):
                say(forces)
            say(f"results in {out.resolve()}")
    return 0


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run all cases, and those beside them."""
    asked = parser().parse_args(argv)
    asked_for = [(case, asked.out) for case in cases(asked)]
    if asked.beside:
        asked_for += [(trustworthy(case), asked.out / BESIDE) for case, _ in asked_for]
    return complete([Planned.of(case, out, asked.policy, asked.fclib) for case, out in asked_for], asked.out)


if __name__ == "__main__":
    sys.exit(main())
