"""The constraints of a job in the core plane: drawn in the files, listed, or given on the command line."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ...errors import ConstraintError, InputError
from ...pins import Pin, Stroke
from .. import limits
from ..spec import path_of
from .job import Job

if TYPE_CHECKING:
    from ..shapes.listing import ConstraintsFile
    from ..shapes.shape import Shape
    from ..shapes.starts import StartingMap


FINGERPRINTED = "balance", "turn", "fit", "holes", "tolerance", "exact_pins", "max_dilatation", "max_stretch"
"""Options of a job on which the map that meets given pins depends."""
DEFAULT_VALUES = None, False, 0, "auto", "whole"  # of these options; with pins, auto is whole
Names = tuple[list[str], list[str]]  # of pins and of strokes; empty strings for unnamed ones


def constrain(
    job: Job, source: Shape, target: Shape, listed: ConstraintsFile | None = None
) -> tuple[dict[str, Any], Names]:
    """Return the constraints of a job as arguments of `iccm.fit`, and the names of its pins and strokes.

    `listed` are the constraints of the job's file.

    Raises:
        InputError: a name occurs in one file only, a place does not exist in its file, or a point is outside the
            source.
    """
    from ..shapes import constraints

    collected = constraints.collect(source, target, listed, exact=job.exact_pins)
    collected.check_weights()
    typed: list[tuple[complex, complex]] = []
    settings = list(collected.settings)
    for start, end, *further_regions in job.pin:
        pairs = constraints.pairs_at(source, target, start, end)
        typed += pairs
        typed_settings = further_regions[0] if further_regions else {}
        settings += [constraints.in_the_plane(typed_settings, source, target, *pair) for pair in pairs]
    pins = np.concatenate([collected.pins, np.reshape(np.array(typed, dtype=complex), (-1, 2))])
    for side, shape in enumerate((source, target) if job.target else (source,)):
        check_inside(shape, "pin", list(pins[:, side]))
        if side == 0 or job.exact:  # strokes with a weight may lead out of the target
            check_inside(
                shape, "vertex of a stroke", [z for stroke in collected.strokes for z in stroke[side].z]
            )
    arguments: dict[str, Any] = {
        "pins": as_pins(pins, settings),
        "strokes": as_strokes(collected.strokes, collected.stroke_widths),
    }
    regions = job.rigid or (listed and listed.rigid) or (not job.rigid_target and source.rigid)
    if regions:
        from ..shapes.regions import greys, read

        further_regions = listed.rigid if listed else []
        arguments["rigid"] = read(source, job.rigid, further_regions, each=job.rigid_each)
        arguments |= (
            greys(source, [*job.rigid, *further_regions]) if job.target and not source.is_mesh else {}
        )
    if job.rigid_target:
        from ..shapes.regions import read

        arguments["rigid_target"] = read(
            target, job.rigid_target, option="--rigid-target", each=job.rigid_each
        )
    if job.importance or job.size_map:
        from ..shapes.regions import fields

        arguments |= fields(source, job.importance, job.size_map)
    if listed and listed.start:
        arguments["start"] = listed.start.map(source, target)
        if listed.start.kept and listed.start.kept == fingerprint(job, pins, settings):
            arguments["keep_start"] = True
    return arguments, collected.names


def fingerprint(job: Job, pins: Complex, settings: Sequence[dict[str, float]]) -> str:
    """Return a short hash of all that the map of some pins depends on, see `StartingMap.kept`.

    Args:
        job: its options.
        pins: (k, 2) in the core plane, in any order.
        settings: of each pin, in the core plane.
    """
    values = [getattr(job, name) for name in FINGERPRINTED]
    options = ["" if value in DEFAULT_VALUES else str(value) for value in values]
    placed = sorted(
        [str(source_point), str(target_point), str(sorted(pin_settings.items()))]
        for (source_point, target_point), pin_settings in zip(pins.tolist(), settings)
    )
    return sha256(json.dumps([options, placed]).encode()).hexdigest()[: limits.FINGERPRINT_DIGITS]


def as_pins(points: Complex, settings: Sequence[dict[str, float]]) -> Complex | list[Pin] | None:
    """Return pins (k, 2) with their settings as an argument of `iccm.fit`; None if there are none."""
    if not len(points):
        return None
    if not any(settings):
        return points
    return [Pin(start, end, **pin_settings) for (start, end), pin_settings in zip(points, settings)]


def as_strokes(
    pairs: list[tuple[Curve, Curve]], widths: Sequence[float]
) -> list[tuple[Curve, Curve] | Stroke] | None:
    """Return strokes with the widths of their bands as an argument of `iccm.fit`; None if there are none."""
    strokes = [Stroke(*pair, width) if width else pair for pair, width in zip(pairs, widths)]
    return strokes or None


def constraints_text(
    shapes: Sequence[Shape], entries: dict[str, list[Any]], start: StartingMap | None
) -> str:
    """Return the text of a constraints file.

    Args:
        shapes: the source, and the target if there is one. Their sizes are written, so that other shapes are refused.
        entries: pins, strokes and rigid regions, in file units, under the keys of the file; one line is written for
            each.
        start: the map to continue from.
    """
    sides = {
        side: {"file": path_of(shape.spec), "size": _size(shape)}
        for side, shape in zip(("source", "target"), shapes)
    }
    lines = [f'  "files": {json.dumps(sides, ensure_ascii=False)}']
    for kind, listed in entries.items():
        rows = ",".join(f"\n    {json.dumps(_as_entry(entry), ensure_ascii=False)}" for entry in listed)
        lines.append(f'  "{kind}": [{rows}\n  ]' if listed else f'  "{kind}": []')
    if start:
        lines.append(f'  "start": {start.model_dump_json()}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _as_entry(entry: Any) -> Any:
    """Return a pin, a stroke or a rigid region as JSON, without values that are the defaults."""
    return entry.model_dump(mode="json", exclude_defaults=True) if hasattr(entry, "model_dump") else entry


def _size(shape: Shape) -> list[float]:
    low, high = shape.box
    return [float(f"{side:.9g}") for side in ((high - low).real, (high - low).imag)]


@contextmanager
def add_names(called: Names) -> Iterator[None]:
    """Add the names of pins and strokes to errors that refer to them by number."""
    try:
        yield
    except ConstraintError as error:
        pairs = zip(("pin", "stroke"), (error.pins, error.strokes), called)
        labels = [
            f"{kind} {k + 1}: {names[k]}"
            for kind, numbers, names in pairs
            for k in numbers
            if _named(names, k)
        ]
        raise InputError(f"{error} ({', '.join(labels)})" if labels else str(error)) from None


def _named(names: list[str], k: int) -> bool:
    return k < len(names) and bool(names[k])


def check_inside(shape: Shape, kind: str, points: list[complex]) -> None:
    """Check that points lie inside a shape; report the first one that does not in the units of its file.

    Raises:
        InputError: a point is outside.
    """
    z = np.array(points, dtype=complex)
    if not z.size:
        return
    gap = shape.curve.distances(z)
    outside = np.flatnonzero(~shape.curve.contains(z) & (gap > 1e-6 * shape.curve.diagonal))
    if outside.size:
        x, y = shape.to_file(z[outside[0]])
        rounded_gap = float(f"{gap[outside[0]]:.3g}")  # so that thousands have no exponent
        position = f"({x:g}, {y:g}) is {rounded_gap:g} outside the shape"
        raise InputError(f"{shape.spec}: {kind} {outside[0] + 1}: {position}; move it inside")
