"""Comparison of results with baselines: pictures by pixels, reports by figures. Nothing is resized or converted."""

from __future__ import annotations

import fnmatch
import json
import os
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, ValidationError

from ...errors import InputError, first_names
from .. import files, formats, limits
from ..checked import StrictModel, mistakes
from ..figure_table import tolerances as tolerances_of_figures

NOTES = "notes.*", "*.notes.*"
"""Keys of sentences in a report, which versions of iccm word differently."""
SHOWN_ADDITIONS = 5
"""Figures that a baseline lacks, in a note at most."""


class Pictures(StrictModel):
    """Tolerances for pictures: differences relative to white, and structural similarity from 0 to 1."""

    max: float = Field(2 / 255, ge=0)
    rms: float = Field(0.001, ge=0)
    ssim: float = Field(0.999, ge=-1, le=1)


class Meshes(StrictModel):
    """Tolerance for texture coordinates, relative to the width of a picture; all other contents of a mesh must be
    equal.
    """

    uv: float = Field(1e-4, ge=0)


class Figure(StrictModel):
    """Tolerance for a figure of a report, relative or absolute; meeting either is enough."""

    rel: float = Field(1e-6, ge=0)
    abs: float = Field(1e-9, ge=0)
    ignore: bool = False


REPORT = {pattern: Figure(**tolerance._asdict()) for pattern, tolerance in tolerances_of_figures().items()}
"""Tolerances of the table of figures, by patterns of keys."""


class Tolerances(StrictModel):
    """`tolerances.toml`: tables for pictures and meshes, and one for reports with patterns of keys, the last match of
    which counts.
    """

    pictures: Pictures = Pictures()
    meshes: Meshes = Meshes()
    report: dict[str, Figure] = Field({})

    def figure(self, key: str) -> Figure:
        """Return the tolerance for a report's key, such as `boundary.rms`."""
        fitting = [f for pattern, f in {**REPORT, **self.report}.items() if fnmatch.fnmatchcase(key, pattern)]
        return fitting[-1] if fitting else Figure()


class Moved(NamedTuple):
    """A figure that is too far from its baseline, as text, with the limit that it exceeds."""

    key: str
    run: str
    baseline: str
    limit: str


@dataclass
class Verdict:
    """The result of comparing one file.

    Attributes:
        name: path relative to both folders.
        problems: a sentence for each difference that is too large; empty if the file passes.
        figures: the measured differences of a picture.
        moved: the figures of a picture or report that are too far from their baselines.
        worst: column and row of a picture's largest difference, if there is one.
        notes: remarks that are not failures, such as figures of a newer version that the baseline lacks.
        state: "new" or "missing" for a file that exists in only one of the folders.
    """

    name: str
    problems: list[str] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)
    moved: list[Moved] = field(default_factory=list)
    worst: tuple[int, int] | None = None
    notes: list[str] = field(default_factory=list)
    state: Literal["same", "differs", "new", "missing"] = "same"

    def __post_init__(self) -> None:
        if self.problems and self.state == "same":
            self.state = "differs"

    @property
    def ok(self) -> bool:
        """Whether all differences are within their limits."""
        return not self.problems

    def fail(self, figure: str, value: str, limit: str, where: str = "", than: str = "more") -> None:
        """Record that a figure exceeds its limit."""
        self.moved.append(Moved(figure, value, "", limit))
        self.problems.append(f"{figure} {value} is {than} than {limit}{where}")


def tolerances(path: Path | None) -> Tolerances:
    """Read tolerances from a file; return the defaults without one.

    Raises:
        InputError: lists every mistake in the file.
    """
    if path is None:
        return Tolerances()
    try:
        return Tolerances(**tomllib.loads(files.read_bytes(path, max_bytes=limits.COMPARED_BYTES).decode()))
    except ValidationError as error:
        raise InputError("; ".join(f"{path}: {key}: {text}" for key, text in mistakes(error))) from None
    except (ValueError, RecursionError) as error:  # no TOML, numbers of thousands of digits, deep nesting
        raise InputError(f"{path}: {str(error).splitlines()[0]}") from None


def compare(name: str, run: Path, baseline: Path, allowed: Tolerances) -> Verdict:
    """Compare one file with its baseline, by the kind of file that its suffix indicates."""
    verdict = Verdict(name)
    if not run.is_file():
        return Verdict(name, ["missing in the run"], state="missing")
    if not baseline.is_file():
        return Verdict(name, ["has no baseline; create it with --update"], state="new")
    if formats.of(baseline).picture:
        _pictures(run, baseline, allowed.pictures, verdict)
    elif baseline.suffix.lower() == ".json":
        _reports(name, run, baseline, allowed, verdict)
    elif files.sha256(run) == files.sha256(baseline):
        pass
    elif formats.of(baseline).uv:
        _meshes(run, baseline, allowed.meshes, verdict)
    else:
        verdict.problems.append("the contents differ")
    verdict.state = "differs" if verdict.problems else "same"
    return verdict


def _pictures(run: Path, baseline: Path, allowed: Pictures, verdict: Verdict) -> None:
    a, b = _pixels(run), _pixels(baseline)
    if a.shape != b.shape or a.dtype != b.dtype:
        verdict.problems.append(f"is {_kept(a)}, but the baseline is {_kept(b)}")
        return
    x, y = scaled(a), scaled(b)
    if not np.array_equal(np.isfinite(x), np.isfinite(y)):
        verdict.problems.append("NaN or infinity at different pixels than in the baseline")
        return
    x, y = finite(x), finite(y)
    gap = np.abs(x - y)
    verdict.figures = {
        "max": float(gap.max()),
        "rms": float(np.sqrt((gap**2).mean())),
        "ssim": similarity(x, y),
    }
    row, column = np.unravel_index(int(gap.max(axis=2).argmax()), gap.shape[:2])
    verdict.worst = (int(column), int(row)) if gap.any() else None
    for name, limit in (("max", allowed.max), ("rms", allowed.rms)):
        if verdict.figures[name] > limit * (1 + 1e-9):
            where = f", largest at column {column}, row {row}"
            verdict.fail(f"{name} difference", f"{verdict.figures[name]:.4g}", f"{limit:.4g}", where)
    if (ssim := verdict.figures["ssim"]) < allowed.ssim:
        verdict.fail("structural similarity", f"{ssim:.5f}", f"{allowed.ssim:g}", than="less")


def _pixels(path: Path) -> np.ndarray:
    from ..pictures import image_files

    return image_files.read(path).pixels


def _kept(pixels: np.ndarray) -> str:
    height, width, channels = pixels.shape
    return f"{width}x{height} with {channels} channels of {pixels.dtype}"


def scaled(pixels: np.ndarray) -> np.ndarray:
    """Return (h, w, c) float64 with 1 for white."""
    white = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1.0
    return pixels.astype(np.float64) / white


def finite(x: np.ndarray) -> np.ndarray:
    """Return x with 0 for NaN and infinity."""
    return np.where(np.isfinite(x), x, 0.0)


def similarity(x: np.ndarray, y: np.ndarray) -> float:
    """Return the mean structural similarity over the channels; for pictures smaller than 7 pixels, whether they are
    equal.
    """
    from skimage.metrics import structural_similarity

    if min(x.shape[:2]) < 7:
        return float(np.array_equal(x, y))
    span = max(1.0, float(max(x.max(), y.max()) - min(x.min(), y.min())))
    return float(structural_similarity(x, y, channel_axis=2, data_range=span))


def _meshes(run: Path, baseline: Path, allowed: Meshes, verdict: Verdict) -> None:
    """Compare texture coordinates within a tolerance, and the rest exactly."""
    from ..meshes import mesh_files

    split_uv = mesh_files.format_of(baseline).split_uv
    result, expected = split_uv(run), split_uv(baseline)
    if result is None or expected is None:
        verdict.problems.append("the contents differ")
        return
    uv, contents = result
    goal, expected_contents = expected
    if contents != expected_contents or uv.shape != goal.shape:
        verdict.problems.append("the contents differ, not only in texture coordinates")
        return
    gap = verdict.figures["uv"] = float(np.abs(uv - goal).max(initial=0.0))
    if not gap <= allowed.uv:
        verdict.fail("uv difference", f"{gap:.4g}", f"{allowed.uv:.4g}")


def _reports(name: str, run: Path, baseline: Path, allowed: Tolerances, verdict: Verdict) -> None:
    result, expected = (files.read_json(path, max_bytes=limits.COMPARED_BYTES) for path in (run, baseline))
    if expected in ({}, []):
        verdict.problems.append("its baseline is empty; write it again with --update")
        return
    if unknown := [key for key in added(result, expected) if not allowed.figure(key).ignore]:
        verdict.notes.append(
            f"not in the baseline, and not compared: {first_names(unknown, SHOWN_ADDITIONS)}"
        )
    other_version = _other_version(result, expected)
    reworded = False
    for key, a, b in figures(result, expected):
        tolerance = allowed.figure(key)
        if tolerance.ignore:
            continue
        if other_version and any(fnmatch.fnmatchcase(key, pattern) for pattern in NOTES):
            reworded = reworded or a != b
            continue
        if a is ABSENT or b is ABSENT:
            verdict.problems.append(f"{key}: {'missing' if a is ABSENT else 'not in the baseline'}")
            continue
        a, b = (_named(value, path.parents[name.count("/")]) for value, path in ((a, run), (b, baseline)))
        if not _same(a, b, tolerance):
            difference = Moved(key or "content", _value(a), _value(b), _limit(a, b, tolerance))
            verdict.moved.append(difference)
            within = f" (allowed difference {difference.limit})" if difference.limit else ""
            verdict.problems.append(
                f"{difference.key}: {difference.run} instead of {difference.baseline}{within}"
            )
    if reworded:
        verdict.notes.append(f"the notes differ from those of iccm {other_version}, and are not compared")


def _other_version(result: Any, expected: Any) -> str:
    """Return the version of iccm that wrote a baseline if another one wrote the result, else an empty string."""
    versions = [report.get("version") for report in (result, expected) if isinstance(report, dict)]
    return str(versions[-1]) if len(versions) == 2 and all(versions) and versions[0] != versions[1] else ""


ABSENT = object()
"""The value of a figure that only the other one of two reports has."""


def figures(run: Any, baseline: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the figures of two reports by dotted path, with their values, or ABSENT.

    Keys that an object of the baseline lacks are not yielded (see `added`).
    """
    if isinstance(run, dict) and isinstance(baseline, dict):
        items: Iterable[tuple[Any, Any, Any]] = (
            (name, run.get(name, ABSENT), value) for name, value in baseline.items()
        )
    elif isinstance(run, list) and isinstance(baseline, list):
        items = ((index, *pair) for index, pair in enumerate(zip_longest(run, baseline, fillvalue=ABSENT)))
    else:
        only = baseline if run is ABSENT else run if baseline is ABSENT else None
        if not (only and isinstance(only, dict | list)):
            yield key, run, baseline
            return
        inner = only.items() if isinstance(only, dict) else enumerate(only)
        items = ((name, *((ABSENT, value) if run is ABSENT else (value, ABSENT))) for name, value in inner)
    for name, a, b in items:
        yield from figures(a, b, f"{key}.{name}" if key else str(name))


def added(run: Any, baseline: Any, key: str = "") -> Iterator[str]:
    """Yield the dotted paths of keys that objects of a result have and those of its baseline lack.

    Later versions add keys to objects. A longer list is another result, for instance of more parts.
    """
    prefix = f"{key}." if key else ""
    if isinstance(run, dict) and isinstance(baseline, dict):
        for name, value in run.items():
            if name in baseline:
                yield from added(value, baseline[name], f"{prefix}{name}")
            else:
                yield f"{prefix}{name}"
    elif isinstance(run, list) and isinstance(baseline, list):
        for index, pair in enumerate(zip(run, baseline)):
            yield from added(*pair, f"{prefix}{index}")


def _named(value: Any, folder: Path) -> Any:
    """Return a note about a file of the folder, or its path, as it is wherever the folder lies: `a.obj: …` for
    `base/a.obj: …`.
    """
    if not isinstance(value, str):
        return value
    path, colon, text = value.partition(": ")
    parts = Path(path).relative_to(Path(path).anchor).parts
    ends = ("/".join(parts[k:]) for k in range(len(parts)))
    return next((end for end in ends if os.path.isfile(folder / end)), path) + colon + text


def _same(a: Any, b: Any, tolerance: Figure) -> bool:
    if not _are_numbers(a, b):
        return type(a) is type(b) and a == b
    return abs(a - b) <= max(tolerance.rel * abs(b), tolerance.abs)


def _are_numbers(*values: Any) -> bool:
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)


def _limit(a: Any, b: Any, tolerance: Figure) -> str:
    """Return the largest allowed difference of a figure as text; empty for text and for values that are no longer
    numbers.
    """
    return f"{max(tolerance.rel * abs(b), tolerance.abs):.3g}" if _are_numbers(a, b) else ""


def _value(value: Any) -> str:
    if value and isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "a list"
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value)
