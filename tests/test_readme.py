"""The README's Python runs as printed, and its commands exist; so do the tests that the pages name."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_python_example_runs_and_prints_a_certified_line_an_increment(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    exec(compile(code, "README.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith(" 1.000")
    assert all("bipotential gap" in line and float(line.rsplit(maxsplit=1)[1]) < 1e-7 for line in lines)


def test_the_two_commands_open_the_readme_and_are_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    for command in ("run", "test"):
        assert f"make {command} " in README[:800]
        assert re.search(rf"^{command}:", makefile, re.MULTILINE)


def test_every_module_and_file_the_readme_names_exists():
    for module in re.findall(r"python -m (studies|paper_figs)\.(\w+)", README):
        assert (ROOT / module[0] / f"{module[1]}.py").is_file()
    for target in re.findall(r"\]\(([^)h][^)]*)\)", README):
        assert (ROOT / target).is_file(), target


def test_every_test_the_pages_name_exists():
    named = [
        found
        for page in (ROOT / "docs").glob("*.md")
        for found in re.findall(r"`(\w+)::(\w+)`", page.read_text("utf-8"))
    ]
    assert len(named) > 50
    for file, function in named:
        assert re.search(rf"^def {function}\(", (ROOT / f"tests/test_{file}.py").read_text("utf-8"), re.MULTILINE), (
            function
        )
