"""Print the lowest versions that pyproject.toml allows, as constraints for pip: ``python .ci/lowest.py``."""

import re
import tomllib
from pathlib import Path

BELOW = re.compile(r"([A-Za-z0-9_.-]+)(?:\[[^]]*\])?>=([\w.]+)")


def constraints(project: dict) -> list[str]:
    """``name==version`` of every requirement that is pinned from below, all but the project's own extras.

    Raises:
        SystemExit: a requirement that is not.
    """
    asked = [*project["dependencies"], *(one for extra in project["optional-dependencies"].values() for one in extra)]
    found = []
    for requirement in asked:
        if re.fullmatch(rf"{project['name']}\[.*\]", requirement):
            continue
        if (pinned := BELOW.fullmatch(requirement)) is None:
            raise SystemExit(f"{requirement}: must be pinned from below, as name>=version")
        found.append("{}=={}".format(*pinned.groups()))
    return found


if __name__ == "__main__":
    with (Path(__file__).parents[1] / "pyproject.toml").open("rb") as file:
        print("\n".join(constraints(tomllib.load(file)["project"])))
