"""Files that are complete or absent: written under another name in their folder, then renamed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from bipot.errors import Refusal


@contextmanager
def replacing(path: str | Path, refuse: Refusal) -> Iterator[Path]:
    """A name in the same folder to write to, whose file takes the place of ``path`` when the block ends.

    A kill or a full disk leaves the previous file, or none. Formats are made in memory first, because HDF5 can crash
    the interpreter if it fails to write to a disk.

    Raises:
        BipotError: what ``refuse`` makes of the message that ``path`` cannot be written.
    """
    try:
        # A link is kept, and what it leads to replaced.
        target = Path(os.path.realpath(path))
        if target.exists() and not (target.is_file() and os.access(target, os.W_OK)):
            raise refuse(f"{path}: cannot be written (it is no file that may be)")
        part = target.with_name(f".{uuid4().hex}.part")
        try:
            yield part
            part.replace(target)
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)
    except OSError as failure:
        raise refuse(f"{path}: cannot be written ({failure.strerror or failure})") from failure
    except ValueError as failure:
        # Of a path with a null character.
        raise refuse(f"{path!r}: cannot be written ({failure})") from failure


def replace(path: str | Path, content: bytes, refuse: Refusal) -> None:
    """Make ``content`` all that the file holds, or raise as :func:`replacing` does."""
    with replacing(path, refuse) as part:
        part.write_bytes(content)
