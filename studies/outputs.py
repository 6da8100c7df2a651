"""What becomes of results that a folder already holds, and a study's table that grows there row by row.

Beside ``NAME.csv`` lies ``NAME.parameters.json``: what its rows do not tell and yet depend on. Both are there whole at
any moment, so that a run which was killed, or whose disk was full, is gone on with by ``--resume``.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

from bipot.errors import ResultsError
from bipot.results import Existing
from studies.files import replacing, require_writable, sentence
from studies.stopping import checkpoint
from studies.tables import LARGEST, read_rows, text, write_csv, write_hdf5

Row = TypeVar("Row")
Curves = dict[str, dict[str, Any]]
Stat = tuple[int, int, int] | None
"""By which one sees that a file was written: None where there is none."""


CHOICES = "--resume goes on with them, --overwrite starts afresh"


def parser_of(
    name: str,
    about: str,
    fast: str | None = None,
    out: Path | None = None,
    policy: Existing = Existing.REFUSE,
) -> argparse.ArgumentParser:
    """The command line of ``studies.NAME``, ``about`` in one line: ``--out`` (default ``results/NAME``) and its policy.

    With ``--fast``, if it says what that leaves of the study.
    """
    parser = argparse.ArgumentParser(prog=f"studies.{name}", description=about, allow_abbrev=False)
    where = out or Path("results", name.replace(".", "_"))
    parser.add_argument("--out", type=Path, default=where, help="folder of the results (default %(default)s)")
    if fast is not None:
        parser.add_argument("--fast", action="store_true", help=fast)
    add_options(parser, policy)
    return parser


def add_options(parser: argparse.ArgumentParser, default: Existing = Existing.REFUSE) -> None:
    """``--resume`` and ``--overwrite``, of which one can be given; the parsed ``policy`` is a :class:`Existing`."""
    either = parser.add_mutually_exclusive_group()
    for policy, told in (
        (Existing.RESUME, "keep what is finished in the folder and run what is missing"),
        (Existing.OVERWRITE, "start afresh, whatever the folder holds"),
    ):
        option = f"--{policy.value}"
        either.add_argument(option, dest="policy", action="store_const", const=policy, default=default, help=told)


@dataclass
class Table(Generic[Row]):
    """Rows kept on disk as they come, told apart by a key; made by :func:`opened`.

    ``curves`` are arrays by name that rows come with, kept in ``NAME.h5`` of a study that has them.
    """

    folder: Path
    name: str
    key: Callable[[Row], Hashable]
    parameters: Mapping[str, Any]
    order: Mapping[Hashable, int]
    files: Sequence[Path]
    with_curves: bool
    curves: Curves = field(default_factory=dict)
    _rows: dict[Hashable, Row] = field(default_factory=dict)
    _begun: bool = False
    _seen: Stat = None

    @property
    def rows(self) -> list[Row]:
        """In the order of the study; kept ones that this run did not ask for come last."""
        return sorted(self._rows.values(), key=lambda row: self.order.get(self.key(row), len(self.order)))

    def __contains__(self, key: Hashable) -> bool:
        return key in self._rows

    def __getitem__(self, key: Hashable) -> Row:
        return self._rows[key]

    def add(self, *rows: Row, curves: Curves | None = None) -> None:
        """Put rows into the table, or in the place of those with the same key, and the table on disk.

        Raises:
            ResultsError: it cannot be written, or another process has written it.
            KeyboardInterrupt: the study has been stopped, and what was computed meanwhile may be its work.
        """
        checkpoint()
        path = self.folder / f"{self.name}.csv"
        if _stat(path) != self._seen:
            raise ResultsError(f"{path}: is written by another process, too; wait for its end and --resume")
        self._rows |= {self.key(row): row for row in rows}
        self.curves |= curves or {}
        self._begin()
        # A row on disk has its curve there: the curves go first.
        if self.with_curves:
            write_hdf5(self.folder / f"{self.name}.h5", self.rows, self.curves)
        write_csv(path, self.rows)
        self._seen = _stat(path)

    def words(self, names: Sequence[str] | None = None) -> str:
        """The rows, all columns or those of these names, and where they are."""
        rows = self.rows
        shown = text(rows, names or [column.name for column in fields(cast(Any, rows[0]))]) + "\n" if rows else ""
        return f"{shown}results in {self.folder.resolve()}"

    def _begin(self) -> None:
        """With the first row what was there goes, and the parameters are said before there is a table of them."""
        if self._begun:
            return
        with sentence(self.folder, "written"):
            for path in self.files:
                path.unlink(missing_ok=True)
        with replacing(_sidecar(self.folder, self.name)) as part:
            part.write_text(json.dumps(self.parameters, indent=1), encoding="utf-8")
        self._begun = True


def opened(
    folder: Path,
    name: str,
    kind: type[Row],
    key: Callable[[Row], Hashable],
    policy: Existing,
    *,
    parameters: Mapping[str, Any],
    order: Iterable[Hashable] = (),
    curve: Callable[[Row], str] | None = None,
    derived: Sequence[str] = (),
) -> Table[Row]:
    """The table ``name`` of a folder that can be written, with the rows to keep.

    ``parameters`` is what rows depend on and do not tell. ``order`` are the keys that will be asked for; ``curve``
    names the arrays that come with a row; ``derived`` are further files that are made from the rows. Nothing that is
    there is touched before the first row is added.

    Raises:
        ResultsError: there are results and ``policy`` is ASK; they are of other parameters or columns; they cannot be
            read, or the folder not be written.
    """
    asked = json.loads(json.dumps(parameters, default=_plain))
    rank = {key: number for number, key in enumerate(dict.fromkeys(order))}
    files = [folder / file for file in (f"{name}.csv", f"{name}.h5", *derived)]
    table = Table(folder, name, key, asked, rank, files, curve is not None)
    with sentence(folder, "read"):
        table._seen = _stat(files[0])
        there = [path for path in files if path.exists()]
    if there and policy is Existing.REFUSE:
        raise ResultsError(f"{folder}: holds results of this study ({there[0].name}); {CHOICES}")
    if files[0] in there and policy is Existing.RESUME:
        _require_same(folder, name, asked, kind)
        table._rows, table.curves, table._begun = *_kept(folder, name, kind, key, curve), True
    require_writable(folder)
    return table


def _stat(path: Path) -> Stat:
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns


def _sidecar(folder: Path, name: str) -> Path:
    return folder / f"{name}.parameters.json"


def exact(value: float) -> float | None:
    """A number as part of a key: None for NaN, which is not equal to itself."""
    return None if math.isnan(value) else value


def _plain(value: Any) -> Any:
    """A member of an enumeration by its value."""
    if isinstance(value, Enum):
        return value.value
    raise TypeError(f"{value!r} is no parameter of a table")


def _require_same(folder: Path, name: str, asked: Mapping[str, Any], kind: type[Any]) -> None:
    """Refuse to go on with a table of other columns or parameters."""
    sidecar, path = _sidecar(folder, name), folder / f"{name}.csv"
    afresh = "--overwrite starts afresh, another --out leaves it"
    if not sidecar.exists():
        raise ResultsError(f"{path}: of unknown parameters, for {sidecar.name} is missing; {afresh}")
    with readable(sidecar):
        stored = json.loads(sidecar.read_text(encoding="utf-8"))
        stored.keys()
    for parameter in sorted(stored.keys() | asked.keys()):
        held, new = (json.dumps(given.get(parameter, "absent")) for given in (stored, asked))
        if held != new:
            raise ResultsError(f"{path}: holds results with {parameter} = {held}, not {new}; {afresh}")
    with readable(path), path.open(newline="", encoding="utf-8") as file:
        columns = next(csv.reader(file), None)
    if columns not in (None, [f.name for f in fields(kind)]):
        raise ResultsError(f"{path}: has other columns than this study writes; {afresh}")


def _kept(
    folder: Path, name: str, kind: type[Row], key: Callable[[Row], Hashable], curve: Callable[[Row], str] | None
) -> tuple[dict[Hashable, Row], Curves]:
    """Rows that are finished, by their keys, and their curves."""
    path = folder / f"{name}.csv"
    with readable(path):
        rows = [_with_bools(row, path) for row in read_rows(path, kind)]
    keys = Counter(key(row) for row in rows)
    if twice := [row for row, times in keys.items() if times > 1]:
        raise ResultsError(f"{path}: has two rows of {twice[0]}; --overwrite starts afresh")
    if curve is None:
        return {key(row): row for row in rows}, {}
    curves = read_curves(folder / f"{name}.h5")
    names = {key(row): curve(row) for row in rows}
    kept = {key(row): row for row in rows if names[key(row)] in curves}
    return kept, {names[row]: curves[names[row]] for row in kept}


def _with_bools(row: Row, path: Path) -> Row:
    """A row whose truth values were read as words."""
    words: Any = {f.name: getattr(row, f.name) for f in fields(row) if f.type in (bool, "bool")}  # type: ignore[arg-type]
    for name, word in words.items():
        if word not in _TRUTH:
            raise ResultsError(f"{path}: {name} = {word:.40}: must be one of {', '.join(_TRUTH)}")
    return replace(row, **{name: _TRUTH[word] for name, word in words.items()})  # type: ignore[type-var]


_TRUTH = {str(truth): truth for truth in (True, False)}


def read_curves(path: Path, only: Collection[str] | None = None) -> Curves:
    """The arrays that :func:`studies.tables.write_hdf5` put under ``curves``, all or ``only`` those of these names.

    None where there is no file.

    Raises:
        ResultsError: the file cannot be read as one of those.
    """
    from bipot.hdf5.checked import opened

    if not path.exists():
        return {}
    with readable(path), opened(path, ResultsError, LARGEST) as file:
        groups = file.group("curves") if "curves" in file else None
        names = groups.names() if groups else []
        return {name: _arrays(groups.group(name)) for name in names if only is None or name in only} if groups else {}


def _arrays(group: Any) -> dict[str, Any]:
    return {name: group.array(name, "f", group.shape(name), finite=False) for name in group.names()}


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """What is wrong with a file is said as a :class:`ResultsError` that names it."""
    try:
        yield
    except ResultsError:
        raise
    except (OSError, ValueError, TypeError, LookupError, AttributeError, RuntimeError, csv.Error) as error:
        raise ResultsError(f"{path}: cannot be read ({error}); --overwrite starts afresh") from error
