"""The contact problems of an upsetting run for other codes: an FCLIB file an increment, in ``fclib`` beside the run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from bipot.control.accepted import Accepted
from bipot.errors import ResultsError
from bipot.exchange import export_fclib
from bipot.results import Existing
from bipot.results import open as open_results
from bipot.results.folder import RUN
from studies.files import sentence

FOLDER = "fclib"
NAMED = re.compile(r"increment_(\d{4,})\.hdf5")
CHOICE = "--overwrite starts afresh, another --out leaves it"


@dataclass(frozen=True)
class Problems:
    """Those of the run in ``run``, which are written where they are ``asked`` for."""

    run: Path
    asked: bool

    @property
    def files(self) -> Mapping[int, Path]:
        """The files that this study wrote, by the numbers of their increments."""
        with sentence(self._folder, "read"):
            there = sorted(self._folder.iterdir()) if self._folder.is_dir() else []
        found = ((NAMED.fullmatch(path.name), path) for path in there)
        return {int(name[1]): path for name, path in found if name is not None}

    def require_whole(self, existing: Existing) -> None:
        """Refuse problems that would not be those of all increments of one run.

        Raises:
            ResultsError: the run that is resumed was recorded without them; they are there and their run is not.
        """
        if existing is Existing.OVERWRITE:
            return
        begun, held = (self.run / RUN).is_file(), self.files
        if held and not begun:
            raise ResultsError(f"{self._folder}: holds contact problems of a run that is not there; {CHOICE}")
        if not (self.asked and begun):
            return
        recorded = open_results(self.run).end.number
        lacking = [number for number in range(1, recorded + 1) if number not in held]
        if lacking:
            without = f"{len(lacking)} of its {recorded} increments were recorded without --fclib, first {lacking[0]}"
            raise ResultsError(f"{self.run}: {without}, and cannot be written now; resume without it, or {CHOICE}")

    def cut_back(self, recorded: int) -> None:
        """Remove those of increments that the run has not recorded: they are another's, or will be written again.

        Raises:
            ResultsError: one cannot be removed.
        """
        for number, path in self.files.items():
            if number > recorded:
                with sentence(path, "removed"):
                    path.unlink(missing_ok=True)
        with sentence(self._folder, "removed"):
            if self._folder.is_dir() and not any(self._folder.iterdir()):
                self._folder.rmdir()

    def write(self, accepted: Accepted) -> None:
        """Write the increment's, if they are asked for."""
        if self.asked:
            self._folder.mkdir(exist_ok=True)
            export_fclib(self._folder / f"increment_{accepted.number:04d}.hdf5", accepted)

    @property
    def _folder(self) -> Path:
        return self.run / FOLDER
