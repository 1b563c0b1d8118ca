"""Standardise specimens: map each one onto the standard shape, and summarise their pictures there."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import progress
from ...errors import InputError
from ...pixels.canvas import LONGER_SIDE_PIXELS
from .. import files
from ..batch import dispatch
from ..batch.journal import Journal
from ..batch.manifest import Task
from ..batch.pools import Pool
from ..run.job import Job
from ..run.report import as_json
from ..spec import Spec
from . import specimens as reading
from . import standard as standards
from .landmarks import STEM, LandmarkFiles
from .specimens import Specimen
from .standard import Standard
from .statistics import Statistics

SCHEMA = "iccm.standardize/1"
SHAPE, LANDMARKS, TABLE, REPORT = "shape.svg", "landmarks.csv", "specimens.csv", "report.json"
SUMMARY = {
    "mean": "mean.png",
    "spread": "spread.png",
    "mean_data": "mean.tif",
    "spread_data": "spread.tif",
    "count": "count.tif",
}
PICTURES, MAPS, MIRRORED = "pictures", "maps", "mirrored"  # folders, with a file for each specimen
COLUMNS = (
    *("specimen", "status", "procrustes_distance", "centroid_size", "rotation", "mirrored"),
    *("dilatation_p95", "injective", "outline_gap", "seconds", "picture", "map", "message"),
)


@dataclass(frozen=True)
class Plan:
    """The specimens to standardise, and the settings.

    Attributes:
        specimens: files, patterns and folders.
        output: the folder to write.
        landmarks: as for `LandmarkFiles`.
        outlines: name of the file with the outline of each specimen, with {stem}; None for those in the pictures.
        size: of the pictures in pixels; None for a longer side of 1024.
        reference: the specimen onto which to map the others; None for the mean.
        reflect: whether mirror images of specimens may be used.
        force: whether existing files may be replaced.
        resume: whether maps that an earlier run made from the same files are used again.
        timeout: seconds that a map may take.
        threads: of each worker.
    """

    specimens: Sequence[str]
    output: str
    landmarks: str | None = None
    outlines: str | None = None
    size: tuple[int, ...] | None = None
    reference: str | None = None
    reflect: bool = False
    force: bool = False
    resume: bool = False
    timeout: float | None = None
    threads: int = 1


@dataclass(frozen=True)
class Summary:
    """The result of a command.

    Attributes:
        rows: figures of each specimen, by the names of `COLUMNS`.
        written: the files beside those of specimens.
        report: the content of the report.
        stopped: whether a signal stopped it, so that there is no summary.
    """

    rows: list[dict[str, Any]]
    written: list[str]
    report: dict[str, Any]
    stopped: bool = False

    @property
    def ok(self) -> bool:
        """Whether all specimens were mapped well."""
        return all(row["status"] == "done" for row in self.rows)


def run(
    plan: Plan,
    pool: Callable[[int], AbstractContextManager[Pool]],
    *,
    tell: Callable[[str], None] = lambda note: None,
    stopping: Callable[[], bool] = lambda: False,
) -> Summary:
    """Standardise specimens.

    Args:
        plan: what to do.
        pool: opens workers for a number of jobs.
        tell: called with each note.
        stopping: returns whether to stop.

    Raises:
        InputError: a file cannot be written, or fewer than two specimens can be read. What is wrong with a single
            specimen is in its row.
    """
    specs = reading.specs_of(plan.specimens)
    folder = Path(plan.output)
    replace_own = plan.force or plan.resume
    fixed = [str(folder / name) for name in (SHAPE, LANDMARKS, TABLE, REPORT, *SUMMARY.values())]
    landmarks = LandmarkFiles(plan.landmarks, [Spec.of(text).path for text in specs])
    if plan.outlines is not None and STEM not in plan.outlines:
        raise InputError(f"--outlines {plan.outlines}: the name must contain {STEM}, such as '{STEM}.svg'")
    names = [Spec.of(text).path.stem for text in specs]
    reference = plan.reference
    if reference is not None and reference not in names:
        reference = Path(reference).stem
        if reference not in names:
            raise InputError(f"--reference {plan.reference}: is not one of the specimens")
    specimens, refused = _read_all(specs, landmarks, plan)
    _check_folder(folder)
    files.make_folder(folder)
    files.check_outputs(fixed, [path for specimen in specimens for path in specimen.files], force=replace_own)

    def reflected(specimen: Specimen) -> Specimen:
        return specimen.reflected(folder / MIRRORED, force=replace_own)

    standard = standards.of(
        specimens,
        refused,
        size=plan.size or (LONGER_SIDE_PIXELS,),
        reference=reference,
        reflect=reflected if plan.reflect else None,
        note=tell,
    )
    book = Journal(folder)
    tasks = dispatch.prepare(_tasks(standard, folder, plan), book, resume=plan.resume)
    files.write_bytes(folder / SHAPE, standard.svg().encode(), force=replace_own)
    files.write_bytes(folder / LANDMARKS, standard.csv().encode(), force=replace_own)
    policy = dispatch.Policy(timeout=plan.timeout, threads=plan.threads)
    answers = dict[str, dict[str, Any]]()
    with pool(len(tasks)) as workers:
        options: dict[str, Any] = {"resume": plan.resume, "warn": tell, "stopping": stopping}
        for answer in dispatch.execute(tasks, workers, book, policy, **options):
            answers[answer["name"]] = answer
    numbers = {specimen.name: number for number, specimen in enumerate(standard.specimens)}
    rows = [_row(name, numbers.get(name), standard, folder, answers, refused) for name in names]
    if stopping():
        return Summary(rows, [], {}, stopped=True)
    return _summarise(plan, standard, rows, folder)


def _check_folder(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; name a folder for the results")


def _read_all(
    specs: Sequence[str], landmarks: LandmarkFiles, plan: Plan
) -> tuple[list[Specimen], dict[str, str]]:
    """Return the specimens that can be read, and what is wrong with the others, by name."""
    specimens, refused = list[Specimen](), dict[str, str]()
    for number, text in enumerate(progress.counted("read specimens", specs)):
        stem = Spec.of(text).path.stem
        try:
            outline = plan.outlines.replace(STEM, stem) if plan.outlines else None
            specimen = reading.read(text, landmarks.of(number), outline)
        except InputError as error:
            refused[stem] = str(error)
            continue
        specimens.append(specimen)
    return specimens, refused


def _tasks(standard: Standard, folder: Path, plan: Plan) -> list[Task]:
    """Return the job of each specimen."""
    tasks = []
    for number, specimen in enumerate(standard.specimens, 1):
        job = Job(
            source=specimen.source,
            target=str(folder / SHAPE),
            texture=specimen.picture,
            texture_box="viewbox",
            target_box="viewbox",
            parts="largest",
            holes="cut",
            pin=standard.pins(specimen),
            size=standard.size,
            output=_outputs(specimen.name, folder),
            force=plan.force,
        )
        tasks.append(Task.of(number, specimen.name, specimen.source, job))
    return tasks


def _outputs(name: str, folder: Path) -> tuple[str, str]:
    """Return the files of a specimen: its picture and its map."""
    return str(folder / PICTURES / f"{name}.png"), str(folder / MAPS / f"{name}.npz")


def _row(
    name: str,
    number: int | None,
    standard: Standard,
    folder: Path,
    answers: dict[str, Any],
    refused: dict[str, str],
) -> dict[str, Any]:
    """Return the row of the table for a specimen; `number` is that among the mapped ones, None if it is not."""
    row: dict[str, Any] = dict.fromkeys(COLUMNS)
    row |= {"specimen": name, "status": "failed", "message": refused.get(name, "")}
    if number is None:
        return row
    placed = standard.superimposition
    turn = np.degrees(np.angle(placed.placed[number].factor))
    row |= {
        "procrustes_distance": float(placed.distances[number]),
        "centroid_size": float(placed.sizes[number]),
        "rotation": float(turn),
        "mirrored": standard.specimens[number].mirrored,
    }
    answer = answers[name]
    figures, written = answer["figures"], [output["path"] for output in answer["outputs"]]
    picture, saved = _outputs(name, folder)
    row |= {
        "status": answer["status"],
        "message": "" if answer["status"] == "done" else answer["message"],
        "seconds": answer["seconds"],
        "dilatation_p95": _figure(figures, "dilatation", "p95"),
        "injective": _figure(figures, "injective", "share"),
        "outline_gap": _figure(figures, "boundary", "hausdorff"),
        "picture": os.path.relpath(picture, folder) if picture in written else None,
        "map": os.path.relpath(saved, folder) if saved in written else None,
    }
    return row


def _figure(figures: dict[str, Any], group: str, name: str) -> float | None:
    group_figures = figures.get(group)
    return group_figures.get(name) if isinstance(group_figures, dict) else None


def _summarise(plan: Plan, standard: Standard, rows: list[dict[str, Any]], folder: Path) -> Summary:
    """Write the table, the report, and the statistics of the pictures of specimens that were mapped well."""
    force = plan.force or plan.resume
    paths = [str(folder / row["picture"]) for row in rows if row["status"] == "done" and row["picture"]]
    written = [SHAPE, LANDMARKS]
    report: dict[str, Any] = {
        "schema": SCHEMA,
        "reference": plan.reference,
        "size": list(standard.size),
        "landmarks": list(standard.names),
        "landmarks_on_outline": [standard.names[k] for k in standard.anchors.tolist()],
        "pins": [standard.names[k] for k in standard.pinned.tolist()],
        "colours": "as stored in the pictures, from 0 to 1",
        "specimens": rows,
    }
    if paths:
        with progress.within("summarise"), files.scratch() as scratch:
            statistics = Statistics.of(progress.counted("pictures", paths))
            largest = statistics.write(scratch, SUMMARY)
            for name in SUMMARY.values():
                files.write_bytes(folder / name, (scratch / name).read_bytes(), force=force)
        written += SUMMARY.values()
        report["spread"] = statistics.figures() | {"brightest": largest}
        report["summarised"] = len(paths)
    files.write_bytes(folder / TABLE, _table(rows).encode(), force=force)
    text = json.dumps(as_json(report), ensure_ascii=False, indent=1)
    files.write_bytes(folder / REPORT, f"{text}\n".encode(), force=force)
    return Summary(rows, [str(folder / name) for name in (*written, TABLE, REPORT)], report)


def _table(rows: list[dict[str, Any]]) -> str:
    """Return rows as CSV; numbers have as many digits as are needed."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
