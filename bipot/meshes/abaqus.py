"""Input files of Abaqus through meshio, with what its reader does not know or confuses.

Types for plane strain, plane stress and revolution are replaced by those of plain shapes: they differ in mechanics
only, which a mesh does not contain.

Sets of elements are read here. Abaqus adds to a set wherever its name comes again, in ``*ELSET`` or in ``*ELEMENT``,
whatever its case, and takes sets into others by name. meshio's reader keeps the last part of a set, and may take
elements of another block for its own.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bipot.typing import Ints

PLAIN = {"3": "S3", "4": "S4", "6": "STRI65", "8": "S8R"}
"""A type of Abaqus that meshio knows, by the number of nodes of a plane element."""

PLANE = re.compile(r"(?im)^(\*ELEMENT\b[^\n]*\bTYPE\s*=\s*)C(?:PE|PS|PEG|AX)([3468])[A-Z]*\b")

INCLUDE = re.compile(r"(?im)^\*INCLUDE\b")

NAME = re.compile(r"(?i),\s*ELSET\s*=\s*([^,]*)")


def read(path: Path) -> Any:
    """The file as a mesh of meshio, its sets of elements as cells (n,) of each block.

    A file that includes others has no such sets: meshio does not say which blocks are theirs.
    """
    import meshio

    given = path.read_text(encoding="utf-8", errors="replace")
    plain = PLANE.sub(lambda found: found[1] + PLAIN[found[2]], given)
    included = INCLUDE.search(plain) is not None
    sets = Sets.of("" if included else plain)
    text = io.StringIO(plain if included else sets.rest)
    # Included files are relative to it.
    text.name = str(path)  # type: ignore[attr-defined]
    mesh = meshio.read(text, "abaqus")
    mesh.cell_sets = {} if included else sets.cells([len(block.data) for block in mesh.cells])
    return mesh


@dataclass
class Set:
    """A set of elements: its ``name``, numbers of ``elements``, of ``blocks`` of them, and names of ``others`` in it.

    Names of others are in lower case.
    """

    name: str
    elements: set[int] = field(default_factory=set)
    blocks: set[int] = field(default_factory=set)
    others: set[str] = field(default_factory=set)

    def add(self, line: str, ranges: bool) -> None:
        """Add what a line of data names: numbers, first, last and step of numbers if these are ``ranges``, or sets."""
        words = [word.strip() for word in line.split(",") if word.strip()]
        numbers = [int(word) for word in words if word.isdigit()]
        self.others.update(word.lower() for word in words if not word.isdigit())
        if ranges and numbers:
            first, last, *step = numbers
            numbers = range(first, last + 1, *step)
        self.elements.update(numbers)


@dataclass(frozen=True)
class Sets:
    """Sets of elements of a file by name in lower case, the data of its ``blocks`` of elements, and all ``rest``."""

    sets: dict[str, Set]
    blocks: list[list[str]]
    rest: str

    @staticmethod
    def of(text: str) -> Sets:
        """The sets of a file with this text; comments, which would end a set or a block for meshio, are left out."""
        found = Sets({}, [], "")
        lines, block, taking, ranges = list[str](), list[str](), None, False
        for line in text.splitlines():
            if line.startswith("**"):
                continue
            if line.startswith("*"):
                keyword, *options = (word.strip().upper() for word in line.split(","))
                named = NAME.search(line)
                one = found._named(named[1].strip()) if named and keyword in ("*ELSET", "*ELEMENT") else None
                taking, ranges = one if keyword == "*ELSET" else None, "GENERATE" in options
                block = list[str]()
                if keyword == "*ELEMENT":
                    line = NAME.sub("", line)
                    found.blocks.append(block)
                    if one is not None:
                        one.blocks.add(len(found.blocks) - 1)
            elif taking is not None:
                taking.add(line, ranges)
            else:
                block.append(line)
            if taking is None:
                lines.append(line)
        return Sets(found.sets, found.blocks, "\n".join([*lines, ""]))

    def cells(self, sizes: list[int]) -> dict[str, list[Ints]]:
        """The sets by name as cells (n,) of each block, of which there are so many."""
        numbers = [_numbers(block, size) for block, size in zip(self.blocks, sizes, strict=True)]
        every, starts = np.concatenate([*numbers, NONE]), np.cumsum([0, *sizes])
        block, cells = np.repeat(np.arange(len(sizes)), sizes), dict[str, list[Ints]]()
        for key, one in self.sets.items():
            parts = [self.sets[name] for name in self._within(key)]
            elements = np.array(sorted(set().union(*(part.elements for part in parts))), dtype=np.intp)
            blocks = np.array(sorted(set().union(*(part.blocks for part in parts))), dtype=np.intp)
            chosen = np.flatnonzero(np.isin(every, elements) | np.isin(block, blocks))
            split = np.split(chosen, np.searchsorted(chosen, starts[1:-1]))
            cells[one.name] = [part - start for part, start in zip(split, starts, strict=False)]
        return cells

    def _named(self, name: str) -> Set:
        """The set of a name, in any case; a new one where there is none yet."""
        return self.sets.setdefault(name.lower(), Set(name))

    def _within(self, key: str) -> set[str]:
        """The set ``key`` and all sets in it, and in these, that there are."""
        taken, new = set[str](), {key}
        while new:
            taken |= new
            new = set().union(*(self.sets[name].others for name in new)) & self.sets.keys() - taken
        return taken


def _numbers(block: list[str], size: int) -> Ints:
    """The numbers (n,) of a block's elements, each the first of its line or lines of data."""
    data = [int(word) for line in block for word in line.split(",") if word.strip()]
    return np.array(data, dtype=np.intp).reshape(size, -1)[:, 0] if size else NONE


NONE = np.empty(0, dtype=np.intp)
