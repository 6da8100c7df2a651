"""The command ``bipot``: a summary of a run, and pictures of it. Only this module of the library prints.

bipot --version
bipot info RUN
bipot picture RUN [--field mises | --traction TOOL] [--at VALUE] [--by COLUMN] [--out FILE]
"""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Iterator, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from bipot import plot
from bipot.basics.replacing import replace
from bipot.errors import BipotError, ResultsError, SceneError
from bipot.plot.animation import GIF
from bipot.results import History
from bipot.results import open as open_results
from bipot.results.folder import RUN
from bipot.results.history import in_digits

REFUSED = 2
"""Exit code where something is refused, as argparse has it."""

FIELD = "mises"
DPI = 150


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns 0, or 2 with one sentence on stderr where something is refused.

    If the reader of its output has closed the pipe, the rest is discarded.
    """
    try:
        try:
            return _run(argv)
        finally:
            # A help is printed by a parser that ends the program.
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _run(argv: Sequence[str] | None) -> int:
    asked = _parser().parse_args(argv)
    try:
        words = asked.run_command(asked)
    except (BipotError, OSError) as error:
        # One line, whatever a name in it holds.
        print("error: " + " ".join(str(error).split()), file=sys.stderr)
        return REFUSED
    encoding = sys.stdout.encoding or "utf-8"
    # In the letters that the terminal knows.
    print(words.encode(encoding, "backslashreplace").decode(encoding))
    return 0


def info(result: History) -> str:
    """Summary of a run: its progress, parameters, columns with their last values, and fields with units."""
    # A line each, whatever names and values hold.
    return "\n".join(line.replace("\r", "\\r").replace("\n", "\\n") for line in _lines(result))


def add_picture_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of :func:`picture`."""
    parser.add_argument("run", type=Path, metavar="RUN", help=f"a folder that holds {RUN}, or that file")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--field", default=FIELD, help=f"nodal field or component, as stress_zz (default {FIELD})")
    what.add_argument(
        "--traction", type=int, metavar="TOOL", help="contact traction of the tool of that number, from 0"
    )
    parser.add_argument("--at", type=float, help="reduction, or tau where a run has none (default the last increment)")
    parser.add_argument("--by", help="column whose value --at is, or tau; with --at only")
    parser.add_argument("--out", type=Path, help="file; its ending says the format, .gif animates the field")


def picture(asked: argparse.Namespace) -> Path:
    """Draw the picture chosen by the options of :func:`add_picture_options`; returns the file.

    Raises:
        SceneError: a field, a value, a tool or a format that does not exist.
        ResultsError: no run, a file that cannot be written, matplotlib is missing.
    """
    if find_spec("matplotlib") is None:
        raise ResultsError("a picture needs matplotlib: pip install bipot[studies]")
    result = found_run(asked.run)
    path = asked.out or result.folder / f"{_name(asked)}.png"
    if path.suffix.lower() == GIF:
        if asked.traction is not None or asked.at is not None or asked.by is not None:
            raise SceneError(f"--out = {path}: must not end in {GIF} with --traction, --at or --by: it shows all steps")
        return plot.animate(result, asked.field, path)
    if asked.by is not None and asked.at is None:
        raise SceneError(f"--by = {asked.by!r}: must be left out without --at, whose column it is")
    replace(path, _drawn(result, asked, path), ResultsError)
    return path


def _name(asked: argparse.Namespace) -> str:
    """File name of a picture without ``--out``; different pictures have different names."""
    words = [asked.field if asked.traction is None else f"traction_{asked.traction}"]
    if asked.by is not None:
        words.append(asked.by.replace("/", "_"))
    if asked.at is not None:
        words.append(in_digits(asked.at))
    return "_".join(words)


def found_run(path: Path) -> History:
    """The run in a folder; if runs are in its subfolders, the message names these.

    Raises:
        ResultsError: there is none.
    """
    below = sorted(found.parent.name for found in path.glob(f"*/{RUN}")) if path.is_dir() else []
    if below and not (path / RUN).is_file():
        raise ResultsError(f"{path}: holds runs in {', '.join(below)}: name one of these")
    return open_results(path)


def _drawn(result: History, asked: argparse.Namespace, path: Path) -> bytes:
    """The picture's bytes in the format of the path's ending."""
    from matplotlib.backend_bases import FigureCanvasBase
    from matplotlib.figure import Figure

    known = FigureCanvasBase.get_supported_filetypes()
    kind = path.suffix.lower().removeprefix(".")
    if kind not in known:
        raise SceneError(f"--out = {path}: must end in one of {', '.join(sorted({*known, GIF[1:]}))}")
    figure, memory = Figure(layout="constrained"), io.BytesIO()
    axes = figure.add_subplot()
    if asked.traction is None:
        plot.contour(result, asked.field, asked.at, axes, by=asked.by)
    else:
        plot.contact_traction(result, asked.at, axes, tool=asked.traction, by=asked.by)
    figure.savefig(memory, format=kind, dpi=DPI)
    return memory.getvalue()


def _lines(result: History) -> Iterator[str]:
    yield f"{result.file}: {result.progress}"
    if result.note:
        yield result.note
    mesh = result.mesh
    kind = f"{mesh.element.name} elements, {result.geometry.value.replace('_', ' ')}"
    regions = f"; regions {', '.join(mesh.regions)}" if mesh.regions else ""
    boundaries = f"boundaries {', '.join(mesh.boundaries)}"
    yield f"mesh: {len(mesh.nodes)} nodes, {len(mesh.elements)} {kind}; {boundaries}{regions}"
    yield f"material: {result.told('material', str)}"
    # Older versions knew no regions.
    materials = result.told("regions", dict) if "regions" in result.scene else {}
    yield from (f"material of {name}: {own}" for name, own in materials.items())
    yield f"tools: {len(result.tools)}"
    yield "parameters:"
    yield from (f"  {name} = {value}" for name, value in result.parameters.items())
    yield "columns, with the last value:"
    width = max(map(len, result.columns))
    yield from (f"  {name:{width}}  {values[-1] if len(values) else ''}" for name, values in result.columns.items())
    for place, fields in result.fields.items():
        yield f"fields of {place}:"
        width = max(map(len, fields))
        for name, field in fields.items():
            parts = " ".join(map(str, field["components"]))  # type: ignore[arg-type]
            yield f"  {name:{width}}  {field['unit']}: {field['meaning']}{f' ({parts})' if parts else ''}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="bipot", description="Look at runs of bipot.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"bipot {version('bipot')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    told = commands.add_parser("info", help="what a run holds", allow_abbrev=False)
    told.add_argument("run", type=Path, metavar="RUN", help=f"a folder that holds {RUN}, or that file")
    told.set_defaults(run_command=lambda asked: info(found_run(asked.run)))
    drawn = commands.add_parser("picture", help="draw a field or the contact traction of a run", allow_abbrev=False)
    add_picture_options(drawn)
    drawn.set_defaults(run_command=lambda asked: str(picture(asked)))
    return parser
