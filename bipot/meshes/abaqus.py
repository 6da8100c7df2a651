"""Abaqus files for a reader that knows fewer element types than Abaqus: types of one shape are mapped to one type."""

from __future__ import annotations

import io
import re
from pathlib import Path

PLAIN = {"3": "S3", "4": "S4", "6": "STRI65", "8": "S8R"}
"""Number of nodes of a plane element, and a type of that shape that meshio knows."""

PLANE = re.compile(r"(?im)^(\*ELEMENT\b[^\n]*\bTYPE\s*=\s*)C(?:PE|PS|PEG|AX)([3468])[A-Z]*\b")


class Text(io.StringIO):
    """The text of a file with its path, relative to which other files may be included."""

    def __init__(self, text: str, path: Path) -> None:
        super().__init__(text)
        self.name = str(path)


def plain_types(path: Path) -> Text:
    """The file's text with types for plane strain, plane stress and revolution replaced by those of plain shapes.

    They differ in mechanics only, which a mesh does not contain.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    return Text(PLANE.sub(lambda found: found[1] + PLAIN[found[2]], text), path)
