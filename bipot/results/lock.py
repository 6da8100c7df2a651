"""One writer per folder: a lock file that names its owner's host and process, and is valid while that process lives."""

from __future__ import annotations

import errno
import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bipot.errors import ResultsError

NAME = "run.lock"

LONGEST = 1000
"""Number of bytes of a lock that are read."""

_NO_LINK = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""Flags against links, whose targets would be overwritten, and pipes, which would block."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold ``folder`` for this process as long as the block runs.

    The system's own lock on the file tells whether an owner on this host still lives, even if its number was reused;
    the lock of a dead one is taken over. Nothing is known of an owner on another host, so its lock stays until it is
    deleted.

    Raises:
        ResultsError: another process writes there, or may; the message names its host and number.
        OSError: the lock cannot be written.
    """
    path, process = folder / NAME, os.getpid()
    while (descriptor := _taken(path)) is None:
        pass
    try:
        yield
    finally:
        # Deleted while it is held, so that whoever waits for it then finds another file under its name; but not by a
        # forked copy of this process.
        with suppress(OSError):
            if process == os.getpid() and os.path.samestat(os.stat(path), os.fstat(descriptor)):
                path.unlink()
        os.close(descriptor)


def _taken(path: Path) -> int | None:
    """The open lock file, now owned by this process; None if its last owner has just deleted it."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | _NO_LINK, 0o666)
    try:
        owner = _owner(os.read(descriptor, LONGEST))
        alive = not _locks(descriptor)
        if alive or (owner and owner.get("host") != socket.gethostname()):
            raise ResultsError(f"{path.parent}: {_refusal(owner, path, alive=alive)}")
        with suppress(FileNotFoundError):
            if os.path.samestat(os.stat(path), os.fstat(descriptor)):
                os.ftruncate(descriptor, 0)
                os.lseek(descriptor, 0, os.SEEK_SET)
                os.write(descriptor, json.dumps({"host": socket.gethostname(), "process": os.getpid()}).encode())
                return descriptor
    except BaseException:
        os.close(descriptor)
        raise
    os.close(descriptor)
    return None


def _owner(text: bytes) -> dict[str, Any]:
    """Host and process named in a lock; empty if it names none."""
    with suppress(ValueError, RecursionError):
        found = json.loads(text)
        if isinstance(found, dict):
            return found
    return {}


def _locks(descriptor: int) -> bool:
    """Take the system's lock of an open file: False if another process has it, True also if there are no locks."""
    try:
        if find_spec("fcntl"):
            fcntl: Any = import_module("fcntl")
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            msvcrt: Any = import_module("msvcrt")
            # Locks a byte behind the text, which others may still read.
            os.lseek(descriptor, LONGEST, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        # File systems without locks give other errors.
        return error.errno not in (errno.EAGAIN, errno.EACCES, errno.EDEADLK)
    return True


def _refusal(owner: dict[str, Any], path: Path, *, alive: bool) -> str:
    who = f"process {owner.get('process', 'unknown')} on {owner.get('host', 'an unknown host')}"
    if alive:
        return f"{who} is writing a run there; wait for its end, or choose another folder"
    return f"{who} may be writing a run there; if it has ended, delete {path}"
