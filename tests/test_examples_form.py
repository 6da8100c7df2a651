"""What examples look like."""

import ast

import pytest

from tests.test_examples import FOLDER, NAMES


@pytest.mark.parametrize("name", NAMES)
def test_an_example_has_twenty_to_sixty_lines_of_code(name):
    """Its title, comments and blank lines apart."""
    tree = ast.parse((FOLDER / f"{name}.py").read_text(encoding="utf-8"))
    texts = {n.value.lineno for n in ast.walk(tree) if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)}
    title = tree.body[0].end_lineno
    lines = {line for n in ast.walk(tree) if hasattr(n, "lineno") for line in (n.lineno, n.end_lineno)}
    assert 20 <= len({line for line in lines if line > title} - texts) <= 60


@pytest.mark.parametrize("name", NAMES)
def test_of_the_library_an_example_needs_public_names_alone(name):
    tree = ast.parse((FOLDER / f"{name}.py").read_text(encoding="utf-8"))
    modules = [node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    modules += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    assert [m for m in modules if m.startswith("bipot") and m != "bipot"] == []
