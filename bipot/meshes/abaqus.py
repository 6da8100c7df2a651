"""Input files of Abaqus through meshio, with what its reader does not know or confuses.

Types for plane strain, plane stress and revolution are replaced by those of plain shapes: they differ in mechanics
only, which a mesh does not contain.

Sets of elements are whole: Abaqus adds to a set wherever its name comes again, in ``*ELSET`` or in ``*ELEMENT``, and
takes sets into others by name, whatever their case. meshio's reader keeps the last part, or takes the cells of another
block. It is therefore given sets with a number in place of the name, each once.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bipot.typing import Ints

PLAIN = {"3": "S3", "4": "S4", "6": "STRI65", "8": "S8R"}
"""A type of Abaqus that meshio knows, by the number of nodes of a plane element."""

PLANE = re.compile(r"(?im)^(\*ELEMENT\b[^\n]*\bTYPE\s*=\s*)C(?:PE|PS|PEG|AX)([3468])[A-Z]*\b")

INCLUDE = re.compile(r"(?im)^\*INCLUDE\b")

SET = re.compile(r"(?i),\s*ELSET\s*=\s*([^,]*)")

NONE = np.empty(0, dtype=np.intp)


def read(path: Path) -> Any:
    """The file as a mesh of meshio, its sets of elements as cells (n,) of each block.

    A file that includes others has no such sets: meshio does not say which blocks are theirs.
    """
    import meshio

    given = path.read_text(encoding="utf-8", errors="replace")
    plain = PLANE.sub(lambda found: found[1] + PLAIN[found[2]], given)
    included = INCLUDE.search(plain) is not None
    sets = Sets.of(plain)
    text = io.StringIO(plain if included else sets.text)
    # Included files are relative to it.
    text.name = str(path)  # type: ignore[attr-defined]
    mesh = meshio.read(text, "abaqus")
    mesh.cell_sets = {} if included else sets.whole(mesh.cell_sets, len(mesh.cells))
    return mesh


@dataclass(frozen=True)
class Sets:
    """Sets of elements of a file: its ``text`` with a number in place of each name, and without sets within sets.

    ``names`` are those of the numbers, "" for elements of no set. ``within`` has the names of the sets that one takes
    in. Names are compared in lower case.
    """

    text: str
    names: tuple[str, ...]
    within: Mapping[str, Sequence[str]]

    @staticmethod
    def of(text: str) -> Sets:
        """The sets of a file with this text; comments, at which meshio would end a set, are left out."""
        lines, names, within, taking = list[str](), list[str](), dict[str, list[str]](), ""
        for line in text.splitlines():
            if line.startswith("**"):
                continue
            words = [word.strip() for word in line.split(",")]
            keyword = words[0].upper()
            if line.startswith("*"):
                named = SET.search(line)
                name = named[1].strip() if named else ""
                taking = name if keyword == "*ELSET" else ""
                if keyword == "*ELEMENT" or taking:
                    line = f"{SET.sub('', line)}, ELSET={len(names)}"
                    names.append(name)
            elif taking and not keyword[:1].isdigit():
                within.setdefault(taking.lower(), []).extend(word.lower() for word in words if word)
                continue
            lines.append(line)
        return Sets("\n".join([*lines, ""]), tuple(names), within)

    def whole(self, parts: Mapping[str, Sequence[Ints]], count: int) -> dict[str, list[Ints]]:
        """The sets by name, of cells (n,) in each of ``count`` blocks, from ``parts`` by number."""
        found = {}
        for name in dict.fromkeys(filter(None, self.names)):
            taken, new = set[str](), {name.lower()}
            while new:
                taken |= new
                new = {other for one in new for other in self.within.get(one, ())} - taken
            own = [parts[str(k)] for k, other in enumerate(self.names) if other.lower() in taken and str(k) in parts]
            cells = [[blocks[k] for blocks in own if k < len(blocks)] for k in range(count)]
            found.setdefault(name.lower(), (name, [np.unique(np.concatenate([NONE, *some])) for some in cells]))
        return dict(found.values())
