"""A number with a unit of results in the text of a page is quoted from results, asserted by a test, or the set-up's."""

import re
from pathlib import Path

import pytest

from studies.quoted.filling import QUOTED
from studies.quoted.pages import PAGES

ROOT = Path(__file__).parents[1]
WHOLE = {"docs/verification.md"}
"""Written whole by its study, from its cases."""

FOUND = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "paper_figs" / "README.md"]
TEXTS = sorted({page.relative_to(ROOT).as_posix() for page in FOUND} - {"CHANGELOG.md", "CONTRIBUTING.md", *WHOLE})

HIDDEN = re.compile(
    r"(?s:<!-- table: .*?<!-- end -->|^```.*?^```)|(?:(?<=\n\n) {4}.*\n)+|`[^`\n]*`|\]\([^)]*\)|^!\[.*$|^\|.*$",
    re.MULTILINE,
)
"""Tables, code, targets of links and titles of pictures."""

TESTED = re.compile(r"`\w+::\w+`|`tests/\w+\.py`")
MEASURED = re.compile(
    r"(?<![\w.^(-])\d+(?:\.\d+)?(?:e-?\d+)? ?(?:%|(?:m?s|times|k?N|MPa|[MG]B|passes|seconds|minutes|kappa)\b)"
)
REDUCTIONS = re.compile(r"(?:10|20|30|40|44|45|46) %")
"""At which forces are compared and marches end."""

GIVEN = {
    "docs/benchmarks.md": (
        "at least 20 times",
        "increments of 1 %",
        "at mu = 0.3 of 0.5 %",
        "increments of 0.5 %",
        "1.3 kappa",
        "2 GB",
    ),
    "docs/comparison.md": (
        "a start-up 128 times finer",
        "0.1 % of the height",
        "0.5, 1 or 2 % of the height",
    ),
    "docs/coulomb.md": ("4 s a problem",),
    "docs/elements.md": ("increments of 1 %", "from 2 % on"),
    "docs/howto/choosing.md": ("0.1 % of the height",),
    "docs/howto/unloading.md": ("a block by 5 %",),
    "docs/robustness.md": ("after 200 passes", "first or last 2 %", "to 1 %, equilibrium"),
    "docs/scenes.md": ("yield strain of 0.14 %", "pressed by 5 %", "along by 7.5 %"),
    "docs/theory.md": ("E = 210000 MPa", "sigma_Y = 300 MPa", "than 2 % of it"),
}
"""Words of the set-up by page: what is chosen, asked or allowed, and not measured."""


def sentences(text):
    """Sentences of the running text without their code; a test that one names is left in it as ``TEST``."""
    plain = HIDDEN.sub(lambda match: "TEST" if TESTED.fullmatch(match[0]) else " ", text)
    return [" ".join(one.split()) for one in re.split(r"(?<=[.:;])\s+|\n\n|\n(?=\*)", plain)]


def unsourced(text, given=()):
    """Sentences with a number that rests on nothing."""
    found = []
    for sentence in sentences(text):
        rest = QUOTED.sub("", sentence)
        for words in given:
            rest = rest.replace(words, "")
        numbers = [number for number in MEASURED.findall(rest) if not REDUCTIONS.fullmatch(number)]
        if numbers and "TEST" not in sentence:
            found.append(sentence)
    return found


@pytest.mark.parametrize("name", TEXTS)
def test_a_measured_number_is_quoted_or_tested(name):
    claims = PAGES[name].claims if name in PAGES else ()
    assert unsourced((ROOT / name).read_text(encoding="utf-8"), (*GIVEN.get(name, ()), *claims)) == []


@pytest.mark.parametrize("name", GIVEN)
def test_words_of_the_set_up_are_in_their_page(name):
    text = " ".join(sentences((ROOT / name).read_text(encoding="utf-8")))
    assert [words for words in GIVEN[name] if words not in text] == []


def test_numbers_that_rest_on_nothing_are_found():
    text = (
        "It takes 3 % more, and 2<!-- =a --> %. At 45 %\nit is off by 0.2 MPa (`tests/test_x.py`).\n\n    4 s of code\n"
    )
    assert unsourced(text) == ["It takes 3 % more, and 2<!-- =a --> %."]
    assert unsourced(text, ["3 % more"]) == []
    assert unsourced("<!-- table: a -->\n5 %\n<!-- end -->\n`6 s`\n") == []
