"""What the suite leaves to `make check-long` is there, and one case of each test that is thinned stays."""

import ast
from pathlib import Path

import pytest

from tests.conftest import pytest_collection_modifyitems as thin
from tests.thinned import THINNED

HERE = Path(__file__).parent


class Item:
    """A case as the hook sees it."""

    def __init__(self, module, name, *marks):
        self.path, self.originalname, self.marks = HERE / f"{module}.py", name, list(marks)

    def get_closest_marker(self, mark):
        return mark if mark in self.marks else None

    def add_marker(self, mark):
        self.marks.append(mark)


@pytest.mark.parametrize("module", sorted({name.split("::")[0] for name in THINNED}))
def test_every_test_named_is_there_with_cases(module):
    tree = ast.parse((HERE / f"{module}.py").read_text(encoding="utf-8"))
    decorated = {node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.decorator_list}
    assert {test for of, test in (name.split("::") for name in THINNED) if of == module} <= decorated


def test_the_first_case_and_every_nth_after_it_stay():
    for named, every in THINNED.items():
        module, name = named.split("::")
        cases = [Item(module, name, *["slow"] * (k == 1)) for k in range(3 * every + 1)]
        others = [Item(module, "test_another"), Item("test_none", name)]
        thin([*others, *cases])
        left = [case for case in cases if "slow" not in case.marks]
        assert every > 1
        assert left == [case for k, case in enumerate([cases[0], *cases[2:]]) if k % every == 0]
        assert not any(other.marks for other in others)
