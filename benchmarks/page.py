"""The table of limits in docs/benchmarks.md: ``python -m benchmarks.page [--results docs/results] [--write PAGE]``."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.rows import Row, read
from benchmarks.targets import verdicts
from studies.command import command, say
from studies.files import replacing

RESULTS = Path("docs/results")
BEGIN, END = "<!-- table: bench -->", "<!-- end -->"


def table(rows: list[Row]) -> str:
    """Each limit with what was measured, in Markdown."""
    lines = ["| what | form | mu | elements a side | measured | at most |", "|---|---|---|---|---|---|"]
    for limit, ratio in verdicts(rows):
        said = "not measured" if ratio is None else f"{ratio:.3g}" + ("" if ratio <= limit.most else " (missed)")
        lines.append(f"| {limit.name} | {limit.form} | {limit.mu:g} | {limit.elements} | {said} | {limit.most:g} |")
    return "\n".join(lines)


def written(page: str, rows: list[Row]) -> str:
    """The page with its table made anew."""
    place = re.compile(re.escape(BEGIN) + ".*?" + re.escape(END), re.DOTALL)
    return place.sub(lambda found: f"{BEGIN}\n{table(rows)}\n{END}", page)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the table or write the page."""
    parser = argparse.ArgumentParser(prog="benchmarks.page", description="The table of limits.", allow_abbrev=False)
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--write", type=Path, help="page whose table is replaced")
    asked = parser.parse_args(argv)
    rows = read(asked.results / "bench.csv")
    if asked.write is None:
        say(table(rows))
    else:
        page = written(asked.write.read_text(encoding="utf-8"), rows)
        with replacing(asked.write) as part:
            part.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
