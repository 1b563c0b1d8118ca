"""Start the process that reads a file with a library in native code, limit it, and return what it sends."""

from __future__ import annotations

import inspect
import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from .. import files, limits
from . import program

UNINITIALISED_BYTE = 0xA5
"""Value of bytes that a library did not set: indices made of them are out of range in every run (glibc)."""


def read(
    path: str | Path, reader: Callable[..., Any], /, *, beside: Sequence[Path] = (), **arguments: Any
) -> Any:
    """Read a file by a function in a separate process.

    A crash, a hang and an unlimited need of memory end that process alone. It costs the start of an interpreter
    with NumPy, 0.1 seconds of the processor, and the library is not imported here.

    Args:
        path: the file.
        reader: the function, in a module that imports nothing of iccm besides `program.Damaged`, and libraries only
            inside of functions.
        beside: further files that the function reads, if they exist: they count for the limits.
        arguments: passed to it besides the path.

    Returns:
        The result of the function, with its arrays.

    Raises:
        InputError: the file is missing, wrong, or too much for the limits.
    """
    size = files.open_input(path).stat().st_size + sum(
        more.stat().st_size for more in beside if more.is_file()
    )
    seconds = math.ceil(limits.READER_SECONDS + limits.READER_SECONDS_PER_MEGABYTE * size / 1e6)
    memory = limits.READER_BYTES + limits.READER_BYTES_RATIO * size
    values = json.dumps({"path": os.path.abspath(files.as_text(path)), **arguments})
    limited = [str(seconds), str(memory), values]
    command = [sys.executable, "-P", program.__file__, inspect.getfile(reader), reader.__name__, *limited]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    environment["MALLOC_PERTURB_"] = str(UNINITIALISED_BYTE ^ 0xFF)  # glibc sets the complement
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=limits.READER_WALL_TIME_RATIO * seconds,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"{path}: damaged, or too complicated: reading it took too long") from None
    header, line_end, data = done.stdout.partition(b"\n")
    if not line_end:
        raise InputError(f"{path}: damaged, or too complicated: its reader {_fate(done.returncode)}")
    message = json.loads(header)
    if "missing" in message:
        raise InputError(f"{path}: cannot be read: {message['missing']}")
    if "error" in message:
        raise InputError(f"{path}: {message['error']}")
    arrays, position = [], 0
    for form in message["arrays"]:
        dtype, shape = np.dtype(form["dtype"]), form["shape"]
        count = math.prod(shape)
        if position + dtype.itemsize * count > len(data):
            raise InputError(f"{path}: damaged, or too complicated: its reader {_fate(done.returncode)}")
        arrays.append(np.frombuffer(data, dtype, count, position).reshape(shape).copy())
        position += dtype.itemsize * count
    return _unpack(message["values"], arrays)


def _fate(code: int) -> str:
    """Return how the process ended, for a message."""
    import signal

    if code >= 0:
        return f"ended with code {code}"
    if -code == getattr(signal, "SIGXCPU", 0):
        return "took too long"
    return f"was ended by {signal.Signals(-code).name}"


def _unpack(value: Any, arrays: list[Any]) -> Any:
    """Return a value with arrays in place of {"array": number}."""
    if isinstance(value, dict):
        if value.keys() == {"array"}:
            return arrays[value["array"]]
        return {key: _unpack(item, arrays) for key, item in value.items()}
    if isinstance(value, list):
        return [_unpack(item, arrays) for item in value]
    return value
