"""Abaqus files for a reader that knows fewer kinds of elements than Abaqus: kinds of one shape are one kind here."""

from __future__ import annotations

import io
import re
from pathlib import Path

PLAIN = {"3": "S3", "4": "S4", "6": "STRI65", "8": "S8R"}
"""Number of nodes of a plane element, and a kind of that shape that meshio knows."""

PLANE = re.compile(r"(?im)^(\*ELEMENT\b[^\n]*\bTYPE\s*=\s*)C(?:PE|PS|PEG|AX)([3468])[A-Z]*\b")


class Text(io.StringIO):
    """The text of a file, which still says where it is: other files may be included from there."""

    def __init__(self, text: str, path: Path) -> None:
        super().__init__(text)
        self.name = str(path)


def plain_types(path: Path) -> Text:
    """The file's text, solids of plane strain, plane stress and revolution under the names of plain shapes.

    They differ in mechanics, which no mesh holds.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    return Text(PLANE.sub(lambda found: found[1] + PLAIN[found[2]], text), path)
