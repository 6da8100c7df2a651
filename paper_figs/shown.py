"""The runs that figures of the upsetting show, from whatever a folder of results holds, and how they are told apart."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.figure import Figure

from bipot.contact.closeness import carries
from bipot.errors import ResultsError
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Perfect
from bipot.results import History
from bipot.results import open as open_results
from bipot.results.folder import run_file
from bipot.tools.surfaces import frames
from bipot.typing import Bools, Ints
from paper_figs.common import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, WIDTH, from_results, require_run
from studies.closed_forms import Cylinder
from studies.known_limits import is_upsetting, of_run
from studies.run_names import friction_of, is_papers, name_of
from studies.upsetting_beside import BESIDE

T = TypeVar("T")

COMMAND = "python -m studies.upsetting --mu 0.1 0.3 --out {results}"
COLUMNS = "reduction", "force_N"
"""Of ``history.csv``, which figures read beside the fields."""

BOUNDARIES = "top", "side"
"""What the mesh must name."""


COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
MARKERS = ("o", "s", "^", "D", "p", "h", "*")
DOTS: tuple[Any, ...] = (":", (0, (4, 1.2, 1, 1.2, 1, 1.2)), (0, (1, 1, 3, 1)), (0, (5, 1, 1, 1)), (0, (2, 1, 2, 3)))
"""Six, seven and five: no two coefficients look the same."""

ALONE = 4.6
"""Width of a figure that has but one panel in a line, inches."""

LONGEST = 56
"""Letters in a line of a title."""

NO_LANDING = 1e-3
"""Of the punch's travel in an increment: what has no larger gap has not left the punch, and does not land."""

LEVEL = 1e-9
"""Of the height: what is no lower at rest lies on the punch."""


@dataclass(frozen=True)
class Group:
    """The runs of one coefficient: that which was asked for, and that of the trustworthy element, where there is one.

    ``number`` counts coefficients, and chooses the looks.
    """

    number: int
    run: History
    beside: History | None = None

    @property
    def runs(self) -> tuple[History, ...]:
        """Both, or the one."""
        return (self.run,) if self.beside is None else (self.run, self.beside)

    @property
    def mu(self) -> float:
        """The Coulomb coefficient."""
        return friction(self.run)

    @property
    def words(self) -> str:
        """The coefficient in a title or legend."""
        return said(self.mu)

    @property
    def colour(self) -> str:
        """Of its curves."""
        return COLOURS[self.number % len(COLOURS)]

    @property
    def marker(self) -> str:
        """Of the curve asked for."""
        return MARKERS[self.number % len(MARKERS)]

    @property
    def dots(self) -> Any:
        """Dashes of its closed form."""
        return DOTS[self.number % len(DOTS)]


def shown(results: Path) -> list[Group]:
    """The run that ``results`` is, or the runs in its folders ``mu*`` by rising coefficient, with those beside them.

    A run without an increment is left out. So is one beside another that poses another problem: it is of an earlier
    study. Both are said on stderr.

    Raises:
        ResultsError: there is none, and the message names the command that makes them; one is no run of the study.
    """
    own = [run for run in [_read(results)] if run is not None]
    found = own or sorted(_runs(results), key=friction)
    if not found:
        raise ResultsError(f"{results}: no results; run: {COMMAND.format(results=results)}")
    beside = {run.folder.name: run for run in _runs(results / BESIDE)}
    return [Group(number, run, _same(run, beside.get(run.folder.name))) for number, run in enumerate(found)]


def _runs(folder: Path) -> Iterator[History]:
    """Those in the folders of coefficients."""
    read = map(_read, sorted(folder.glob("mu*")))
    return (run for run in read if run is not None)


def _read(folder: Path) -> History | None:
    """The run of a folder if there is one that has come to an increment."""
    if not run_file(folder).is_file():
        return None
    run = open_results(folder)
    require_run(run, "studies.upsetting", Geometry.AXISYMMETRIC, COLUMNS, BOUNDARIES)
    if not len(run):
        _say(f"{folder}: left out: no increment is recorded")
        return None
    return run


def _same(run: History, beside: History | None) -> History | None:
    """The run beside another if both pose one problem."""
    if beside is None or of_run(beside) == of_run(run):
        return beside
    _say(f"{beside.folder}: left out: it poses another problem than {run.folder}")
    return None


def _say(words: str) -> None:
    print(words, file=sys.stderr)


def friction(run: History) -> float:
    """The Coulomb coefficient of the run."""
    return float(run.scene["tools"][0]["mu"])


def said(mu: float) -> str:
    """A coefficient in a title or legend."""
    return r"$\mu = \infty$ (welded)" if np.isinf(mu) else rf"$\mu$ = {friction_of(mu)}"


def named(run: History) -> str:
    """The run's mesh in words, and whether it is the paper's."""
    return name_of(run) + (" (the paper's)" if is_papers(run) else "")


def stopped(run: History, words: str) -> str:
    """These ``words`` of a run that stopped before its end; nothing of a complete one."""
    return "" if run.complete else words


def titled(letter: str, run: History, row: int) -> str:
    """Title of a panel: mesh, coefficient, reduction; in two lines where one would not hold it."""
    at = f"{said(friction(run))}, {per_cent(run['reduction'][row])}"
    if row == len(run) - 1:
        at += stopped(run, " (stopped)")
    first = f"({letter}) {named(run)}"
    return f"{first}, {at}" if len(first) + len(at) < LONGEST else f"{first},\n{at}"


def width_of(columns: int) -> float:
    """Of a figure with one panel or two in a line, inches."""
    return WIDTH if columns > 1 else ALONE


def per_cent(reduction: float) -> str:
    """A reduction in per cent, to a tenth of one; of less to two digits.

    >>> [per_cent(x) for x in (0.45, 0.20144, 0.005)]
    ['45 %', '20.1 %', '0.5 %']
    """
    return f"{100 * reduction:.3g} %" if reduction >= 0.1 else f"{100 * reduction:.2g} %"


def paired(groups: Sequence[Group], cells: Sequence[Sequence[T | None]]) -> list[list[T | None]]:
    """Cells of figures, a sequence a run in the order of groups, in lines of two.

    Where a run has another beside it, theirs are side by side; otherwise they follow each other.
    """
    left = iter(cells)
    if all(group.beside is None for group in groups):
        line = [cell for mine in left for cell in mine if cell is not None]
        return _in_pairs(line[::2], line[1::2]) if len(line) > 1 else [[*line]]
    lines = list[list[T | None]]()
    for group in groups:
        lines += _in_pairs(next(left), [] if group.beside is None else next(left))
    return [line for line in lines if any(cell is not None for cell in line)]


def _in_pairs(left: Sequence[T | None], right: Sequence[T | None]) -> list[list[T | None]]:
    return [[*pair] for pair in zip_longest(left, right)]


def landings(run: History) -> Ints:
    """Rows in which a node that was beside the punch at rest comes to carry a force, from a distance.

    Distances below :data:`NO_LANDING` of the punch's mean travel in an increment are none.
    """
    z, side = run.mesh.nodes[:, 1], side_nodes(run)
    height = float(z.max())
    none = NO_LANDING * height * float(run["reduction"][-1]) / len(run)
    rows, largest = list[int](), height - z[side]
    for row, reduction in enumerate(run["reduction"]):
        closed = carrying(run, row, side)
        if (closed & (largest > none)).any():
            rows.append(row)
        off = height * (1 - reduction) - z[side] - run.nodal("displacement", row)[side, 1]
        largest = np.where(closed, 0.0, np.maximum(largest, off))
    return np.array(rows, dtype=np.intp)


def side_nodes(run: History) -> Ints:
    """Candidates that were beside the punch at rest, below its face."""
    mesh, (tool,) = run.mesh, run.scene["tools"]
    z, nodes = mesh.nodes[:, 1], mesh.boundary_nodes(*tool["candidates"])
    return nodes[z[nodes] < (1 - LEVEL) * float(z.max())]


def carrying(run: History, row: int, nodes: Ints) -> Bools:
    """Which of the ``nodes`` carry a force of the punch after the increment of a row."""
    frame = frames(np.array(run.scene["tools"][0]["normal"]))
    return carries(run.nodal("contact_force", row)[:, :2] @ frame.T)[nodes]


def cylinder_of(run: History) -> Cylinder:
    """The whole cylinder of which the run models a quarter."""
    radius, half_height = run.mesh.nodes.max(axis=0).tolist()
    scene = run.scene
    return Cylinder(2 * half_height, radius, scene["young"], scene["poisson"], scene["yield_stress"])


def has_closed_forms(run: History) -> bool:
    """Whether :mod:`studies.closed_forms` apply: a cylinder between punches, perfectly plastic."""
    if not run.scene["perfectly_plastic"]:
        return False
    one = cylinder_of(run)
    return is_upsetting(
        run,
        height=one.height,
        diameter=2 * one.radius,
        young=one.young,
        poisson=one.poisson,
        hardening=Perfect(one.yield_stress),
    )


def make(draw: Callable[[list[Group]], Figure], name: str, title: str, argv: Sequence[str] | None) -> None:
    """Read the results, draw, write ``name.pdf`` and ``name.png``; the whole command line of a figure."""

    def figures(results: Path) -> dict[str, Figure]:
        return {name: draw(shown(results))}

    from_results(argv, title, "results/upsetting", figures, "folder of runs, or a run's")
