"""The contents of a run file, decoded and checked: nothing in it is trusted."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bipot.control.course import Course
from bipot.energy import Energies
from bipot.errors import ResultsError, SceneError
from bipot.forms.memory import Paced
from bipot.hdf5.journal import journal_of, reading
from bipot.laws.flow import Flow
from bipot.meshes.mesh import Mesh
from bipot.results.fields import NO_CANDIDATE, rising
from bipot.results.names import FIELDS, FIXED, GROUPS, Place
from bipot.results.static import FORMAT, Line, Lines
from bipot.state import State
from bipot.tensors import components
from bipot.tools.poses import pose_size
from bipot.typing import Floats, Ints

if TYPE_CHECKING:
    from bipot.hdf5.checked import Checked

TRIES, PAUSE = 50, 0.02
"""How often a file that is being written is read again, and the seconds between."""

T = TypeVar("T")


def read(file: Path, what: Callable[[Run], T]) -> T:
    """The contents of a file as of one commit of its writer.

    Raises:
        ResultsError: it cannot be read, or its contents are not those of a run; the message names file, field and
            value.
    """
    from bipot.hdf5.checked import opened

    for _ in range(TRIES):
        before, failure = _seen(file), None
        try:
            with reading(file) as bytes_, opened(bytes_, ResultsError) as root:
                found = what(Run(root))
        except OSError as error:
            failure = ResultsError(f"{file}: cannot be read ({error})")
        except ResultsError as error:
            failure = error
        if _seen(file) == before:
            if failure is not None:
                raise failure
            return found  # type: ignore[possibly-undefined]
        time.sleep(PAUSE)
    raise ResultsError(f"{file}: is written faster than it can be read")


def _seen(file: Path) -> tuple[object, ...]:
    """What the system says of a file that every commit changes."""
    try:
        status = file.stat()
    except OSError:
        return ()
    return status.st_ino, status.st_size, status.st_mtime_ns, journal_of(file).exists()


@dataclass(frozen=True)
class RunReader:
    """Reads a ``file`` as long as it holds the run whose history begins with the ``text``."""

    file: Path
    text: str = field(repr=False)

    def __call__(self, what: Callable[[Run], T]) -> T:
        """See :func:`read`; raises ResultsError also if the file holds another run."""

        def checked(run: Run) -> T:
            if not run.history().startswith(self.text):
                raise ResultsError(f"{self.file}: holds another run than when it was opened: open it again")
            return what(run)

        return read(self.file, checked)


@dataclass(frozen=True)
class Run:
    """The contents of an open run file, from its ``root``."""

    root: Checked

    @property
    def count(self) -> int:
        """Steps that are complete, step 0 included."""
        count = self.root.group("VTKHDF/Steps").attribute("NSteps")
        self.root.require(count >= 1, "VTKHDF/Steps: NSteps", count, "1 at least: step 0 is where the march starts")
        return count

    def about(self) -> Mapping[str, Any]:
        """Parameters, units, the scene in words, names of boundaries and of regions; of a file of this layout only."""
        version = self.root.group("bipot").attribute("format")
        self.root.require(version == FORMAT, "bipot: format", version, f"{FORMAT}: another version wrote it; run again")
        try:
            about = json.loads(self.root.group("bipot").text("about"))
        except (ValueError, RecursionError) as error:
            raise ResultsError(f"{self.root.source.path}: /bipot/about = {error}: must be JSON") from error
        kinds = {"parameters": dict, "units": dict, "scene": dict, "boundaries": list, "regions": list}
        for name, kind in kinds.items():
            right = isinstance(about, dict) and isinstance(about.get(name), kind)
            self.root.require(right, f"bipot/about: {name}", "missing or of another type", f"a {kind.__name__}")
        for name in ("boundaries", "regions"):
            right = all(isinstance(one, str) for one in about[name])
            self.root.require(right, f"bipot/about: {name}", about[name], "a list of names")
        return about

    def history(self) -> str:
        """The text of ``history.csv``: one line for each step, that of step 0 being the header."""
        group = self.root.group("bipot")
        ends = group.rows("history_ends", "i", 0, self.count, ())
        self.root.require(bool((np.diff(ends, prepend=0) > 0).all()), "bipot/history_ends", ends.tolist(), "increasing")
        letters = group.rows("history", "u", 0, int(ends[-1]), ())
        try:
            return letters.astype(np.uint8).tobytes().decode()
        except ValueError as error:
            raise ResultsError(f"{self.root.source.path}: /bipot/history = {error}: must be UTF-8") from error

    def times(self) -> NDArray[np.float64]:
        """Pseudo-times (steps,)."""
        times = self.root.group("VTKHDF/Steps").rows("Values", "f", 0, self.count, ())
        increasing = times[0] >= 0 and times[-1] <= 1 and bool((np.diff(times) > 0).all())
        self.root.require(increasing, "VTKHDF/Steps/Values", times, "increasing in [0, 1]")
        return times

    def mesh(self) -> Mesh:
        """The mesh at rest."""
        group = self.root.group("bipot/mesh")
        about = self.about()
        edges = {name: group.array(f"boundaries/{k}", "i", (None, None)) for k, name in enumerate(about["boundaries"])}
        regions = {name: group.array(f"regions/{k}", "i", (None,)) for k, name in enumerate(about["regions"])}
        nodes = group.array("nodes", "f", (None, self._dimension))
        elements = group.array("elements", "i", (None, None))
        return self._made("bipot/mesh", lambda: Mesh(nodes, elements, edges, regions))

    @property
    def _dimension(self) -> int:
        """3 if nodes have three coordinates, else 2: the check of their shape then refuses any other number."""
        return 3 if self.root.group("bipot/mesh").shape("nodes")[1:] == (3,) else 2

    def nodes(self, step: int) -> Floats:
        """Positions (a, d) of the nodes in a step."""
        points = self.root.group("bipot/mesh").length("nodes")
        return self.root.group("VTKHDF").rows("Points", "f", step * points, (step + 1) * points, (3,))[
            :, : self._dimension
        ]

    def field(self, place: Place, name: str, step: int) -> NDArray[Any]:
        """A field of the nodes or of the elements in a step."""
        group = self.root.group(f"VTKHDF/{GROUPS[place]}")
        if name in FIXED[place]:
            missing = f"VTKHDF/{GROUPS[place]}/{name}"
            self.root.require(name in group, missing, "missing", "of a run on a mesh with regions")
            return group.array(name, FIXED[place][name].kind, (self.root.group("bipot/mesh").length("elements"),))
        known = FIELDS[place][name]
        rows = self.root.group("bipot/mesh").length("nodes" if place is Place.NODES else "elements")
        return group.rows(name, known.kind, step * rows, (step + 1) * rows, known.shape, finite=known.finite)

    def touched(self, step: int) -> Ints:
        """The number (a,) of the tool of which each node has gap, traction and status in a step, -1 of none."""
        group, steps = self.root.group("bipot/candidates"), self.root.group("bipot/steps")
        points = self.root.group("bipot/mesh").length("nodes")
        node = group.array("node", "i", (None,), least=0, most=points - 1)
        tool = group.array("tool", "i", node.shape, least=0)
        gap, forces = (
            steps.rows(name, "f", step, step + 1, (len(node), *rest))[0]
            for name, rest in (("gap", ()), ("contact_force", (self._dimension,)))
        )
        order, out = rising(gap, forces), np.full(points, NO_CANDIDATE)
        out[node[order]] = tool[order]
        return out

    def tools(self, first: int, last: int) -> list[list[Line]]:
        """The lines of the tools in the steps from ``first`` up to and without ``last``."""
        group, d = self.root.group("bipot/tools"), self._dimension
        centres, points = group.array("centres", "f", (None, d)), group.array("points", "f", (None, d))
        tool = group.array("tool", "i", (None,), least=0, most=len(centres) - 1)
        starts = group.array("starts", "i", (len(tool) + 1,), least=0, most=len(points))
        self.root.require(bool((np.diff(starts) >= 0).all()), "bipot/tools/starts", starts.tolist(), "not decreasing")
        lines = Lines(points, starts, tool, centres)
        poses = self.root.group("bipot/steps").rows("pose", "f", first, last, (len(centres), pose_size(d)))
        return [lines.at(pose) for pose in poses]

    def course(self, step: int) -> Course:
        """The course of the march after a step."""
        group = self.root.group("bipot/steps")

        def one(name: str, shape: tuple[int | None, ...] = (), kind: str = "f", *, finite: bool = True) -> Any:
            return group.rows(name, kind, step, step + 1, shape, finite=finite)[0]

        state = self._state(step, one)
        times = one("before_times", (2, 2), finite=False)
        velocities = one("before_velocity", (2, state.nodes.size + len(state.translation)))
        forces = one("before_forces", (2, *state.forces.shape))
        seen = zip(times.tolist(), velocities, forces, strict=True)
        later, earlier = (Paced(tau, middle, v, r) for (tau, middle), v, r in seen)
        return self._made(
            f"step {step}",
            lambda: Course(
                state=state,
                number=int(one("number", kind="i")),
                energies=Energies(*one("energies", (4,)).tolist()),
                largest=float(one("largest")),
                size=float(one("size", finite=False)),
                uncut=float(one("uncut", finite=False)),
                landed=one("landed", state.gap.shape, "u").astype(np.bool_),
                before=(later, earlier),
                proposed=float(one("proposed", finite=False)),
            ),
        )

    def _state(self, step: int, one: Callable[..., Any]) -> State:
        """The state after a step; ``one`` reads one of the step's arrays by name, shape and kind."""
        mesh, d = self.root.group("bipot/mesh"), self._dimension
        contacts = self.root.group("bipot/candidates").length("node")
        stress = one("stress", (mesh.length("elements"), None, components(d)))
        at_points = stress.shape[:2]
        translation = one("translation", (None,))
        flow = Flow(one("flow_strain", stress.shape), one("flow_peeq", at_points))
        return self._made(
            f"step {step}",
            lambda: State(
                tau=float(self.times()[step]),
                nodes=self.nodes(step),
                stress=stress,
                plastic_strain=one("plastic_strain", stress.shape),
                peeq=one("peeq", at_points),
                forces=one("contact_force", (contacts, d)),
                gap=one("gap", (contacts,)),
                du=one("du", (mesh.length("nodes"), d)),
                translation=translation,
                translated=one("translated", translation.shape),
                length=float(one("length")),
                flow=flow if one("flows", kind="u") else None,
            ),
        )

    def _made(self, field: str, make: Callable[[], T]) -> T:
        """The value that ``make`` returns, unless its own checks refuse what the file holds."""
        try:
            return make()
        except SceneError as error:
            raise ResultsError(f"{self.root.source.path}: {field}: {error}") from error
