"""The README's Python runs as printed; what it and the other pages name exists: commands, files, names, tests."""

import importlib
import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = [README, ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FOLDERS = ("bipot", "studies", "paper_figs", "benchmarks", "tests", "docs", "examples")
"""Where the pages' files are; a name may leave out the folders above it (``laws/flow.py``)."""

CODE = re.compile(r"`([^`\n]+)`")
COMMAND = re.compile(r"python -m (\w+(?:\.\w+)*)")
DOTTED = re.compile(r"(?<!/)(?:bipot|studies|paper_figs|benchmarks)(?:\.\w+)+")
FILE = re.compile(r"[\w/.]+\.(?:py|csv|hdf5)")
LINK = re.compile(r"\]\((?!https?:)([^)#\s]+)")
TEST = re.compile(r"`(\w+)::(\w+)`")


def text(page):
    return page.read_text(encoding="utf-8")


def missing_modules(words):
    """Modules of ``python -m`` that cannot be run: there is none, or it does nothing then."""
    named = [name for name in COMMAND.findall(words) if name not in ("pytest", "pip", "venv")]
    return [name for name in named if not runs(name)]


def runs(name):
    try:
        found = importlib.util.find_spec(name)
    except ModuleNotFoundError:
        return False
    if found is not None and found.submodule_search_locations:
        # Of a package it is its module of that name that runs.
        return importlib.util.find_spec(f"{name}.__main__") is not None
    return found is not None and "__main__" in text(Path(str(found.origin)))


def missing_names(words):
    """Dotted names in code that are neither a module's nor one of its names."""
    return [name for code in CODE.findall(words) for name in DOTTED.findall(code) if not known(name)]


def known(name):
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[k:]:
            found = getattr(found, attribute, getattr(found, "__dataclass_fields__", {}).get(attribute))
        return found is not None
    return False


def missing_files(words):
    """Files in code that are nowhere in the repository; tables without a folder are those of a run."""
    there = ["/" + str(path.relative_to(ROOT)) for folder in FOLDERS for path in (ROOT / folder).rglob("*.*")]
    files = [code for code in CODE.findall(words) if FILE.fullmatch(code)]
    ours = [name for name in files if name.endswith(".py") or name.startswith(tuple(f"{f}/" for f in FOLDERS))]
    return [name for name in ours if not any(path.endswith("/" + name) for path in there)]


def missing_tests(words):
    """Tests (file, function) that are not in a file of that name, in whatever folder."""
    return [(file, name) for file, name in TEST.findall(words) if not defines(file, name)]


def defines(file, name):
    found = (ROOT / "tests").rglob(f"test_{file}.py")
    return any(re.search(rf"^def {name}\(", text(path), re.MULTILINE) for path in found)


def test_the_python_example_runs_and_prints_a_certified_line_an_increment(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", text(README), re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    exec(compile(code, "README.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith(" 1.000")
    assert all("bipotential gap" in line and float(line.rsplit(maxsplit=1)[1]) < 1e-7 for line in lines)


def example_of_scenes(name):
    """The one example of the page on scenes that makes a scene of that ``name``."""
    examples = re.findall(r"```python\n(.*?)```", text(ROOT / "docs" / "scenes.md"), re.DOTALL)
    (code,) = (code for code in examples if f"\n{name} = Scene(" in code)
    return compile(code, "scenes.md", "exec")


def test_the_quarter_of_the_page_on_scenes_runs(capsys):
    exec(example_of_scenes("quarter"), {})
    words = capsys.readouterr().out.replace("[", " ").replace("]", " ").split()
    along, force, work, images = map(float, words)
    assert (along, images) == (0.0, 4.0)
    # Two platens, each by 0.5; sigma_Y 2/sqrt(3) on a width of 40, friction beside.
    assert 0.8 < work / (-force * 2 * 0.5) < 1.0
    assert 100 * 2 / np.sqrt(3) * 40 < -force < 1.2 * 100 * 2 / np.sqrt(3) * 40


def test_the_tube_of_the_page_on_scenes_runs(capsys):
    exec(example_of_scenes("tube"), {})
    outer = [float(line.split()[1]) for line in capsys.readouterr().out.splitlines()]
    assert len(outer) == 10
    assert 0.08 < outer[-1] < 0.2


def test_the_two_commands_open_the_readme_and_are_in_the_makefile():
    for command in ("run", "test"):
        assert f"make {command} " in text(README)[:800]
        assert re.search(rf"^{command}:", text(ROOT / "Makefile"), re.MULTILINE)


def test_make_run_takes_both_elements_and_draws_every_figure_of_them():
    (recipe,) = re.findall(r"^run:.*\n((?:\t.*\n)+)", text(ROOT / "Makefile"), re.MULTILINE)
    assert re.search(r"studies\.upsetting --mu 0\.1 0\.3 .*--beside.* --out \$\(OUT\)\n", recipe)
    drawn = re.findall(r"paper_figs\.(\w+) --results \$\(OUT\)\n", recipe)
    assert drawn == ["fig1_mesh", "fig2_velocity", "fig_force_stroke", "fig_traction"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_a_page_names_exists(page):
    words = text(page)
    assert missing_modules(words) == []
    assert missing_names(words) == []
    assert missing_files(words) == []
    assert missing_tests(words) == []
    assert [link for link in LINK.findall(words) if not (page.parent / link).is_file()] == []


def test_the_pages_name_what_they_rest_on():
    words = "".join(map(text, PAGES))
    assert len(COMMAND.findall(words)) > 20
    assert len(TEST.findall(words)) > 50
    assert len([code for code in CODE.findall(words) if FILE.fullmatch(code)]) > 20


def test_what_does_not_exist_is_found():
    assert missing_modules("python -m studies.nothing, python -m no.thing, python -m bipot.scene.scene") == [
        "studies.nothing",
        "no.thing",
        "bipot.scene.scene",
    ]
    assert missing_names("`bipot.scene.scene.Scene` and `bipot.scene.scene.Nothing`, `bipot.nothing`, bipot.prose") == [
        "bipot.scene.scene.Nothing",
        "bipot.nothing",
    ]
    assert missing_files("`scene.py`, `bipot/scene/scene.py`, `x/scene.py`, `docs/x.csv`, `history.csv`") == [
        "x/scene.py",
        "docs/x.csv",
    ]
    assert missing_tests("`readme::test_what_does_not_exist_is_found`, `readme::test_none`") == [
        ("readme", "test_none")
    ]
