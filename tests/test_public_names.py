"""Public names are grouped by subject, and no module hides one."""

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import pytest

import bipot
from bipot.forms import OWN
from tests.imports import modules

MODULES = [name for name in modules(Path(__file__).parents[1]) if name.split(".")[0] == "bipot"]
PACKAGES = ["bipot", *(found.name for found in pkgutil.walk_packages(bipot.__path__, "bipot.") if found.ispkg)]

LONGEST = 12
"""Names in one group."""


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


def test_no_public_name_is_also_a_modules():
    also = {
        package: public(package) & {name.split(".")[-1] for name in MODULES if name.rpartition(".")[0] == package}
        for package in PACKAGES
    }
    assert {package: names for package, names in also.items() if names} == {}
