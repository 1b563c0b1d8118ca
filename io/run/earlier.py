"""Outputs of earlier runs, which the same command may replace: trying again should not need --force each time.

What was written is remembered in a small file of the user's state folder: the output, its size and time, and the shapes
that it was made of. An output that has changed since, or that was made of other shapes, is not replaced.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..spec import path_of
from .job import Described, is_mesh

MOST_BYTES = 1 << 17
"""Of the file: when it is longer the older half is forgotten. An output takes about 300 bytes."""


def own_outputs(job: Described) -> set[str]:
    """Return those outputs of a job that are as an earlier run of the same shapes wrote them.

    Meshes have none: libraries and pictures that are written beside them have names that are not given.
    """
    there = [name for name in job.outputs if os.path.isfile(name)]
    if not there or any(map(is_mesh, job.output)):
        return set()
    known = _read()
    return {name for name in there if known.get(os.path.realpath(name)) == _entry(name, job)}


def remember(job: Described, names: Iterable[str]) -> None:
    """Note what a job has written. Where there is no place for that, nothing is noted."""
    with suppress(OSError):
        lines = [json.dumps([os.path.realpath(name), _entry(name, job)]) for name in names]
        place = _place()
        place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        old = place.read_bytes() if place.exists() and place.stat().st_size > MOST_BYTES else None
        with open(place, "ab") as file:
            if old is not None:
                file.truncate(0)
                file.write(old[len(old) // 2 :].partition(b"\n")[2])
            file.write("".join(line + "\n" for line in lines).encode())


def _entry(name: str, job: Described) -> list[Any]:
    """Return the state of an output, and the shapes of a job."""
    shapes = [getattr(job, key) for key in job.globbed if key != "texture"]
    state = os.stat(name)
    return [state.st_size, state.st_mtime_ns, [os.path.realpath(path_of(shape)) for shape in shapes if shape]]


def _read() -> dict[str, Any]:
    """Return the last entry of each output; lines that were cut short are ignored."""
    found = {}
    with suppress(OSError):
        for line in _place().read_bytes().splitlines():
            with suppress(ValueError, TypeError):
                name, entry = json.loads(line)
                found[name] = entry
    return found


def _place() -> Path:
    """Return the file in the folder for what programs keep: $XDG_STATE_HOME, or what the system has for it."""
    home = os.environ.get("LOCALAPPDATA") if os.name == "nt" else os.environ.get("XDG_STATE_HOME")
    return (Path(home) if home else Path.home() / ".local" / "state") / "iccm" / "outputs.jsonl"
