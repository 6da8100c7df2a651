r"""The seed paper's example: a cylinder upset between rigid punches with exact Coulomb friction.

    python -m studies.upsetting --mu 0.1 0.3 [--form tangent|dissipation|newton|penalty|uzawa|delassus] [--out DIR]

A 10 x 10 mm cylinder, E = 210 GPa, nu = 0.3, sigma_Y = 300 MPa, is compressed by 45 %. For each mu the folder
``DIR/mu{mu:g}`` receives ``history.csv`` (full cylinder, one row an accepted increment) and ``run.h5`` (fields, for
ParaView). The table at the end says how far the answer is from the law.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bipot import columns
from bipot.columns import Column
from bipot.errors import BipotError, require
from bipot.exchange import export_fclib
from bipot.fem.elements import Quadrature
from bipot.fem.kinematics import Configuration, gradients
from bipot.forms import (
    Backend,
    Delassus,
    Dissipation,
    Form,
    FormName,
    Newton,
    Penalty,
    Tangent,
    Uzawa,
    contact_penalty,
)
from bipot.history import History, Recorder, load
from bipot.increment import System, tool_forces
from bipot.laws.hardening import Hardening, hardening_from_text
from bipot.march import Accepted, Control, Schedule, march, system_of
from bipot.progress import terminal
from bipot.scene import Scene, upsetting

UNITS = {"length": "mm", "force": "N", "stress": "MPa", "energy": "N mm"}
JOULE = 1e-3
# First yield with friction defeats larger increments (fraction of the height).
FIRST, SETTLING = 0.001, 5
FAST = {"elements": 4, "increments": 6}
DEFAULT = {"elements": 10, "increments": 45}
TOUCHING = 1e-8
# Refreshing the traction converges the faster the larger the penalty; it costs no accuracy there.
UZAWA_FACTOR = 1e4


@dataclass(frozen=True)
class Case:
    """One run: the scene's choices and the march's, as asked on the command line."""

    mu: float
    elements: int
    quadrature: Quadrature
    increments: int
    form: FormName
    backend: Backend
    configuration: Configuration
    reduction: float
    hardening: str
    kn: float | None = None
    kt: float | None = None

    def scene(self) -> Scene:
        """The cylinder; raises SceneError on bad input."""
        return upsetting(
            mu=self.mu,
            reduction=self.reduction,
            hardening=self.curve(),
            elements=self.elements,
            quadrature=self.quadrature,
            configuration=self.configuration,
        )

    def curve(self) -> Hardening:
        """The hardening curve asked for."""
        return hardening_from_text(self.hardening)

    def schedule(self) -> Schedule:
        """Start-up increments of 0.1 % of the height under friction, none without."""
        if self.mu == 0:
            return Schedule(self.increments)
        shortest = FIRST * SETTLING
        require(
            self.reduction > shortest,
            "reduction",
            self.reduction,
            f"> {shortest}, the start-up under friction",
        )
        return Schedule(self.increments, FIRST / self.reduction, SETTLING)

    def control(self) -> Control:
        """The form with its fallbacks; a penalised one has none, because an exact one would change the law."""
        tangent, dissipation = Tangent(backend=self.backend), Dissipation(backend=self.backend)
        choices: dict[FormName, tuple[Form, tuple[Form, ...]]] = {
            FormName.TANGENT: (tangent, (dissipation,)),
            FormName.DISSIPATION: (dissipation, ()),
            FormName.NEWTON: (Newton(), (tangent, dissipation)),
            FormName.DELASSUS: (Delassus(), (dissipation,)),
            FormName.PENALTY: (Penalty(*self.penalties(1.0)), ()),
            FormName.UZAWA: (Uzawa(*self.penalties(UZAWA_FACTOR)), ()),
        }
        form, fallbacks = choices[self.form]
        return Control(form, fallbacks)

    def penalties(self, factor: float) -> tuple[float, float]:
        """K_n and K_t, N/mm per node; by default ``factor`` E/h of the contact edge (:func:`contact_penalty`)."""
        default = contact_penalty(system_of(self.scene()).candidates, factor)
        return default if self.kn is None else self.kn, default if self.kt is None else self.kt

    def parameters(self) -> dict[str, Any]:
        """What identifies the run in its folder."""
        return {k: getattr(v, "value", v) for k, v in vars(self).items()} | {"mu": f"{self.mu:g}"}


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
        columns.MIN_JACOBIAN,
        columns.FLOW_GAP,
        columns.SECONDS,
    ]


def force(system: System, accepted: Accepted) -> float:
    """Force on the upper punch, N: that of the quarter model is the full one."""
    return float(-tool_forces(system, accepted.solved.r)[0, 1])


def contact_radius(system: System, accepted: Accepted) -> float:
    """Radius of the outermost candidate with a force above 1e-8 of the largest, mm."""
    pushed = accepted.solved.r[:, 0]
    touching = pushed > TOUCHING * pushed.max()
    return float(accepted.state.nodes[system.candidates.node[touching], 0].max(initial=0.0))


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
    def of(case: Case, out: Path, fclib: bool = False) -> Planned:
        """Make them; raises SceneError or ResultsError."""
        scene, schedule, control = case.scene(), case.schedule(), case.control()
        folder = out / f"mu{case.mu:g}"
        recorder = Recorder(folder, scene, history_columns(case.reduction), case.parameters(), UNITS)
        return Planned(case, scene, schedule, control, recorder, fclib)

    def run(self) -> str:
        """March to the end, recording every accepted increment; returns the case's line of the table."""
        progress, began = terminal(), time.perf_counter()
        with self.recorder as recorder:
            progress.start(f"mu = {self.case.mu:g}, {self.case.form.value}")
            try:
                for accepted in march(self.scene, self.schedule, self.control):
                    recorder.record(accepted)
                    if self.fclib:
                        self.export(accepted)
                    progress.advance(accepted.state.tau, f"increment {accepted.number}")
            finally:
                progress.close()
        return summary(self.case, load(self.recorder.folder), time.perf_counter() - began)

    def export(self, accepted: Accepted) -> None:
        """Write the increment's contact problem for other codes."""
        folder = self.recorder.folder / "fclib"
        folder.mkdir(exist_ok=True)
        export_fclib(folder / f"increment_{accepted.number:04d}.hdf5", self.recorder.system, accepted)


def parser() -> argparse.ArgumentParser:
    """The command line; names are those of the library's enums."""
    p = argparse.ArgumentParser(prog="studies.upsetting", description="Upset the cylinder of the seed paper.")
    p.add_argument("--mu", type=float, nargs="+", default=[0.1, 0.3], help="Coulomb coefficients; inf welds")
    p.add_argument("--elements", type=int, help="elements a side (default 10, --fast 4)")
    p.add_argument("--quadrature", choices=[q.value for q in Quadrature], default=Quadrature.RADON7.value)
    p.add_argument("--increments", type=int, help="uniform increments after the start-up (default 45, --fast 6)")
    p.add_argument("--form", choices=[f.value for f in FormName], default=FormName.TANGENT.value)
    p.add_argument("--backend", choices=[b.value for b in Backend], default=Backend.CVXPY.value)
    p.add_argument("--configuration", choices=[c.value for c in Configuration], default=Configuration.MIDPOINT.value)
    p.add_argument("--reduction", type=float, default=0.45, help="reduction in height, in (0, 1)")
    p.add_argument("--hardening", default="perfect:300", help="perfect:S, linear:S,H, voce:S,Q,b[,H], table:p/S,...")
    p.add_argument("--kn", type=float, help="normal penalty of penalty and uzawa, N/mm per node (default about E/h)")
    p.add_argument("--kt", type=float, help="tangential penalty, N/mm per node (default about E/h)")
    p.add_argument("--fclib", action="store_true", help="write every increment's contact problem as an FCLIB file")
    p.add_argument("--out", type=Path, default=Path("results/upsetting"))
    p.add_argument("--fast", action="store_true", help="a small mesh and few increments")
    return p


def cases(arguments: argparse.Namespace) -> list[Case]:
    """One case a coefficient."""
    chosen = FAST if arguments.fast else DEFAULT
    elements = chosen["elements"] if arguments.elements is None else arguments.elements
    increments = chosen["increments"] if arguments.increments is None else arguments.increments
    return [
        Case(
            mu,
            elements,
            Quadrature(arguments.quadrature),
            increments,
            FormName(arguments.form),
            Backend(arguments.backend),
            Configuration(arguments.configuration),
            arguments.reduction,
            arguments.hardening,
            arguments.kn,
            arguments.kt,
        )
        for mu in arguments.mu
    ]


TABLE = "{:>6} {:>10} {:>10} {:>10} {:>9} {:>6} {:>6} {:>5} {:>9} {:>9} {:>9} {:>8}"
HEADER = (
    *("mu", "reduction", "force_N", "R_max_mm", "volume", "incr", "passes", "cuts"),
    *("equil.", "cone", "gap", "seconds"),
)


def summary(case: Case, history: History, seconds: float) -> str:
    """A line of the table, from the run's own history."""
    return TABLE.format(
        f"{case.mu:g}",
        f"{history['reduction'][-1]:.4f}",
        f"{history['force_N'][-1]:.2f}",
        f"{history['max_radius_mm'][-1]:.5f}",
        f"{history['volume_ratio'][-1]:.6f}",
        len(history),
        history["passes"].sum(),
        history["cuts"].sum(),
        *(f"{history[name].max():.1e}" for name in ("equilibrium", "cone_violation", "relative_gap")),
        f"{seconds:.1f}",
    )


def main(argv: list[str] | None = None) -> int:
    """Run all cases and print one table; exit code 2 on refused input or a failed increment."""
    arguments = parser().parse_args(argv)
    lines: list[str] = []
    try:
        lines.extend(
            planned.run() for planned in [Planned.of(case, arguments.out, arguments.fclib) for case in cases(arguments)]
        )
    except BipotError as error:
        print(f"error: {error}", file=sys.stderr)
        code = 2
    except KeyboardInterrupt:
        print("stopped; what was computed is on disk", file=sys.stderr)
        code = 130
    else:
        code = 0
    if lines:
        print("\n".join([TABLE.format(*HEADER), *lines]))
        print("equil., cone, gap: worst equilibrium, cone violation and relative bipotential gap of the run")
        print(f"results in {arguments.out.resolve()}")
    return code


if __name__ == "__main__":
    sys.exit(main())
