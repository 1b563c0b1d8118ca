"""Comparison of a folder of results with a folder of baselines: diff pictures, JUnit XML, and updating baselines."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...errors import InputError
from .. import files, formats
from .compare import Tolerances, Verdict, compare, finite, scaled

SETTINGS = "tolerances.toml"


def names(folder: Path, *, closed: bool = False) -> list[str]:
    """Return the files below a folder as relative paths with /; hidden files and the tolerances are left out.

    Args:
        folder: with results or baselines.
        closed: whether links out of the folder are rejected. Baselines may be links into a store of large files.

    Raises:
        InputError: the folder does not exist, or is `closed` and a link leads out of it.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    paths = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    for name in paths if closed else ():
        check_inside(folder, folder / name)
    return sorted(
        p.as_posix()
        for p in paths
        if p.as_posix() != SETTINGS and not any(q.startswith(".") for q in p.parts)
    )


def check_inside(folder: Path, path: Path) -> None:
    """Check that a path does not lead out of a folder through a link: results may come from elsewhere, and are read and
    stored.

    Raises:
        InputError: it does.
    """
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise InputError(f"{path}: is a link to a file outside {folder}; copy the file itself there")


def select(candidates: Iterable[str], only: tuple[str, ...]) -> list[str]:
    """Return the names that match one of the patterns, literally or with * and ?; all names if there are no
    patterns.
    """
    return [name for name in candidates if not only or any(name == o or fnmatchcase(name, o) for o in only)]


def check(run: Path, baselines: Path, allowed: Tolerances, only: tuple[str, ...] = ()) -> list[Verdict]:
    """Return a verdict for every file in either folder that matches `only`.

    Raises:
        InputError: a folder is missing, or there is nothing to compare: such a comparison would always pass.
    """
    selected = select(sorted({*names(run, closed=True), *names(baselines)}), only)
    if not selected and only:
        raise InputError(f"{' '.join(only)}: no such file in {run} or {baselines} (--only)")
    if not selected:
        raise InputError(f"{baselines}: contains no baselines to compare with; create them with --update")
    verdicts = []
    for name in selected:
        try:
            verdicts.append(compare(name, run / name, baselines / name, allowed))
        except InputError as error:
            verdicts.append(Verdict(name, [str(error)]))
    return verdicts


def update(run: Path, baselines: Path, only: tuple[str, ...] = ()) -> tuple[list[str], list[str]]:
    """Replace the baselines, or those that match `only`, by the results; return the files that were written and
    removed.

    Baselines without a result are removed.

    Raises:
        InputError: there are no results, or the folder cannot be written.
    """
    present = names(run, closed=True)
    if not present:
        raise InputError(f"{run}: contains no files to store as baselines")
    baselines.mkdir(parents=True, exist_ok=True)
    new = select(present, only)
    removed = select((name for name in names(baselines) if name not in set(present)), only)
    if not new and not removed:
        raise InputError(f"{' '.join(only)}: no such file in {run} or {baselines} (--only)")
    for name in new:
        check_inside(baselines, baselines / name)
    for name in new:
        (baselines / name).parent.mkdir(parents=True, exist_ok=True)
        with files.replacing(baselines / name, force=True) as path:
            shutil.copyfile(run / name, path)
    for name in removed:
        (baselines / name).unlink()
    return new, removed


def diff(verdict: Verdict, run: Path, baselines: Path, folder: Path) -> Path | None:
    """Write baseline, result and their difference (at full contrast) side by side; return None if there is no pair.

    Pictures of different sizes are shown without a difference, and not resized.
    """
    from ..pictures import image_files

    pair = [baselines / verdict.name, run / verdict.name]
    if not formats.of(verdict.name).picture or not all(path.is_file() for path in pair):
        return None
    try:
        panels = [as_picture(image_files.read(path).pixels) for path in pair]
    except InputError:
        return None
    if panels[0].shape == panels[1].shape:
        gap = np.abs(panels[0] - panels[1])
        panels.append(gap / max(float(gap.max()), 1e-9))
    path = folder / f"{verdict.name}.diff.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = image_files.Image(np.round(255 * _side_by_side(panels)).astype(np.uint8))
    with files.replacing(path, force=True) as temporary:
        image_files.write(temporary, picture)
    return path


def as_picture(pixels: np.ndarray) -> np.ndarray:
    """Return (h, w, 3) in 0..1: grey repeated in all channels, alpha composited over grey."""
    x = np.clip(finite(scaled(pixels)), 0, 1)
    if x.shape[2] in (2, 4):
        x = x[..., :-1] * x[..., -1:] + 0.5 * (1 - x[..., -1:])
    return np.repeat(x[..., :1], 3, axis=2) if x.shape[2] < 3 else x[..., :3]


def _side_by_side(pictures: list[np.ndarray]) -> np.ndarray:
    height, gap = max(p.shape[0] for p in pictures), 8
    padded = [np.pad(p, ((0, height - p.shape[0]), (0, gap), (0, 0)), constant_values=1.0) for p in pictures]
    return np.concatenate(padded, axis=1)[:, :-gap]


def junit(verdicts: Iterable[Verdict], seconds: float) -> bytes:
    """Return JUnit XML with one test case per file. Time and date follow SOURCE_DATE_EPOCH."""
    verdicts = list(verdicts)
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    date = datetime.fromtimestamp(int(epoch), UTC) if epoch else datetime.now(UTC)
    counts = {"tests": str(len(verdicts)), "failures": str(sum(not v.ok for v in verdicts)), "errors": "0"}
    time = "0" if epoch else f"{seconds:.3f}"
    stamp = date.strftime("%Y-%m-%dT%H:%M:%S")
    root = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(
        root, "testsuite", {"name": "iccm check", **counts, "time": time, "timestamp": stamp}
    )
    for verdict in verdicts:
        case = ElementTree.SubElement(
            suite, "testcase", {"classname": "iccm.check", "name": _xml(verdict.name), "time": "0"}
        )
        if not verdict.ok:
            failure = ElementTree.SubElement(case, "failure", {"message": _xml(verdict.problems[0])})
            failure.text = _xml("\n".join(verdict.problems))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _xml(text: str) -> str:
    """Return text without characters that XML does not allow."""
    text = text.encode("utf-8", "replace").decode()
    return "".join(c if c in "\t\n" or ord(c) >= 0x20 else "?" for c in text)
