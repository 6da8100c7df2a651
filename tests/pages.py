"""The Python of the documentation's pages, page by page, in an empty folder; what it prints stands below it.

    python -m tests.pages [PAGE ...]

writes what the blocks of the pages print into the ``text`` blocks that follow them.
"""

import io
import os
import re
import shutil
import sys
import tempfile
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

from matplotlib import pyplot

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [DOCS / "first_steps.md", *sorted((DOCS / "howto").glob("*.md"))]
"""Tasks: what their blocks print is on the page."""

REFERENCE = [ROOT / "README.md", *(DOCS / f"{name}.md" for name in ("index", "scenes", "comparison", "coulomb"))]
"""Pages whose blocks run, and print what is not on the page."""

BLOCK = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.DOTALL | re.MULTILINE)
LINKED = re.compile(r"\]\(([^)\s]+\.(?:msh|csv|hdf5))\)")
"""Files that a page gives its reader, and that its blocks find beside them."""


@dataclass(frozen=True)
class Block:
    """A block of Python, and what the page says that it prints."""

    code: str
    printed: str


def blocks(text: str) -> list[Block]:
    """The blocks of a page, in their order."""
    return [Block(code, printed) for code, printed in BLOCK.findall(text)]


def printed(page: Path, folder: Path) -> list[str]:
    """What the blocks of the page print, run one after the other in the folder, as one program."""
    text = page.read_text(encoding="utf-8")
    for name in LINKED.findall(text):
        shutil.copy(page.parent / name, folder)
    scope, found = {"__name__": "__page__"}, []
    with chdir(folder):
        for block in blocks(text):
            out = io.StringIO()
            with redirect_stdout(out):
                exec(compile(block.code, page.name, "exec"), scope)
            found.append(out.getvalue())
    pyplot.close("all")
    return found


def written(text: str, found: list[str]) -> str:
    """The page with what its blocks print."""
    rest = iter(found)

    def block(match: re.Match[str]) -> str:
        out = next(rest)
        return f"```python\n{match[1]}```\n" + (f"\n```text\n{out}```\n" if out else "")

    return BLOCK.sub(block, text)


def main() -> None:
    """Write the pages; a file that is none ends it in a sentence, before any is written."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    pages = list(map(Path, sys.argv[1:])) or PAGES
    for page in pages:
        if page.suffix != ".md" or not page.is_file():
            sys.exit(f"tests.pages: PAGE = {str(page)!r}: must be a Markdown file, e.g. docs/first_steps.md")
    for page in pages:
        with tempfile.TemporaryDirectory() as folder:
            found = printed(page.resolve(), Path(folder))
        page.write_text(written(page.read_text(encoding="utf-8"), found), encoding="utf-8")


if __name__ == "__main__":
    main()
