"""The files that inputs name in turn: an OBJ's material libraries and their pictures, a glTF's buffers and images."""

from __future__ import annotations

import json
import mmap
import re
from pathlib import Path

from .job import Job

MAX_BYTES = 1 << 26


def inputs(job: Job) -> tuple[str, ...]:
    """Every file that a job reads, those that its meshes name included; only those that exist."""
    found = list(job.inputs)
    for name in job.inputs:
        found += [path for path in _named(Path(name)) if Path(path).is_file()]
    return tuple(dict.fromkeys(found))


def _named(path: Path) -> list[str]:
    try:
        suffix = path.suffix.lower()
        return _of_obj(path) if suffix == ".obj" else _of_gltf(path) if suffix == ".gltf" else []
    except OSError:
        return []


def _of_obj(path: Path) -> list[str]:
    if not path.stat().st_size:
        return []
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        lines = [match[1] for match in re.finditer(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", content, re.MULTILINE)]
    libraries = [_beside(path, line) for line in lines]
    return [name for library in libraries for name in (library, *_pictures(Path(library)))]


def _pictures(library: Path) -> list[str]:
    """The last word of each map of a material library, and all its words: names may hold spaces."""
    if not library.is_file() or library.stat().st_size > MAX_BYTES:
        return []
    lines = re.findall(
        rb"^[ \t]*(?:map_\w+|bump|norm|disp|decal)[ \t]+([^\r\n]+)", library.read_bytes(), re.M | re.I
    )
    return [_beside(library, name) for line in lines for name in (line, line.split()[-1])]


def _of_gltf(path: Path) -> list[str]:
    if path.stat().st_size > MAX_BYTES:
        return []
    try:
        scene = json.loads(path.read_bytes())
        names = [item["uri"] for key in ("buffers", "images") for item in scene.get(key, []) if "uri" in item]
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return []
    return [
        str(path.parent / name) for name in names if isinstance(name, str) and not name.startswith("data:")
    ]


def _beside(path: Path, name: bytes) -> str:
    return str(path.parent / name.strip().replace(b"\0", b"").decode("utf-8", "surrogateescape"))
