"""Files that are there whole or not at all: written under another name in their folder, then renamed."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

from bipot.errors import BipotError


def replace(path: str | Path, content: bytes | memoryview, refuse: Callable[[str], BipotError]) -> None:
    """Make ``content`` all that the file holds; where that fails it keeps what it held.

    What makes a format makes it in memory: HDF5 that fails to write to a disk can end the interpreter.

    Raises:
        BipotError: what ``refuse`` makes of the message that ``path`` cannot be written.
    """
    try:
        # A link is kept, and what it leads to replaced.
        target = Path(os.path.realpath(path))
        if target.exists() and not (target.is_file() and os.access(target, os.W_OK)):
            raise refuse(f"{path} cannot be written: it is no file that may be")
        part = target.with_name(f".{uuid4().hex}.part")
        try:
            part.write_bytes(content)
            part.replace(target)
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)
    except (OSError, ValueError) as failure:
        # ValueError: a path with a null character.
        raise refuse(f"{path} cannot be written ({failure})") from failure
