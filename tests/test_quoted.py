"""Numbers in the running text of the pages are those of the results, and words about them hold."""

import re
from pathlib import Path

import pytest

from bipot.errors import ResultsError
from studies.comparison_page import RESULTS
from studies.quoted.__main__ import main
from studies.quoted.filling import QUOTED, Quoted, broken, written
from studies.quoted.pages import PAGES
from studies.quoted.results import Results

ROOT = Path(__file__).parents[1]
KEPT = Results(ROOT / RESULTS)


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", PAGES)
def test_a_page_quotes_what_the_results_say(name):
    page = text(name)
    assert written(page, PAGES[name], KEPT) == page
    assert broken(page, PAGES[name], KEPT) == []


def test_no_page_has_a_marker_without_a_value():
    pages = [ROOT / "README.md", ROOT / "paper_figs" / "README.md", *(ROOT / "docs").rglob("*.md")]
    marked = [page.relative_to(ROOT).as_posix() for page in pages if QUOTED.search(page.read_text(encoding="utf-8"))]
    assert sorted(marked) == sorted(name for name, quoted in PAGES.items() if quoted.values)
    # Where a line begins with a comment Markdown ends the paragraph.
    assert not [name for name in PAGES if re.search(r"^\s*<!-- =", text(name), re.MULTILINE)]


ONE = Quoted({"a": lambda results: "2.5"}, {"more than twice": lambda results: True})


def test_a_value_is_written_in_front_of_its_marker():
    assert (
        written("It is 1.0<!-- =a --> %, more than\ntwice.", ONE, KEPT) == "It is 2.5<!-- =a --> %, more than\ntwice."
    )


@pytest.mark.parametrize("page", ["none", "1<!-- =a --> and 2<!-- =b -->", "nothing before <!-- =a -->"])
def test_a_marker_and_a_value_need_each_other(page):
    with pytest.raises(ResultsError, match="must be"):
        written(page, ONE, KEPT)


def test_a_value_of_two_words_is_refused():
    with pytest.raises(ResultsError, match=r"value a, '1 to 2' .* must be one number or word"):
        written("3<!-- =a -->", Quoted({"a": lambda results: "1 to 2"}), KEPT)


def test_words_that_do_not_hold_or_are_not_there_are_found():
    assert broken("This is more\nthan twice.", ONE, KEPT) == []
    assert broken("This is more.", ONE, KEPT) == ["more than twice"]
    wrong = Quoted(claims={"It is": lambda results: False})
    assert broken("It is 2<!-- =a -->.", wrong, KEPT) == ["It is"]


def test_what_results_do_not_hold_is_refused(tmp_path):
    for read in (
        lambda: KEPT.rows("faults", nothing=1.0),
        lambda: KEPT.rows("faults", tried=-1.0),
        lambda: KEPT.one("faults", "lost"),
        lambda: Results(tmp_path).rows("faults"),
    ):
        with pytest.raises(ResultsError, match=r"faults\.csv"):
            read()


@pytest.mark.slow
def test_the_command_says_what_differs_and_writes_it(tmp_path, monkeypatch, capsys):
    for name in PAGES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text(name), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    name = "docs/comparison.md"
    page = tmp_path / name
    page.write_text(re.sub(r"[\d.]+<!-- =fine_40 -->", "7<!-- =fine_40 -->", text(name)), encoding="utf-8")
    results = ["--results", str(KEPT.folder)]
    assert main(results) == 1
    assert f"{name}: fine_40: 7 -> " in capsys.readouterr().out
    assert main([*results, "--write"]) == 0
    assert page.read_text(encoding="utf-8") == text(name)
    capsys.readouterr()
    assert main(results) == 0
    assert capsys.readouterr().out == ""
