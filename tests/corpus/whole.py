"""Damage to a file as a whole, whatever is in it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path


def cut(share: float) -> Callable[[Path], None]:
    """Keep so much of the file."""
    return lambda path: path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])


def other(content: bytes) -> Callable[[Path], None]:
    """Something else under its name."""
    return lambda path: path.write_bytes(content)


def missing(path: Path) -> None:
    path.unlink()


def directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


def pipe(path: Path) -> None:
    """Opened, it would wait for a writer for ever."""
    path.unlink()
    os.mkfifo(path)


def device(path: Path) -> None:
    """Read, it would never end."""
    path.unlink()
    path.symlink_to("/dev/zero")


def dangling(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.name)


DAMAGES = {
    "empty": other(b""),
    "text": other(b"m n nz p i x\n" * 100),
    "zeros": other(bytes(10_000)),
    "cut to a tenth": cut(0.1),
    "cut to a half": cut(0.5),
    "without its last tenth": cut(0.9),
    "missing": missing,
    "directory": directory,
    "pipe": pipe,
    "device": device,
    "link to itself": dangling,
}
