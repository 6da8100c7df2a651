"""The blocks of the documentation's pages run as printed and print what the page says; the site is built from them."""

import os
import re
import runpy
import shutil
import subprocess
import sys

import pytest

import bipot
from tests import pages
from tests.pages import DOCS, PAGES, REFERENCE, ROOT, blocks, printed, written

TEXTS = sorted([*ROOT.glob("*.md"), *DOCS.glob("*.md"), *DOCS.glob("howto/*.md")])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_prints_what_it_says(page, tmp_path):
    said = [block.printed for block in blocks(page.read_text(encoding="utf-8"))]
    assert printed(page, tmp_path) == said


@pytest.mark.parametrize("page", REFERENCE, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run(page, tmp_path):
    assert any(printed(page, tmp_path))


def test_every_task_has_a_page_with_something_to_run():
    empty = [page.stem for page in PAGES if not blocks(page.read_text(encoding="utf-8"))]
    assert empty == ["index"]
    listed = (DOCS / "howto" / "index.md").read_text(encoding="utf-8").split()
    assert [page.stem for page in PAGES[1:] if page.stem not in ("index", *listed)] == []


NEEDS = {"Qoco(": '".[qoco]"', ".frame(": '".[frames]"', "from_meshio(": '".[mesh]"', "pyvista": '".[pictures]"'}
"""What a block uses, and what its page then says of the installation."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_says_what_its_blocks_need_beside_the_installation_of_the_first_steps(page):
    text = page.read_text(encoding="utf-8")
    code = "".join(block.code for block in blocks(text))
    assert [words for used, words in NEEDS.items() if used in code and words not in text] == []
    assert "studies" not in code or "copy of the repository" in text


def test_what_a_block_prints_is_put_below_it_in_the_place_of_what_was_there():
    page = "```python\nprint(1)\n```\n\n```text\n2\n```\n\n```python\na = 3\n```\n\nEnd.\n"
    right = page.replace("\n2\n", "\n1\n")
    assert written(page, ["1\n", ""]) == right
    assert [block.printed for block in blocks(right)] == ["1\n", ""]


ITEM = re.compile(r"\s*(?:[-+*]|\d+[.)]) ")
FENCED = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)


def broken_formulas(text):
    """Lines that begin within code and are read as items of a list: such a formula ends there, unrendered."""
    found = []
    for block in FENCED.sub("", text).split("\n\n"):
        before, *lines = block.split("\n")
        ticks = before.count("`")
        for line in lines:
            if ticks % 2 and ITEM.match(line):
                found.append(line)
            ticks += line.count("`")
    return found


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: page.stem)
def test_no_formula_is_broken_by_a_list(page):
    """A line of the certificate's gap began with a plus: the site showed a list in the middle of the formula."""
    assert broken_formulas(page.read_text(encoding="utf-8")) == []


def test_a_formula_that_a_list_breaks_is_found():
    assert broken_formulas("* gap: `a\n  + b`\n* `c`\n\n```text\n`\n- d\n```\n") == ["  + b`"]


@pytest.mark.parametrize("page", ["nope", "nope.md", "docs", "Makefile"])
def test_a_page_that_is_none_is_refused_in_a_sentence_before_any_is_written(page, monkeypatch):
    """It once ended in the traceback of a file that is not there."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(pages, "printed", lambda *_: pytest.fail("a page was run"))
    monkeypatch.setattr(sys, "argv", ["tests.pages", str(PAGES[0]), page])
    with pytest.raises(SystemExit, match=rf"^tests\.pages: PAGE = '{page}': must be a Markdown file, e\.g\. docs/"):
        pages.main()


def test_the_reference_has_modules_that_exist():
    told = runpy.run_path(str(ROOT / "docs" / "_ext" / "reference.py"))
    for page, text in told["modules"]().items():
        assert "auto" in text, page


def test_the_reference_has_every_public_name():
    """A line for each subject in the package's docstring: a name on a second line was lost."""
    told = runpy.run_path(str(ROOT / "docs" / "_ext" / "reference.py"))["subjects"]()
    assert sorted(name for names in told.values() for name in names) == sorted(bipot.__all__)


@pytest.mark.slow
@pytest.mark.parametrize("reference", [0, 2])
def test_the_site_is_built_without_a_warning(reference, tmp_path):
    """Every link and name is checked, and by the long one every docstring; the gallery is not run."""
    pytest.importorskip("sphinx_gallery")
    for name in ("docs", "examples"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("_build", "gallery", "reference"))
    for name in ("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md"):
        shutil.copy(ROOT / name, tmp_path)
    for name in ("bipot", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    quick = ["-D", "plot_gallery=0", "-D", f"reference_groups={reference}"]
    command = [sys.executable, "-m", "sphinx", "-b", "dummy", "-q", "-W", "--keep-going", *quick, "docs", "built"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
