"""Every example in a docstring gives what it says."""

import doctest
import importlib
import pkgutil

import pytest

import bipot

MODULES = [found.name for found in pkgutil.walk_packages(bipot.__path__, "bipot.")]


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_there_are_examples():
    finder = doctest.DocTestFinder(exclude_empty=True)
    assert sum(len(test.examples) for name in MODULES for test in finder.find(importlib.import_module(name))) > 40
