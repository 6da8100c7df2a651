"""Numbers in the running text of the pages, from the results files (:mod:`studies.quoted`).

    python -m studies.quoted [--results docs/results] [--write]

Run from the folder of the repository, says what differs, or with ``--write`` puts it right; exit code 1 where a page is
not what the results say: a value that was not written, or words that they do not show.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from studies.command import command, say
from studies.comparison_page import RESULTS
from studies.files import replacing
from studies.quoted.filling import QUOTED, broken, written
from studies.quoted.pages import PAGES
from studies.quoted.results import Results


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Compare the pages with the results, or write them."""
    parser = argparse.ArgumentParser(
        prog="studies.quoted", description="Numbers in the text of the pages.", allow_abbrev=False
    )
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--write", action="store_true", help="write what differs into the pages")
    asked = parser.parse_args(argv)
    results, wrong = Results(asked.results), False
    for name, quoted in PAGES.items():
        path = Path(name)
        page = path.read_text(encoding="utf-8")
        made = written(page, quoted, results)
        for (was, value), (now, _) in zip(QUOTED.findall(page), QUOTED.findall(made), strict=True):
            if was != now:
                say(f"{name}: {value}: {was} -> {now}")
        claims = broken(page, quoted, results)
        for claim in claims:
            say(f"{name}: not in the page, or not what results show: {claim}")
        if asked.write and made != page:
            with replacing(path) as part:
                part.write_text(made, encoding="utf-8")
        wrong = wrong or bool(claims) or (made != page and not asked.write)
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
