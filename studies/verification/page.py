"""The page of the suite, made from the cases' own texts and the rows of ``verification.csv``."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import groupby

from studies.comparison_page import table
from studies.comparison_tables import brief
from studies.verification.case import NO, YES, Asked, Case, Row, Sense
from studies.verification.forms import CERTIFICATE, CONIC, OTHERS, judged_on

NAME = "verification"
RUN = f"python -m studies.{NAME}"
FIGURES = f"figures/{NAME}"
QUOTED = re.compile(r"\{([^{}]+)\}")
"""A quantity in a note."""

HEAD = f"""# Verification

Each case has an answer that is known independently of finite element codes, or published with its scatter, and is run
on a series of meshes. `{RUN} --resume --out docs/results --page docs/verification.md` makes
[results/verification.csv](results/verification.csv) and from it this page;
`python -m paper_figs.fig_verification --results docs/results --out docs/figures/verification`
makes the pictures; `{RUN} --only NAME` runs one case. The command ends with exit code 1 where a case misses a
tolerance on its finest mesh, or another form on its coarsest ([Forms](#forms)).

Errors are relative to the reference, or absolute where that is zero. For a bound (`>=`, `<=`) only a violation counts
as an error. The allowed error is the source's own where it has one (5 % for the averages of `block_on_plane`, 1 % for
the displacements of `thick_tube`, which are Tresca's). Otherwise it is set here, as the accuracy required of the finest
mesh. Units are those of the set-up; times are those of one run on one thread."""


def page(cases: Sequence[Case], rows: Sequence[Row]) -> str:
    """Markdown: what is missed, a summary, and a section a case, of the cases that have a row on their finest mesh."""
    shown = {case: [row for row in rows if row.case == case.name] for case in cases}
    shown = {case: own for case, own in shown.items() if any(row.mesh == case.finest for row in own)}
    parts = [HEAD, verdict(shown), summary(shown), forms(shown)]
    for subject, group in groupby(shown, key=lambda case: case.subject):
        parts.append(f"## {subject.value}")
        parts += [section(case, shown[case]) for case in group]
    return "\n\n".join(parts) + "\n"


def verdict(shown: dict[Case, list[Row]]) -> str:
    """Which cases miss a tolerance."""
    missed = [case.name for case, rows in shown.items() if any(row.ok == NO for row in _judged(case, rows))]
    if not missed:
        return f"All {len(shown)} cases meet their tolerances on their finest meshes."
    named = ", ".join(f"`{name}`" for name in missed)
    verb, tell = ("misses", "Its section says") if len(missed) == 1 else ("miss", "Their sections say")
    return f"{len(missed)} of {len(shown)} cases {verb} a tolerance on the finest mesh: {named}. {tell} why."


def summary(shown: dict[Case, list[Row]]) -> str:
    """A line a case: the number that takes most of what it is allowed."""
    lines = []
    for case, rows in shown.items():
        own = {asked.quantity for asked in case.asked}
        worst = max((row for row in _judged(case, rows) if row.quantity in own), key=_used)
        met = YES if all(row.ok == YES for row in _judged(case, rows)) else NO
        lines.append([f"`{case.name}`", case.source, worst.quantity, _error(worst.error), _error(worst.tolerance), met])
    return table(["case", "source", "nearest to its tolerance", "error", "allowed", "met"], lines)


FORMS = f"""## Forms

Each march uses `newton` with the fallbacks `tangent` and `dissipation`. On the finest mesh at most
{100 * CONIC.tolerance:g} % of the increments may end in one of these conic forms, and no measure of a certificate may
be above its bound. On the coarsest mesh `tangent` and `dissipation` each repeat every march alone, from rest to its
end, in the increments of `newton`; where they had to cut, `newton` repeats the march in theirs. The table gives the
largest difference of the forces of tools and supports, over the largest force so far, in all increments whose forces
the law determines (while the hold-back of `capstan` rises, the shares of the cylinder and the other end are not
determined). The allowed difference is a hundred-thousandth."""


def forms(shown: dict[Case, list[Row]]) -> str:
    """A line a case that marches: how its increments ended, and how near other forms are."""
    asked = (CONIC, CERTIFICATE, *(other.asked for other in OTHERS))
    lines = []
    for case, rows in shown.items():
        found = {row.quantity: row for row in _judged(case, rows)}
        if CONIC.quantity in found:
            lines.append([f"`{case.name}`", *(_judgement(found.get(one.quantity)) for one in asked)])
    return "\n\n".join([FORMS, table(["case", *(one.quantity for one in asked)], lines)])


def section(case: Case, rows: Sequence[Row]) -> str:
    """Purpose, set-up, table, certificate and cost, picture, note and command."""
    parts = [f"### {case.name}", case.purpose, f"**Set-up.** {case.setup}", f"**Source.** {case.source}."]
    parts += [_errors(case, rows), _cost(case, rows)]
    if len(case.meshes) > 1:
        parts.append(f"![{case.name}: error over {case.counted}]({FIGURES}/{case.name}.png)")
    missed = [row.quantity for row in _judged(case, rows) if row.ok == NO]
    if missed:
        parts.append(f"**Missed:** {', '.join(missed)}. {_note(case, rows)}")
    elif case.note:
        parts.append(_note(case, rows))
    parts.append(f"`{RUN} --only {case.name}`")
    return "\n\n".join(parts)


def _note(case: Case, rows: Sequence[Row]) -> str:
    """The note, with how far from their references the values are that it asks for, on the finest mesh in per cent."""
    apart = {
        row.quantity: abs(row.value / row.reference - 1) for row in rows if row.mesh == case.finest and row.reference
    }
    return QUOTED.sub(lambda match: f"{100 * apart[match[1]]:.2g}", case.note)


def _errors(case: Case, rows: Sequence[Row]) -> str:
    """A line a number: its reference and value on the finest mesh, its errors on all."""
    meshes = [mesh for mesh in case.meshes if any(row.mesh == mesh for row in rows)]
    found = {(row.quantity, row.mesh): row for row in rows}
    lines = []
    for asked in case.asked:
        own = [found[asked.quantity, mesh] for mesh in meshes]
        errors = [_error(row.error) for row in own]
        last = own[-1]
        lines.append(
            [asked.quantity, _bound(asked, last), f"{last.value:.7g}", *errors, _error(last.tolerance), last.ok]
        )
    head = ["quantity", "reference", "value", *(f"error, {mesh}" for mesh in meshes), "allowed", "met"]
    return f"Errors by {case.counted}; values are those of the last:\n\n{table(head, lines)}"


def _cost(case: Case, rows: Sequence[Row]) -> str:
    """A line a mesh: worst certificate, passes, cuts, seconds; without marches the seconds alone."""
    once = {row.mesh: row for row in rows if row.quantity == case.asked[0].quantity}
    ran = [once[mesh] for mesh in case.meshes if mesh in once]
    if all(math.isnan(row.equilibrium) for row in ran):
        return "Seconds: " + ", ".join(f"{brief(row.seconds)} ({row.mesh})" for row in ran) + ". There is no march."
    lines = [
        [str(r.mesh), brief(r.equilibrium), brief(r.relative_gap), str(r.passes), str(r.cuts), brief(r.seconds)]
        for r in ran
    ]
    return table([case.counted, "equilibrium", "relative gap", "passes", "cuts", "s"], lines)


def _judged(case: Case, rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row.mesh == judged_on(case, row.quantity)]


def _judgement(row: Row | None) -> str:
    """A number of those that every march is asked, marked where it misses."""
    if row is None:
        return "not run"
    said = "no answer" if math.isnan(row.value) else f"{row.value:.2g}"
    return said if row.ok == YES else f"**{said}**"


def _used(row: Row) -> float:
    """How much of its tolerance an error takes, inf where it misses."""
    if row.ok == NO:
        return math.inf
    return abs(row.error) / row.tolerance if row.tolerance else 0.0


def _bound(asked: Asked, row: Row) -> str:
    sign = "" if asked.sense is Sense.EQUAL else f"{asked.sense.value} "
    return f"{sign}{row.reference:.7g}"


def _error(error: float) -> str:
    """In per cent, or with an exponent where it is small."""
    if math.isnan(error):
        return "no answer"
    return f"{100 * error:.2g} %" if abs(error) >= 1e-5 or error == 0 else f"{error:.1e}"
