"""Imports go downwards only and in no circle; public names are grouped by subject, and no module hides one.

A room is a module or package directly below ``bipot``, or another package of the repository. What belongs to a layout
are the tables; the tests below them know none.
"""

import ast
import importlib
import inspect
import pkgutil
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import bipot
from bipot.forms import OWN

ROOT = Path(__file__).parents[1]

LAYERS = (
    ("errors", "frozen", "machine", "progress", "replacing", "tensors", "typing", "undisturbed"),
    (
        "abaqus",
        "cells",
        "circle",
        "conic",
        "driving",
        "elements",
        "extrusion",
        "facets",
        "hdf5",
        "laws",
        "layout",
        "meeting",
        "mesh",
        "mesh_files",
        "paths",
        "poses",
        "profiles",
        "reflection",
        "revolved",
        "sections",
        "slips",
        "solids",
        "surfaces",
        "tools",
        "ways",
    ),
    ("certificate", "coulomb", "fem"),
    (
        "between",
        "between_faces",
        "components",
        "drives",
        "fitting",
        "holding",
        "loads",
        "programs",
        "sampling",
        "scene",
        "schedule",
        "supports",
        "symmetry",
    ),
    ("closeness", "contact", "coupling", "mobility", "operators", "overlap", "response", "shear", "system"),
    (
        "advance",
        "determinacy",
        "diagnosis",
        "examined",
        "forms",
        "increment",
        "iterate",
        "limit_analysis",
        "reason",
        "refusals",
        "supported",
        "traction",
    ),
    ("accepted", "carrying", "course", "energy", "failing", "landing", "marching", "pacing", "starting"),
    ("columns", "exchange", "paper"),
    ("results",),
    ("plot",),
    ("command",),
    ("bipot",),
    ("studies",),
    ("benchmarks", "paper_figs"),
    ("tests",),
)
"""The rooms from below: each imports from its own layer and from those below it."""

IGNORANT = {"coulomb": {"fem", "mesh", "scene"}, "fem": {"laws"}, "programs": {"fem", "mesh", "scene"}}
"""Rooms that do not know others, though these are no higher: neither directly nor through what they import."""

OPTIONAL = {
    "PIL": {"plot"},
    "matplotlib": {"command", "plot"},
    "meshio": {"mesh_files"},
    "pandas": {"results"},
    "pyvista": set(),
    "qoco": {"conic"},
    "tqdm": set(),
    "vtk": set(),
}
"""Packages that the library can live without, and the rooms that import them."""

HIDDEN = {"bipot.coulomb": {"existence", "solve"}}
"""Public names that are also a module's, package by package: to be mended; none may be added, none kept that is."""

LONGEST = 12
"""Names in one group."""


def modules(root):
    """Dotted name -> path of every module of the repository's packages below ``root``."""
    found = {}
    for path in sorted(root.glob("*/**/*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        if (root / parts[0] / "__init__.py").is_file():
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(name, path):
    """Dotted names of what the module imports, anywhere in it: of modules or of names in them."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            yield from (f"{source}.{alias.name}" for alias in node.names)


def graph(root):
    """Module -> modules of the repository that it imports, each the longest one that is named."""
    known = modules(root)
    found = {}
    for name, path in known.items():
        named = [whole.split(".") for whole in imports(name, path)]
        places = [[".".join(parts[:k]) for k in range(len(parts), 0, -1)] for parts in named]
        found[name] = {next(place for place in ways if place in known) for ways in places if ways[-1] in known}
    return found


def room(module):
    """The part of a module's name that the tables know."""
    package, *below = module.split(".")
    return below[0] if package == "bipot" and below else package


def rooms(between):
    """Room -> other rooms that it imports."""
    found = {room(module): set() for module in between}
    for module, others in between.items():
        found[room(module)] |= {room(other) for other in others} - {room(module)}
    return found


def reached(start, links):
    """What ``start`` imports, directly or not."""
    found, ahead = set(), [start]
    while ahead:
        new = links[ahead.pop()] - found
        found |= new
        ahead += new
    return found


def climbing(links, layers):
    """Imports (room, other) from a higher layer."""
    floor = {name: k for k, names in enumerate(layers) for name in names}
    return sorted((own, other) for own, others in links.items() for other in others if floor[other] > floor[own])


def circle(links):
    """A circle of imports, empty where there is none."""
    try:
        TopologicalSorter(links).prepare()
    except CycleError as found:
        return found.args[1]
    return []


GRAPH = graph(ROOT)
ROOMS = rooms(GRAPH)
PACKAGES = ["bipot", *(found.name for found in pkgutil.walk_packages(bipot.__path__, "bipot.") if found.ispkg)]


def test_every_room_has_one_place_in_the_table():
    assert sorted(name for layer in LAYERS for name in layer) == sorted(ROOMS)


def test_no_import_climbs():
    assert climbing(ROOMS, LAYERS) == []


def test_no_circle_of_modules_nor_of_rooms():
    assert circle(GRAPH) == []
    assert circle(ROOMS) == []


@pytest.mark.parametrize("own", IGNORANT)
def test_a_room_does_not_know_what_it_need_not(own):
    assert not IGNORANT[own] & reached(own, ROOMS)


def test_optional_packages_are_imported_where_they_are_used_alone():
    for package, allowed in OPTIONAL.items():
        users = {
            room(name)
            for name, path in modules(ROOT).items()
            if name.split(".")[0] == "bipot" and any(found.split(".")[0] == package for found in imports(name, path))
        }
        assert users == allowed, package


def grouped(doc):
    """Subject -> public names, from the lines ``* subject: Name, Name`` of a docstring, which may be broken."""
    lines = re.findall(r"^\* ([^:\n]+): ((?:.+\n?)+?)(?=\*|\n|\Z)", inspect.cleandoc(doc), re.MULTILINE)
    return {subject: re.findall(r"\w+", names) for subject, names in lines}


def test_public_names_are_grouped_by_subject_each_once():
    groups = grouped(bipot.__doc__)
    assert sorted(name for names in groups.values() for name in names) == sorted(bipot.__all__)
    assert all(1 <= len(names) <= LONGEST for names in groups.values())


def test_every_error_form_and_hardening_is_public():
    """What a control, a material or an ``except`` may name."""
    named = {kind.__name__ for kind in OWN}
    for module in ("errors", "laws.hardening"):
        found = importlib.import_module(f"bipot.{module}")
        own = [kind for kind in vars(found).values() if inspect.isclass(kind) and kind.__module__ == found.__name__]
        named |= {kind.__name__ for kind in own}
    assert named - set(bipot.__all__) == set()


def public(package):
    """Public names of a package: the listed ones, or what its code binds."""
    module = importlib.import_module(package)
    return set(
        getattr(module, "__all__", {n for n, v in vars(module).items() if n[0] != "_" and not inspect.ismodule(v)})
    )


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_are_there_and_no_modules(package):
    """Importing ``bipot.x`` sets ``bipot.x`` to the module, so every module is imported before it is looked."""
    for found in pkgutil.walk_packages(bipot.__path__, "bipot."):
        importlib.import_module(found.name)
    module = importlib.import_module(package)
    assert [name for name in sorted(public(package)) if inspect.ismodule(getattr(module, name))] == []


def test_no_public_name_but_the_known_ones_is_also_a_modules():
    also = {
        package: public(package) & {name.split(".")[-1] for name in GRAPH if name.rpartition(".")[0] == package}
        for package in PACKAGES
    }
    assert {package: names for package, names in also.items() if names} == HIDDEN


@pytest.fixture
def planted(tmp_path):
    """A package ``low`` with a module in a folder, and one ``high``; both import in every way there is."""
    texts = {
        "low/__init__.py": "",
        "low/deep/__init__.py": "from . import a\n",
        "low/deep/a.py": "from .b import f\nfrom ..c import g\n",
        "low/deep/b.py": "import numpy.linalg\n",
        "low/c.py": "def f():\n    import high.d\n",
        "high/__init__.py": "from low import c\n",
        "high/d.py": "from low.deep.a import f as g\n",
        "no_package/e.py": "import low\n",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return graph(tmp_path)


def test_every_kind_of_import_is_seen(planted):
    assert planted == {
        "low": set(),
        "low.deep": {"low.deep.a"},
        "low.deep.a": {"low.deep.b", "low.c"},
        "low.deep.b": set(),
        "low.c": {"high.d"},
        "high": {"low.c"},
        "high.d": {"low.deep.a"},
    }


def test_what_climbs_and_what_goes_in_a_circle_is_found(planted):
    links = rooms(planted)
    assert climbing(links, (("low",), ("high",))) == [("low", "high")]
    assert set(circle(planted)) == {"high.d", "low.deep.a", "low.c"}
    assert set(circle(links)) == {"low", "high"}
    assert reached("low.deep", planted) == {"low.deep.a", "low.deep.b", "low.c", "high.d"}
