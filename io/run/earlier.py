"""Outputs of earlier runs, which the same command may replace, so that repeating it does not need --force.

Written files are recorded in a small file in the user's state folder: the output, its size and time, and its input
shapes. An output is not replaced if it has changed since, or was made from other shapes.
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
"""Size at which the older half of the record is dropped. An output takes about 300 bytes."""


def own_outputs(job: Described) -> set[str]:
    """Return the outputs of a job that exist unchanged since an earlier run with the same shapes.

    Meshes are excluded, because libraries and pictures are written beside them under names that the user did not give.
    """
    existing = [name for name in job.outputs if os.path.isfile(name)]
    if not existing or any(map(is_mesh, job.output)):
        return set()
    entries = _read()
    return {name for name in existing if entries.get(os.path.realpath(name)) == _entry(name, job)}


def remember(job: Described, names: Iterable[str]) -> None:
    """Record the outputs that a job has written, if the record can be written."""
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
    """Return the last entry of each output; incomplete lines are ignored."""
    entries = {}
    with suppress(OSError):
        for line in _place().read_bytes().splitlines():
            with suppress(ValueError, TypeError):
                name, entry = json.loads(line)
                entries[name] = entry
    return entries


def _place() -> Path:
    """Return the file of the record in the folder for persistent state: $XDG_STATE_HOME, or the system's equivalent."""
    home = os.environ.get("LOCALAPPDATA") if os.name == "nt" else os.environ.get("XDG_STATE_HOME")
    return (Path(home) if home else Path.home() / ".local" / "state") / "iccm" / "outputs.jsonl"
