"""A reader in a process of its own, for files that may be crafted to crash it.

HDF5 opens a dataset by its header before Python can check anything, and some headers, which no writer makes, crash the
process or block it for ever. Another process costs about the import of this library.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from bipot.errors import BipotError, Refusal

SECONDS = 60.0
"""Time after which reading a file counts as blocked."""


def isolated(reader: str, path: str | Path, refuse: Refusal, *, seconds: float = SECONDS, **options: Any) -> Any:
    """The result of ``reader``, ``"module:function"``, for the path and the options, or the error that it raises.

    Raises:
        BipotError: that of the reader, or of ``refuse`` with the message that reading crashed or took too long.
    """
    command = [sys.executable, "-c", f"from {__name__} import serve; serve({reader!r})"]
    # The same packages as here, wherever they were found.
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    request = pickle.dumps((path, options))
    try:
        done = subprocess.run(command, input=request, capture_output=True, timeout=seconds, env=environment)
    except subprocess.TimeoutExpired as failure:
        raise refuse(f"{path}: reading it takes more than {seconds:g} s, and was stopped") from failure
    if done.returncode:
        raise refuse(f"{path}: reading it ended its process, exit code {done.returncode}: HDF5 cannot read it")
    answer = pickle.loads(done.stdout)
    if isinstance(answer, BipotError):
        raise answer
    return answer


def serve(reader: str) -> None:
    """The other process: write the reader's result for the request in standard input, or its error."""
    module, function = reader.split(":")
    path, options = pickle.load(sys.stdin.buffer)
    try:
        answer = getattr(import_module(module), function)(path, **options)
    except BipotError as error:
        answer = error
    sys.stdout.buffer.write(pickle.dumps(answer))
