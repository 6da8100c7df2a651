"""What is shipped: the wheel has the library, its types and its metadata; the sdist all that its own tests read."""

import importlib
import os
import re
import subprocess
import sys
import tarfile
import tomllib
from configparser import ConfigParser
from email.parser import Parser
from pathlib import Path
from zipfile import ZipFile

import pytest

import bipot

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = {"qoco", "mesh", "studies", "dask", "dev"}


def built(target, folder):
    """The one file that the build backend makes, without a network."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (path,) = folder.iterdir()
    return path


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Contents of the wheel by name."""
    with ZipFile(built("wheel", tmp_path_factory.mktemp("wheel"))) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def of_wheel(wheel, name):
    """A file of its metadata, which are in one folder."""
    (found,) = [content for path, content in wheel.items() if re.fullmatch(rf"[^/]+\.dist-info/{name}", path)]
    return found.decode()


def test_the_wheel_has_the_whole_library_with_its_types_and_nothing_else(wheel):
    sources = {
        path.relative_to(ROOT).as_posix(): path.read_bytes()
        for path in (ROOT / "bipot").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert "bipot/py.typed" in sources
    assert {name: content for name, content in wheel.items() if ".dist-info/" not in name} == sources


def test_the_wheel_says_what_it_is_and_needs(wheel):
    told = Parser().parsestr(of_wheel(wheel, "METADATA"))
    assert (told["Name"], told["Version"]) == ("bipot", bipot.__version__)
    assert told["Requires-Python"] == PROJECT["requires-python"]
    assert told["License-Expression"] == "BSD-3-Clause"
    assert set(told.get_all("Classifier")) == set(PROJECT["classifiers"])
    assert set(told.get_all("Provides-Extra")) >= EXTRAS
    needed = [one for one in told.get_all("Requires-Dist") if "extra ==" not in one]
    assert sorted(needed) == sorted(PROJECT["dependencies"])
    assert "BSD" in of_wheel(wheel, "licenses/LICENSE")


def test_the_wheels_commands_are_the_projects_and_can_be_called(wheel):
    asked = PROJECT.get("scripts", {})
    if not asked:
        assert not [name for name in wheel if name.endswith("entry_points.txt")]
        return
    (told := ConfigParser()).read_string(of_wheel(wheel, "entry_points.txt"))
    assert dict(told["console_scripts"]) == asked
    for target in asked.values():
        module, _, name = target.partition(":")
        assert f"{module.replace('.', '/')}.py" in wheel
        assert callable(getattr(importlib.import_module(module), name))


def lowest():
    """The script that makes constraints."""
    path = ROOT / ".ci" / "lowest.py"
    spec = importlib.util.spec_from_file_location("lowest", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_requirement_is_pinned_from_below_and_is_tested_there():
    pins = lowest().constraints(PROJECT)
    names = [pin.partition("==")[0] for pin in pins]
    assert len(names) == len(set(names))
    assert {re.split(r"[\[>]", one)[0] for one in PROJECT["dependencies"]} <= set(names)
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "-c $(LOWEST)/lowest.txt" in recipe


@pytest.mark.parametrize("requirement", ["numpy", "numpy<3", "numpy~=2.0", "numpy>=2,<3"])
def test_a_requirement_that_is_not_is_refused(requirement):
    project = {"name": "bipot", "dependencies": [requirement], "optional-dependencies": {}}
    with pytest.raises(SystemExit, match="must be pinned from below"):
        lowest().constraints(project)


def tracked():
    """Files of the repository; none where this is no checkout."""
    if not (ROOT / ".git").exists():
        pytest.skip("no checkout of the repository")
    told = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return set(told.splitlines())


def test_the_sdist_is_asked_for_all_of_the_repository():
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
    asked = {name.removeprefix("/") for name in build["targets"]["sdist"]["include"]} | {"pyproject.toml"}
    assert {name.partition("/")[0] for name in tracked()} == asked


@pytest.mark.slow
def test_the_sdist_tests_itself_in_an_empty_folder(tmp_path):
    """All tests can be collected there, and those run that look at files, with the library of the folder."""
    with tarfile.open(built("sdist", tmp_path / "dist")) as archive:
        # Filters of members came with Python 3.11.4; this archive is our own.
        archive.extractall(tmp_path, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
    (folder,) = tmp_path.glob("bipot-*")
    if (ROOT / ".git").exists():
        there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
        assert tracked() <= there
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def said(*command):
        done = subprocess.run([sys.executable, *command], cwd=folder, env=alone, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    assert said("-c", "import bipot; print(bipot.__file__)").startswith(str(folder))
    assert "error" not in said("-m", "pytest", "--collect-only", "-q").splitlines()[-1]
    chosen = ("readme", "layers", "package", "conic_set", "coulomb_study", "program_files")
    said("-m", "pytest", "-m", "not serial and not slow", *(f"tests/test_{name}.py" for name in chosen))
