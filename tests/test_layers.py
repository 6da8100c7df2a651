"""Imports go downwards only, and the library neither prints nor plots nor reads a scene where it must not."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FLOORS = (
    ("errors", "frozen", "progress", "typing", "laws", "mesh"),
    ("fem", "scene"),
    ("contact", "overlap", "programs", "response", "certificate", "coulomb", "system", "certification", "determinacy"),
    ("forms", "increment"),
    ("carrying", "diagnosis", "energy", "force_control", "landing", "march", "paper", "exchange", "starting"),
    ("columns", "export", "history", "traction", "plot"),
)
FLOOR = {name: k for k, names in enumerate(FLOORS) for name in names} | {"traction": 2}
FILES = sorted((ROOT / "bipot").rglob("*.py"))


def room(path):
    """The first part of a module's name below the package."""
    return path.relative_to(ROOT / "bipot").with_suffix("").parts[0]


def imported(path):
    """Rooms of the package that a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("bipot"):
            parts = (node.module or "").split(".")
            yield from parts[1:2] or [alias.name for alias in node.names]


@pytest.mark.parametrize("path", [p for p in FILES if p.name != "__init__.py" or p.parent.name != "bipot"], ids=str)
def test_no_import_climbs(path):
    own = room(path)
    assert own in FLOOR, f"{own} has no floor"
    for other in imported(path):
        assert FLOOR[other] <= FLOOR[own], f"{path.name} imports {other} from above"


def test_laws_and_fem_do_not_know_each_other():
    assert not [p for p in FILES if room(p) == "laws" and "fem" in imported(p)]
    assert not [p for p in FILES if room(p) == "fem" and "laws" in imported(p)]


def test_programs_never_see_a_mesh_or_a_scene():
    for path in FILES:
        if room(path) in ("programs", "coulomb"):
            assert not {"mesh", "scene", "fem"} & set(imported(path)), path


def test_studies_are_not_imported_by_the_library_nor_figures_by_studies():
    for path in FILES:
        assert "studies" not in path.read_text().split("import", 1)[-1].split()[:1]
    for path in (ROOT / "studies").glob("*.py"):
        names = {n.module for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.ImportFrom)}
        assert not any((name or "").startswith("paper_figs") for name in names)


def test_the_public_names_are_few_and_there():
    import bipot

    assert len(bipot.__all__) <= 25
    assert all(hasattr(bipot, name) for name in bipot.__all__)


def test_no_public_name_but_march_is_hidden_by_a_module():
    """Importing ``bipot.x`` sets ``bipot.x`` to the module. ``march`` escapes: ``bipot`` itself imports the module
    before it binds the function of that name, and a second import binds nothing."""
    import bipot

    modules = {path.stem for path in (ROOT / "bipot").iterdir()}
    assert modules & set(bipot.__all__) == {"march"}
    assert callable(bipot.march)
