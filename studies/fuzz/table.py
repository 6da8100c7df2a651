"""What a page shows of the fuzz study: outcomes by kind of scene, from the results file alone."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from studies.fuzz.row import Outcome, first
from studies.tables import Value, read_csv

Lines = tuple[list[str], list[list[str]]]

COLUMNS = {
    "certified": (Outcome.CERTIFIED,),
    "refused": (Outcome.REFUSED,),
    "wrong": (Outcome.WRONG,),
    "raw or warning": (Outcome.RAW, Outcome.WARNING),
}

SHOWN = {
    "scene": (
        "scenes with flat tools",
        {"weighted": "weighted contact", "force": "forces on tools", "supports": "moving supports"},
    ),
    "shaped": (
        "scenes with shaped tools",
        {
            "weighted": "weighted contact",
            "circle": "round or hollow tools",
            "profile": "profiles",
            "union": "several surfaces",
            "turning": "tools that turn",
            "capped": "capped friction",
        },
    ),
    "solid": (
        "bodies in space",
        {
            "h8": "H8",
            "h20": "H20",
            "t10": "T10",
            "force": "forces on tools",
            "supports": "moving supports",
            "capped": "capped friction",
        },
    ),
    "solid shaped": (
        "bodies in space under shaped tools",
        {
            "weighted": "weighted contact",
            "revolved-circle": "balls, bowls or rings",
            "revolved-plane": "rolls",
            "revolved-profile": "other surfaces of revolution",
            "union": "several surfaces",
            "turning": "tools that turn",
            "force": "forces on tools",
            "moment": "moments on tools",
            "capped": "capped friction",
        },
    ),
    "regional": ("scenes of several materials", {}),
    "solid regional": ("bodies in space of several materials", {}),
    "parts": (
        "scenes of parts that touch each other",
        {
            "ring": "rings",
            "quadratic": "quadratic elements",
            "free": "a part that nothing holds",
            "half": "a plane of symmetry or an axis",
            "welded": "parts that are welded",
        },
    ),
    "solid parts": (
        "parts in space that touch each other",
        {"h8": "H8", "h20": "H20", "t4": "T4", "t10": "T10", "free": "a part that nothing holds"},
    ),
    "coulomb": ("discrete problems", {}),
}
"""By the first words of a kind what it is, and what other words of it say."""


def of_outcomes(results: Path) -> Lines:
    """Outcomes of every kind, and of those with what its words say."""
    lines = read_csv(results / "fuzz.csv", f"python -m studies.fuzz --out {results}")
    kinds = [(str(line["kind"]), line) for line in lines]
    rows = list[list[str]]()
    for name, (what, words) in SHOWN.items():
        own = [(kind.split(), line) for kind, line in kinds if first(kind) == name]
        if not own:
            continue
        seeds = [int(float(line["seed"])) for _, line in own]
        rows.append([f"{min(seeds)} to {max(seeds)}", f"{len(own)} {what}", *_counts(line for _, line in own)])
        for word, said in words.items():
            some = [line for kind, line in own if word in kind]
            rows.append(["of these", f"{len(some)} with {said}", *_counts(some)])
    return ["seeds", "what", *COLUMNS, "increments"], rows


def _counts(lines: Iterable[dict[str, Value]]) -> list[str]:
    found = list(lines)
    counts = [sum(line["outcome"] in [o.value for o in outcomes] for line in found) for outcomes in COLUMNS.values()]
    return [*map(str, counts), f"{sum(float(line['increments']) for line in found):.0f}"]
