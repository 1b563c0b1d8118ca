"""What leaves the page: constraints as JSON or drawn, the command that repeats the result, and what that writes."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...errors import InputError
from .. import files, formats
from ..run.execute import Outcome, run
from ..run.job import Job, make
from ..run.options import described
from ..run.report import plain
from ..shapes.shape import Shape
from ..spec import path_of
from . import drawn
from .messages import Scene
from .session import Session, stem

ANSWERED = ("pin", "constraints", "balance", "turn", "force", "output", "stmap", "size")
"""Fields of the job that the scene, or the page, says."""


def constraints_file(session: Session) -> str:
    """Where Save puts pins and strokes: into the file that they came from, else beside where iccm runs."""
    given = session.job.constraints
    return given if given and given != "-" else f"{stem(session.job)}.json"


def local(name: str) -> str:
    """A name that the page may write: of a file in the folder in which iccm runs.

    Raises:
        InputError: it names another folder, or what is hidden.
    """
    if (
        name != os.path.basename(name)
        or "\\" in name
        or name.startswith((".", "-"))
        or not name.isprintable()
    ):
        raise InputError(f"{name}: write the name of a file in this folder")
    return name


def listed(session: Session, scene: Scene) -> str:
    """The constraints as JSON, with the sizes of the shapes that they belong to."""
    sides = {"source": session.source, "target": session.target}
    files = {side: {"file": path_of(shape.spec), "size": _size(shape)} for side, shape in sides.items()}
    entries = {
        kind: [entry.model_dump(mode="json", exclude_defaults=True) for entry in getattr(scene, kind)]
        for kind in ("pins", "strokes")
    }
    lines = [f'  "files": {json.dumps(files, ensure_ascii=False)}']
    for kind, found in entries.items():
        rows = ",".join(f"\n    {json.dumps(plain(entry), ensure_ascii=False)}" for entry in found)
        lines.append(f'  "{kind}": [{rows}\n  ]' if found else f'  "{kind}": []')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _size(shape: Shape) -> list[float]:
    low, high = shape.box
    return [float(f"{side:.9g}") for side in ((high - low).real, (high - low).imag)]


def save(session: Session, scene: Scene, name: str, *, replace: bool) -> str:
    """Write the constraints, and give the name of the file.

    Raises:
        InputError: it cannot be written, or exists without `replace`.
    """
    known = name == constraints_file(session)
    name = name if known else local(name)
    if formats.suffix_of(name) != ".json":
        raise InputError(f"{name}: constraints are written as .json")
    if known and session.job.constraints == name:
        replace = True
    with files.replacing(name, force=replace) as path:
        path.write_text(listed(session, scene), encoding="utf-8")
    session.saved = scene
    return name


def copies(
    session: Session, scene: Scene, ending: str, folder: Path | None = None, *, replace: bool
) -> list[str]:
    """Write copies of both drawings with the constraints drawn in them; the specs of the shapes in them.

    Raises:
        InputError: a file is no SVG, a copy cannot be written, or exists without `replace`.
    """
    sides = (session.source, session.target)
    for shape in sides:
        if not shape.path.suffix.lower().startswith(".svg"):
            raise InputError(f"{shape.path}: pins are drawn in SVG files only; save the constraints as JSON")
    names = [str((folder or Path()) / local(f"{shape.path.stem}{ending}.svg")) for shape in sides]
    if names[0] == names[1]:
        raise InputError(f"{names[0]}: would be the copy of both; give one of the files another name")
    for name in names:
        files.check_output(name, force=replace)
    scene = named(scene)
    for side, name, shape in zip(("source", "target"), names, sides):
        pins = [(pin.name, _point(getattr(pin, side))) for pin in scene.pins]
        strokes = [(s.name, [_point(p) for p in getattr(s, side)]) for s in scene.strokes]
        low, high = shape.box
        data = drawn.copied(shape.path, pins, strokes, abs(high - low))
        with files.replacing(name, force=replace) as path:
            path.write_bytes(data)
            part = shape.spec[len(path_of(shape.spec)) :]
            drawn.check(path, f"{path}{part}", pins, [s.name for s in scene.strokes])
    return [name + shape.spec[len(path_of(shape.spec)) :] for name, shape in zip(names, sides)]


def named(scene: Scene) -> Scene:
    """The scene with a name for each pin and stroke, different from all others."""

    def all_named(entries: list[Any]) -> list[Any]:
        taken: set[str] = set()
        for number, entry in enumerate(entries, 1):
            name = entry.name or str(number)
            while name in taken:
                name += "'"
            taken.add(name)
            yield entry.model_copy(update={"name": name})

    return scene.model_copy(
        update={"pins": list(all_named(scene.pins)), "strokes": list(all_named(scene.strokes))}
    )


def _point(place: Any) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def job_of(session: Session, scene: Scene, **more: Any) -> Job:
    """The job whose result the page shows.

    Raises:
        InputError: as `make`.
    """
    given = session.job.model_dump(exclude_defaults=True, exclude=set(ANSWERED))
    return make({**given, "balance": scene.balance, "turn": scene.turn, **more})


def command(session: Session, scene: Scene, *, constraints: str = "", copies: list[str] | None = None) -> str:
    """The command line that repeats the result from what was saved."""
    specs = copies or [session.job.source, session.job.target or ""]
    job = job_of(session, scene)
    words = ["iccm", "map", *specs]
    fields = job.model_dump(exclude_defaults=True, exclude={"source", "target"})
    if session.job.size:
        fields["size"] = session.job.size
    for name, (_, option) in described().items():
        if name in fields and "map" in option.commands:
            value = fields[name]
            text = "x".join(map(str, value)) if isinstance(value, tuple) else f"{value}"
            words += [f"--{name.replace('_', '-')}", *([] if value is True else [text])]
    if constraints and (scene.pins or scene.strokes) and not copies:
        words += ["--constraints", constraints]
    words += ["-o", f"{stem(session.job)}.png"]
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


def export(session: Session, scene: Scene, name: str, size: int, *, replace: bool) -> Outcome:
    """Write a picture, an STMap or artwork by the code of `iccm map`.

    Raises:
        InputError: as that.
    """
    local(name)
    stmap = formats.suffix_of(name) == ".exr" and Path(name).stem.lower().endswith("stmap")
    output: dict[str, Any] = {"stmap": name} if stmap else {"output": (name,)}
    with _materialised(session, scene) as given:
        job = job_of(session, scene, **{"size": (size,), "force": replace, **output, **given})
        return run(job)


@contextmanager
def _materialised(session: Session, scene: Scene) -> Iterator[dict[str, Any]]:
    """Fields of a job whose constraints are the scene's, in files that last for the block."""
    with tempfile.TemporaryDirectory() as folder:
        if session.drawn:
            specs = copies(session, scene, "", Path(folder), replace=True)
            yield dict(zip(("source", "target"), specs))
        elif scene.pins or scene.strokes:
            path = Path(folder) / "constraints.json"
            path.write_text(listed(session, scene), encoding="utf-8")
            yield {"constraints": str(path)}
        else:
            yield {}
