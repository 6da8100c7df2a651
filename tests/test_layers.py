"""Imports go downwards only and in no circle. What belongs to a layout are the tables; the tests below know none."""

from pathlib import Path

import pytest

from tests.imports import circle, climbing, graph, imports, modules, reached, room, rooms

ROOT = Path(__file__).parents[1]

LAYERS = (
    ("errors",),
    ("basics", "hdf5", "schedule", "tensors", "typing"),
    ("conic", "laws", "meshes", "paths"),
    ("certificate", "coulomb", "tools"),
    ("fem", "programs"),
    ("scene",),
    ("contact",),
    ("state",),
    ("response",),
    ("borne",),
    ("advance", "system"),
    ("load_change", "past"),
    ("iterate",),
    ("checks", "limit_analysis", "traction", "yielding"),
    ("forms",),
    ("prediction",),
    ("increment",),
    ("energy",),
    ("control",),
    ("beside", "exchange", "marching", "results"),
    ("paper", "plot", "sensitivity", "transfer"),
    ("command",),
    ("__main__", "bipot"),
    ("studies",),
    ("benchmarks", "paper_figs"),
    ("tests",),
)
"""The rooms from below: each imports from its own layer and from those below it."""

IGNORANT = {"coulomb": {"fem", "meshes", "scene"}, "fem": {"laws", "scene"}, "programs": {"fem", "meshes", "scene"}}
"""Rooms that do not know others, though these are no higher: neither directly nor through what they import."""

OPTIONAL = {
    "PIL": {"plot"},
    "matplotlib": {"command", "plot"},
    "meshio": {"meshes"},
    "pandas": {"results"},
    "pyvista": set(),
    "qoco": {"conic"},
    "tqdm": set(),
    "vtk": set(),
}
"""Packages that the library can live without, and the rooms that import them."""


@pytest.fixture(scope="module")
def between():
    """What every module imports."""
    return graph(ROOT)


@pytest.fixture(scope="module")
def between_rooms(between):
    return rooms(between)


def test_every_room_has_one_place_in_the_table(between_rooms):
    assert sorted(name for layer in LAYERS for name in layer) == sorted(between_rooms)


def test_no_import_climbs(between_rooms):
    assert climbing(between_rooms, LAYERS) == []


def test_no_circle_of_modules_nor_of_rooms(between, between_rooms):
    assert circle(between) == []
    assert circle(between_rooms) == []


@pytest.mark.parametrize("own", IGNORANT)
def test_a_room_does_not_know_what_it_need_not(own, between_rooms):
    assert not IGNORANT[own] & reached(own, between_rooms)


def test_optional_packages_are_imported_where_they_are_used_alone():
    users = {package: set() for package in OPTIONAL}
    for name, path in modules(ROOT).items():
        if name.split(".")[0] == "bipot":
            for package in {found.split(".")[0] for found in imports(name, path)} & set(OPTIONAL):
                users[package].add(room(name))
    assert users == OPTIONAL


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
