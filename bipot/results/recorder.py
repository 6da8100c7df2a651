"""Writing a run: ``run.vtkhdf`` step by step, and its table beside it as ``history.csv``."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from bipot.basics.replacing import replace
from bipot.basics.undisturbed import undisturbed
from bipot.certificate import Bounds
from bipot.control.accepted import Accepted
from bipot.control.course import Course
from bipot.control.starting import course_of
from bipot.errors import IncrementFailed, ResultsError, require, require_tuple, require_type
from bipot.hdf5.journal import creating, writing
from bipot.results import table
from bipot.results.columns import ENERGY_ERROR, Column
from bipot.results.description import Parameters, require_told, same_scene, same_state
from bipot.results.existing import CHOICE, Asked, Existing, known
from bipot.results.fields import StoredStep
from bipot.results.folder import CSV, RUN, TOOLS, settled
from bipot.results.history import History
from bipot.results.history import open as open_results
from bipot.results.lock import locked
from bipot.results.names import require_units
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.system import system_of
from bipot.typing import require_within

if TYPE_CHECKING:
    from bipot.results.vtkhdf import RunFile

PATIENCE = 0.25
"""Seconds for which increments wait to be written together: a write takes as long as solving a small increment."""


class Recorder:
    """Writes every accepted increment of one run into ``folder``, as a context manager.

    ``parameters`` (JSON values) identify the run; schedule and control of its march do so if they are among them, as
    their ``repr``, and may otherwise be others when it is resumed. ``units`` of length, force, stress or energy, as
    {"length": "mm"}, are stored as given; those of contact forces of plane strain are per unit of thickness. Every
    history has the column ``energy_error``: if ``columns`` lacks it, it comes last. A relative ``folder`` belongs to
    the working directory in which the recorder is made. The march must begin at :attr:`start`: the end of the recorded
    run if it is resumed, else the given ``start``, by default at rest. With ``Existing.RESUME`` a folder without a run
    gets a new one.

        with Recorder(folder, scene, columns, parameters, units, existing=Existing.RESUME) as recorder:
            for accepted in march(scene, schedule, control, recorder.start):
                recorder.record(accepted)

    An :class:`IncrementFailed` that leaves the block gets the :class:`History` so far attached.

    Raises:
        ResultsError: the folder holds a run and ``existing`` refuses it, or a run of other parameters, units, columns
            or scene (names the field) or of another start than a given one, or another process writes there, or it
            cannot be written.
        SceneError: two columns of one name, a wrong type, parameters or units that are no JSON, a unit of another
            quantity, a start of another scene, an object of the user's own classes with a repr of only its address.
    """

    def __init__(
        self,
        folder: str | Path,
        scene: Scene,
        columns: Sequence[Column],
        parameters: Parameters,
        units: Mapping[str, str],
        *,
        existing: Existing = Existing.REFUSE,
        start: State | Course | None = None,
        patience: float = PATIENCE,
    ) -> None:
        require_type(scene, Scene, "scene")
        columns = require_tuple(columns, Column, "columns")
        names = [column.name for column in columns]
        require(len(set(names)) == len(names), "columns", names, "of different names")
        require_type(existing, Existing, "existing")
        missing = () if ENERGY_ERROR.name in names else (ENERGY_ERROR,)
        require(isinstance(folder, str | Path) and "\0" not in str(folder), "folder", folder, "a path")
        require_told(scene, parameters=parameters, units=units)
        require_units(units)
        self.folder, self.columns = settled(folder), (*columns, *missing)
        self.parameters, self.units = parameters, units
        self.system, self.existing = system_of(scene), existing
        require_within(patience, "patience", "finite and >= 0")
        self.note, self.patience = "", patience
        self._course = course_of(start, self.system, Bounds().equilibrium)
        begun = None if start is None else self._course.state
        self._asked = Asked(scene, parameters, units, tuple(column.name for column in self.columns), begun)
        self._committed, self._lines, self._since = self._course, list[str](), time.monotonic()
        self._file: RunFile
        self._opened: ExitStack | None = None
        known(self.folder, self.existing, self._asked)

    @property
    def start(self) -> Course:
        """The course after the last recorded increment, which may still wait to be written to disk."""
        return self._course

    @property
    def on_disk(self) -> int:
        """Number of the last increment that is on disk."""
        return self._committed.number

    def __enter__(self) -> Self:
        # HDF5 calls back for every byte: an exception of Ctrl-C there can end the interpreter.
        with ExitStack() as opened:
            with undisturbed(), self._written("nothing is recorded"):
                self.folder.mkdir(parents=True, exist_ok=True)
                opened.enter_context(locked(self.folder))
                found = known(self.folder, self.existing, self._asked)
                self._begin(opened) if found is None else self._go_on(opened, found)
                self._committed, self._since = self._course, time.monotonic()
                # If the recorder is entered again, this run is its own.
                self.existing = Existing.RESUME
            self._opened = opened.pop_all()
        return self

    def record(self, accepted: Accepted) -> None:
        """Append one accepted increment to both files.

        Raises:
            ResultsError: it is of another scene, does not continue the last one, or it and the waiting ones cannot be
                written; what is on disk is readable.
            SceneError: no increment, or a column's value is neither a number nor a string.
        """
        require_type(accepted, Accepted, "accepted")
        if self._opened is None:
            raise ResultsError(f"{self.folder}: is not open for writing: record inside the block of the recorder")
        self._require_next(accepted)
        values = [column.value(self.system, accepted) for column in self.columns]
        for column, value in zip(self.columns, values, strict=True):
            table.require_value(value, column.name)
        line = table.line(values)
        with undisturbed():
            with self._written(self._so_far):
                self._file.append(StoredStep.after(accepted), line)
            # The increment counts as recorded from here on, so that it cannot be recorded twice.
            self._course = accepted.course
            self._lines.append(line)
            if time.monotonic() - self._since >= self.patience:
                self._commit()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        opened, self._opened = self._opened or ExitStack(), None
        with undisturbed(), opened, suppress(*(ResultsError,) * (error is not None)):
            self._commit()
        if isinstance(error, IncrementFailed):
            with suppress(ResultsError):
                error.history = open_results(self.folder)
        # An error that ended the block is raised, not that tools could not be written.
        with suppress(*(ResultsError,) * (error is not None)), undisturbed():
            open_results(self.folder).write_tools()

    def _begin(self, opened: ExitStack) -> None:
        """Write step 0 of a new run, which replaces any other."""
        from bipot.results.vtkhdf import RunFile

        file = opened.enter_context(creating(self.folder / RUN))
        (self.folder / TOOLS).unlink(missing_ok=True)
        self._file = opened.enter_context(closing(RunFile.create(file, self.system, self.parameters, self.units)))
        self._file.append(StoredStep.at_start(self.system, self._course), self._header)
        self._file.commit()
        replace(self._csv, self._header.encode(), ResultsError)

    def _require_next(self, accepted: Accepted) -> None:
        """Refuse an increment that is not the next of this run."""
        last, scene = self._course, accepted.solved.iterate.increment.system.body.scene
        if not same_scene(scene, self.system.body.scene):
            raise ResultsError(f"{self.folder}: increment {accepted.number} is of another scene: march the recorder's")
        if accepted.number != last.number + 1 or not same_state(accepted.start, last.state):
            raise ResultsError(
                f"{self.folder}: increment {accepted.number} from tau = {accepted.start.tau!r} does not go on from "
                f"increment {last.number} at tau = {last.state.tau!r}: march from recorder.start, and give the "
                "recorder a start other than rest"
            )

    def _commit(self) -> None:
        """Write waiting increments to disk; if that fails, the run is that of the last commit."""
        if not self._lines:
            return
        lines, self._lines = "".join(self._lines), []
        wanted, self._course = self._course, self._committed
        with self._written(self._so_far):
            self._file.commit()
        self._course = self._committed = wanted
        with self._written(self._so_far):
            self._copy(lines)
        self._since = time.monotonic()

    @property
    def _so_far(self) -> str:
        return f"increments up to {self.on_disk} are recorded; make room and resume"

    def _copy(self, lines: str) -> None:
        """Append lines to ``history.csv``."""
        try:
            _add(self._csv, lines)
        except OSError:
            # A further line would follow a gap; resuming writes the whole table anew.
            self._file.end()
            raise

    def _go_on(self, opened: ExitStack, found: History) -> None:
        """Open the run for more steps, and write its table anew from the file."""
        from bipot.results.vtkhdf import RunFile

        self._course, self.note = found.end, found.note
        file = opened.enter_context(writing(self.folder / RUN))
        try:
            self._file = opened.enter_context(closing(RunFile.reopen(file, self.system)))
        except (KeyError, RuntimeError, TypeError, ValueError) as error:
            raise ResultsError(f"{file.path}: cannot be gone on with ({error}); {CHOICE}") from error
        if self._file.cut_back():
            self.note = f"what was written after increment {self._course.number} was not complete and is left out"
        replace(self._csv, found.text.encode(), ResultsError)

    @property
    def _header(self) -> str:
        return table.line(self._asked.columns)

    @property
    def _csv(self) -> Path:
        return self.folder / CSV

    @contextmanager
    def _written(self, so_far: str) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise ResultsError(f"{self.folder}: cannot be written ({error}); {so_far}") from error


def _add(path: Path, lines: str) -> None:
    """Append all lines or, if that fails, none."""
    with path.open("ab") as file:
        end = file.tell()
        try:
            file.write(lines.encode())
            file.flush()
        except OSError:
            file.truncate(end)
            raise
