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

import numpy as np

from bipot import columns
from bipot.accepted import Accepted
from bipot.closeness import carries
from bipot.columns import Column
from bipot.exchange import export_fclib
from bipot.fem.kinematics import gradients
from bipot.increment import System
from bipot.marching import Control, Schedule, march
from bipot.progress import terminal
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from bipot.scene import Scene
from studies.command import command, say
from studies.upsetting_beside import BESIDE, trustworthy
from studies.upsetting_case import Case, cases, parser
from studies.upsetting_limits import against_limits
from studies.upsetting_table import Result, table

UNITS = {"length": "mm", "force": "N", "stress": "MPa", "energy": "N mm"}
JOULE = 1e-3


def history_columns(reduction: float) -> list[Column]:
    """The columns of ``history.csv``, for the full cylinder."""

    def height_lost(_: System, accepted: Accepted) -> float:
        # Exactly the asked value at the end of the path.
        return accepted.state.tau * reduction

    return [
        columns.INCREMENT,
        Column("reduction", "reduction in height, fraction", height_lost),
        Column("force_N", "force on the upper punch, N", force),
        Column("contact_radius_mm", "outermost candidate with force, mm", contact_radius),
        Column("top_corner_radius_mm", "radius of the top edge's node, mm", top_corner_radius),
        Column("max_radius_mm", "largest radius, mm", lambda _, a: float(a.state.nodes[:, 0].max())),
        Column("max_peeq", "largest equivalent plastic strain", lambda _, a: float(a.state.peeq.max())),
        Column("volume_ratio", "volume over initial volume", volume_ratio),
        *columns.energies("J", JOULE),
        *columns.COURSE,
        *columns.certificate("J", JOULE),
        columns.OVERLAP,
        columns.MIN_JACOBIAN,
        columns.FLOW_GAP,
        columns.ERROR_ESTIMATE,
        columns.SECONDS,
    ]


def force(system: System, accepted: Accepted) -> float:
    """Force on the upper punch, N: that of the quarter model is the full one."""
    return float(-accepted.tool_force(0)[1])


def contact_radius(system: System, accepted: Accepted) -> float:
    """Radius of the outermost candidate that carries a force, mm."""
    return float(accepted.state.nodes[system.candidates.node[carries(accepted.solved.r)], 0].max(initial=0.0))


def top_corner_radius(system: System, accepted: Accepted) -> float:
    """Radius of the node that top and side share, mm."""
    mesh = system.body.scene.mesh
    corner = np.intersect1d(mesh.boundary_nodes("top"), mesh.boundary_nodes("side"))[0]
    return float(accepted.state.nodes[corner, 0])


def volume_ratio(system: System, accepted: Accepted) -> float:
    """Volume of the deformed mesh over the initial one."""
    scene, reference = system.body.scene, system.body.space.reference
    now, start = (
        gradients(nodes, scene.mesh.elements, reference, scene.geometry).volume.sum()
        for nodes in (accepted.state.nodes, scene.mesh.nodes)
    )
    return float(now / start)


@dataclass(frozen=True)
class Planned:
    """A case with everything that can be refused already made: scene, schedule, control, recorder."""

    case: Case
    scene: Scene
    schedule: Schedule
    control: Control
    recorder: Recorder
    fclib: bool

    @staticmethod
    def of(case: Case, out: Path, existing: Existing = Existing.REFUSE, fclib: bool = False) -> Planned:
        """Make them; raises SceneError or ResultsError."""
        scene, schedule, control = case.scene(), case.schedule(), case.control()
        columns, parameters = history_columns(case.reduction), case.parameters()
        recorder = Recorder(out / case.folder, scene, columns, parameters, UNITS, existing=existing)
        return Planned(case, scene, schedule, control, recorder, fclib)

    def run(self) -> Result:
        """March to the end, recording every accepted increment."""
        progress = terminal()
        with self.recorder as recorder:
            if recorder.note:
                say(f"{recorder.folder}: {recorder.note}", to=sys.stderr)
            progress.start(f"mu = {self.case.mu:g}, {self.case.element.value}, {self.case.form.value}")
            try:
                for accepted in march(self.scene, self.schedule, self.control, recorder.start):
                    # Before it is recorded, so that no recorded increment lacks it when the run is resumed.
                    if self.fclib:
                        self.export(accepted)
                    recorder.record(accepted)
                    progress.advance(accepted.state.tau, f"increment {accepted.number}")
            finally:
                progress.close()
        return Result(self.case.mu, open_results(self.recorder.folder))

    def export(self, accepted: Accepted) -> None:
        """Write the increment's contact problem for other codes."""
        folder = self.recorder.folder / "fclib"
        folder.mkdir(exist_ok=True)
        export_fclib(folder / f"increment_{accepted.number:04d}.hdf5", accepted)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run all cases and print one table, of those that are complete where one is not."""
    asked = parser().parse_args(argv)
    done: list[Result] = []
    asked_for = [(case, asked.out) for case in cases(asked)]
    if asked.beside:
        asked_for += [(trustworthy(case), asked.out / BESIDE) for case, _ in asked_for]
    planned = [Planned.of(case, out, asked.policy, asked.fclib) for case, out in asked_for]
    try:
        done.extend(one.run() for one in planned)
    finally:
        if done:
            say(table(done))
            if forces := against_limits([result.history for result in done]):
                say(forces)
            say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
