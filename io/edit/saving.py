"""Saving from the page: constraints as JSON or drawn, the command line, and exported files."""

from __future__ import annotations

import io
import os
import shlex
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ...errors import InputError
from .. import files, formats
from ..options import options_of
from ..point_syntax import vertex_of
from ..run.constraints import constraints_text
from ..run.execute import Outcome, run
from ..run.job import Job, make
from ..shapes.shape import Shape
from ..spec import path_of
from . import drawn
from .map_update import figures
from .messages import Scene
from .session import Session

ANSWERED = ("pin", "constraints", "balance", "turn", "fit", "force", "output", "stmap", "size")
"""Fields of the job that are set by the scene or the page."""


def stem(job: Job) -> str:
    """Return the stem of the file names of a pair."""
    names = [Path(spec.partition("#")[0]).stem for spec in (job.source, job.target) if spec]
    return "-".join(names if job.target else [*names, "deformed"])


def constraints_file(session: Session) -> str:
    """Return the file that Save writes: the one that the constraints came from, else one in the current folder."""
    path = session.pair.job.constraints
    return path if path and path != "-" else f"{stem(session.pair.job)}.json"


ENDING = "-pins"
"""Suffix of the names of copies, unless the user chooses another."""


def local(name: str) -> str:
    """Check a file name from the page: only files in the current folder may be written.

    Raises:
        InputError: it names another folder or a hidden file.
    """
    if (
        name != os.path.basename(name)
        or "\\" in name
        or name.startswith((".", "-"))
        or not name.isprintable()
    ):
        raise InputError(f"{name}: enter the name of a file in this folder")
    return name


def constraints_json(session: Session, scene: Scene, listed: dict[str, list[Any]] | None = None) -> str:
    """Return the constraints as JSON, with the sizes of their shapes and the map to continue from.

    Args:
        session: the pair.
        scene: all constraints; the map to continue from belongs to them.
        listed: the pins and strokes to write; None for all.
    """
    sides = (session.pair.source,) if session.pair.deforming else _sides(session)
    listed = {"pins": scene.pins, "strokes": scene.strokes} if listed is None else listed
    regions = {"rigid": scene.rigid} if scene.rigid else {}
    return constraints_text(sides, listed | regions, session.start(scene))


def save(session: Session, scene: Scene, name: str, *, replace: bool) -> str:
    """Write the constraints, and return the name of the file.

    Raises:
        InputError: the file cannot be written, or exists without `replace`.
    """
    if session.pair.drawn:
        raise InputError(
            f"{session.pair.source.path}: the drawing already contains pins; write copies of the drawings instead"
        )
    name = name if name == session.pair.job.constraints else local(name)
    if formats.suffix_of(name) != ".json":
        raise InputError(f"{name}: pins and strokes are saved as .json; choose such a name")
    files.write_bytes(name, constraints_json(session, scene).encode(), force=replace)
    session.saved = scene
    session.written.add(name)
    session.note_files(scene, {"constraints": name})
    return name


def copy_names(session: Session, ending: str) -> list[str]:
    """Return the names of the copies of both drawings, and of the file beside them that holds the map to continue from.

    Raises:
        InputError: one is not an SVG, or both copies would have the same name.
    """
    if session.pair.deforming:
        raise InputError("the pins of a deformation can only be saved as JSON; use Save")
    paths = [shape.path for shape in _sides(session)]
    for path in paths:
        if formats.suffix_of(path) not in (".svg", ".svgz"):
            raise InputError(f"{path}: pins can only be drawn into SVG files; save them as JSON")
    names = [local(f"{path.stem}{ending}.svg") for path in paths]
    if names[0] == names[1]:
        raise InputError(f"{names[0]}: both copies would have this name; rename one of the files")
    return [*names, local(f"{stem(session.pair.job)}{ending}.json")]


def copies(session: Session, scene: Scene, names: list[str], *, replace: bool) -> dict[str, str]:
    """Write copies of both drawings with the constraints drawn into them, and a file with what cannot be drawn.

    Returns:
        The fields of a job that name the files written.

    Raises:
        InputError: a drawing cannot be changed in this way, or a copy cannot be written, or exists without `replace`.
    """
    scene = with_names(scene)
    with_settings = [pin for pin in scene.pins if pin.settings]
    drawn_pins = [pin for pin in scene.pins if not pin.settings]
    listed = ""
    if _needs_list(session, scene):
        listed = constraints_json(session, scene, {"pins": with_settings} if with_settings else {})
    specs = {}
    with ExitStack() as stack:  # all files appear, or none
        for side, name, shape in zip(("source", "target"), names, _sides(session)):
            pins = [(pin.name, _point(getattr(pin, side))) for pin in drawn_pins]
            strokes = [(s.name, [_point(place) for place in getattr(s, side)]) for s in scene.strokes]
            path = stack.enter_context(files.replacing(name, force=replace))
            path.write_bytes(drawn.copy_with(shape, pins, strokes))
            drawn.check(_spec(str(path), shape), shape, pins, strokes)
            specs[side] = _spec(name, shape)
        if listed:
            specs["constraints"] = names[2]
            path = stack.enter_context(files.replacing(names[2], force=replace))
            path.write_text(listed, encoding="utf-8")
    session.written.update(names[: len(specs)])
    return specs


def _needs_list(session: Session, scene: Scene) -> bool:
    """Return whether a file beside the copies is needed for what cannot be drawn: the map to continue from, rigid
    regions, and pins with settings.
    """
    has_settings = any(pin.settings for pin in scene.pins)
    return has_settings or bool(scene.rigid) or session.start(scene) is not None


def _sides(session: Session) -> tuple[Shape, Shape]:
    return session.pair.source, session.pair.target


def _spec(name: str, shape: Shape) -> str:
    """Return the spec of the same part in another file."""
    return name + shape.spec[len(path_of(shape.spec)) :]


def with_names(scene: Scene) -> Scene:
    """Return the scene with a unique name for each pin and stroke."""

    def all_named(entries: list[Any]) -> Iterator[Any]:
        used: set[str] = set()
        for number, entry in enumerate(entries, 1):
            name = entry.name or str(number)
            while name in used:
                name += "'"
            used.add(name)
            yield entry.model_copy(update={"name": name})

    return scene.model_copy(
        update={"pins": list(all_named(scene.pins)), "strokes": list(all_named(scene.strokes))}
    )


def _point(place: Any) -> tuple[float, float]:
    if vertex_of(place) is not None or len(place) != 2:
        raise InputError("pins at vertices of a mesh or in space cannot be drawn; save them as JSON")
    return float(place[0]), float(place[1])


def job_of(session: Session, scene: Scene, **overrides: Any) -> Job:
    """Return the job whose result the page shows.

    Raises:
        InputError: as `make`.
    """
    values = session.pair.job.model_dump(exclude_defaults=True, exclude=set(ANSWERED))
    # the default, without the option
    plain = scene.fit == "auto" or (scene.constrained and scene.fit == "whole")
    if not session.pair.deforming:
        values |= {"turn": scene.turn or None} | ({} if plain else {"fit": scene.fit})
    return make({**values, "balance": scene.balance, **overrides})


def command(
    session: Session, scene: Scene, fields: dict[str, str] | None = None, output: str = "", size: int = 0
) -> str:
    """Return the command line that repeats the result.

    Args:
        session: the pair.
        scene: what is shown.
        fields: of the job that name saved files; by default those that Save would write.
        output: the file to write; by default named after both inputs.
        size: pixels of the picture's longer side; by default that of the session's job.
    """
    job = job_of(session, scene)
    kind = "map" if job.target else "deform"
    fields_saved = {"source": job.source, "target": job.target or ""} | (
        fields or _fields_to_save(session, scene)
    )
    shapes = [fields_saved.pop("source"), fields_saved.pop("target")]
    words = ["iccm", kind, *filter(None, shapes)]
    options_of_job = job.model_dump(exclude_defaults=True, exclude={"source", "target"})
    output = output or stem(session.pair.job) + session.pair.suffix
    if has_size(output) and (size or session.pair.job.size):
        options_of_job["size"] = size or session.pair.job.size
    words += _option_words(options_of_job, kind)
    for name, value in fields_saved.items():
        words += [f"--{name}", value]
    return _line([*words, "--stmap" if _is_stmap(output) else "-o", output])


def edit_command(session: Session) -> str:
    """Return the command line that opens the same files in the editor."""
    job = session.pair.job
    options_of_job = job.model_dump(exclude_defaults=True, exclude={"source", "target"})
    return _line(
        ["iccm", "edit", *filter(None, (job.source, job.target)), *_option_words(options_of_job, "edit")]
    )


def _option_words(values: dict[str, Any], command: str) -> list[str]:
    """Return fields of a job as options of a command, without those that the command does not have."""
    words: list[str] = []
    for name, (_, option) in options_of().items():
        if name in values and command in option.commands:
            value = values[name]
            text = "x".join(map(str, value)) if isinstance(value, tuple) else f"{value}"
            words += [f"--{name.replace('_', '-')}", *([] if value is True else [text])]
    return words


def _line(words: list[str]) -> str:
    """Return words as a command line for the user's shell."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


def _fields_to_save(session: Session, scene: Scene) -> dict[str, str]:
    """Return the fields of a job that name the files with a scene; those that Save would write if there are none."""
    if (fields := session.files_with(scene)) is not None:
        return fields
    if not session.pair.drawn:
        return {"constraints": constraints_file(session)} if scene.constrained else {}
    names = copy_names(session, ENDING)
    specs = {
        side: _spec(name, shape) for side, name, shape in zip(("source", "target"), names, _sides(session))
    }
    return specs | ({"constraints": names[2]} if _needs_list(session, scene) else {})


def unsaved_files(session: Session, scene: Scene) -> list[str]:
    """Return the files that the command for a scene reads, and that Save has yet to write."""
    if session.files_with(scene) is not None:
        return []
    return [path_of(spec) for spec in _fields_to_save(session, scene).values()]


def has_size(name: str) -> bool:
    """Return whether a file of this name has pixels, whose number can be chosen."""
    return formats.of(name).picture is not None


def _is_stmap(name: str) -> bool:
    return name.lower().endswith("stmap.exr")


def export_command(session: Session, scene: Scene, name: str, size: int) -> str:
    """Return the command line that writes what `export` writes, after the checks that `iccm map` makes.

    Raises:
        InputError: no such file can be written.
    """
    local(name)
    _write(session, scene, name, size, replace=True, dry=True)
    return command(session, scene, None, name, size)


def export(session: Session, scene: Scene, name: str, size: int, *, replace: bool) -> Outcome:
    """Write a picture, an STMap, artwork or a mesh with the code of `iccm map`.

    Raises:
        InputError: as in `iccm map`.
    """
    local(name)
    outcome = _write(session, scene, name, size, replace=replace)
    session.written.update(outcome.written)
    return outcome


class DownloadFile(NamedTuple):
    """A file for the browser to download, notes on what differs in it, and the figures of its map."""

    name: str
    content: bytes
    notes: tuple[str, ...]
    figures: dict[str, Any]


def download(session: Session, scene: Scene, name: str, size: int) -> DownloadFile:
    """Return what `export` writes as one file: a ZIP archive if there are several, such as a mesh and its texture.

    Raises:
        InputError: as in `export`.
    """
    local(name)
    with tempfile.TemporaryDirectory() as folder:
        with naming_only(folder):
            outcome = _write(session, scene, str(Path(folder) / name), size, replace=True)
        notes = tuple(_without(folder, note) for note in outcome.notes)
        map_figures = figures(outcome.report)
        written = sorted(Path(folder).iterdir())
        if len(written) == 1:
            return DownloadFile(written[0].name, written[0].read_bytes(), notes, map_figures)
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
            for file in written:
                packed.write(file, file.name)
        return DownloadFile(f"{Path(name).stem}.zip", archive.getvalue(), notes, map_figures)


def _write(
    session: Session, scene: Scene, path: str, size: int, *, replace: bool, dry: bool = False
) -> Outcome:
    """Write the result for a scene to a file with the code of `iccm map`; only check whether it can be if `dry`."""
    output: dict[str, Any] = {"stmap": path} if _is_stmap(path) else {"output": (path,)}
    output["size"] = (size,) if has_size(path) else None
    with _written_constraints(session, scene) as written_fields:
        job = job_of(session, scene, **{"force": replace, **output, **written_fields})
        return run(job.sharing(job.defaults()), dry=dry)  # options of the editor serve all its exports


@contextmanager
def naming_only(folder: str) -> Iterator[None]:
    """Remove the name of a temporary folder from messages: the user does not know it."""
    try:
        yield
    except InputError as error:
        raise InputError(_without(folder, str(error))) from error


def _without(folder: str, text: str) -> str:
    """Return a text in which files are named without a folder."""
    return text.replace(f"{folder}{os.sep}", "")


@contextmanager
def _written_constraints(session: Session, scene: Scene) -> Iterator[dict[str, Any]]:
    """Yield the fields of a job with the scene's constraints, in files that exist inside the block."""
    with tempfile.TemporaryDirectory() as folder:
        if session.pair.drawn:
            names = [str(Path(folder) / name) for name in copy_names(session, "")]
            yield copies(session, scene, names, replace=True)
        elif scene.constrained:
            path = Path(folder) / "constraints.json"
            path.write_text(constraints_json(session, scene), encoding="utf-8")
            yield {"constraints": str(path)}
        else:
            yield {}
