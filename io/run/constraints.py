"""The constraints of a job in the core plane: drawn in the files, listed, or given on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Complex, Flags
from ...balanced.errors import NoMapError
from ...balanced.motion import is_reshaped
from ...curve import Curve
from ...errors import ConstraintError, InputError
from ...fit_data import with_details
from ...fits import is_of_drawings
from ...maps.triangulated.map import TriangulatedMap
from ...pins import Pin, Stroke
from .. import files, limits
from ..shapes import parts
from ..spec import path_of
from .job import Job

if TYPE_CHECKING:
    from ...result import Fit
    from ..shapes.listing import ConstraintsFile
    from ..shapes.shape import Shape
    from ..shapes.starts import StartingMap


MOST_COST_RATIO = 1.15
"""Factor between costs: a map continued from another is replaced by a new one if it costs more than this many times as
much as the other, and as the new map.
"""
CONSTRAINTS = "pins", "strokes", "rigid", "rigid_target", "importance", "size_map"
FINGERPRINTED = "balance", "turn", "fit", "holes", "tolerance", "exact_pins", "max_dilatation", "max_stretch"
"""Options of a job on which the map that meets given pins depends."""
DEFAULT_VALUES = None, False, 0, "auto", "whole"  # of these options; with pins, auto is whole
SAME_OUTLINE_SHARE = 1e-9  # relative to the diagonal: outlines no farther apart than this are the same
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
        arguments["rigid"] = read(source, job.rigid, further_regions)
        arguments |= (
            greys(source, [*job.rigid, *further_regions]) if job.target and not source.is_mesh else {}
        )
    if job.rigid_target:
        from ..shapes.regions import read

        arguments["rigid_target"] = read(target, job.rigid_target, option="--rigid-target")
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


def solve(
    source: Shape,
    target: Shape | None,
    arguments: dict[str, Any],
    *,
    holed: bool,
    tell: Callable[[str], None],
) -> Fit:
    """Return the map of two shapes, or the deformation of one; `holed` if holes are to be mapped, too.

    Args:
        source: the shape that is mapped.
        target: the shape to map onto; None for a deformation.
        arguments: options of `iccm.fit` and `iccm.deform`.
        holed: whether holes are mapped onto holes.
        tell: called with notes about holes that are ignored.
    """
    import iccm

    from ..shapes.holes import deform_with_holes, filled, fit_with_holes

    if target is None:
        return deform_with_holes(source, **arguments) if holed else iccm.deform(source.curve, **arguments)
    if holed:
        return prefer_namesakes(
            source, target, partial(fit_with_holes, source, target, tell), arguments, tell
        )
    if source.drawing is None or target.drawing is None:
        return prefer_namesakes(
            source, target, partial(iccm.fit, source.domain, target.domain), arguments, tell
        )
    # holes are ignored by the map, but still cut out of the picture
    plain = partial(iccm.fit, filled(source).domain, filled(target).domain)
    return with_details(
        prefer_namesakes(source, target, plain, arguments, tell), drawings=(source.drawing, target.drawing)
    )


def prefer_namesakes(
    source: Shape,
    target: Shape,
    fit: Callable[..., Fit],
    arguments: dict[str, Any],
    tell: Callable[[str], None],
) -> Fit:
    """Return the map of two shapes; use parts with the same name as pins if that helps.

    If the unconstrained map does not carry a named part onto its namesake, a map that starts from these parts as pins
    is preferred, unless it costs more than `MOST_COST_RATIO` times as much.
    """
    plain = fit(**arguments)
    is_constrained = any(arguments.get(name) is not None for name in (*CONSTRAINTS, "start"))
    if is_constrained or plain.details.place != "fill" or not isinstance(plain.map, TriangulatedMap):
        return plain
    names, places, radii = parts.namesakes(source, target)
    if not names:
        return plain

    def missed(candidate: Fit) -> Flags:
        return ~(np.abs(candidate.map(places[:, 0]) - places[:, 1]) <= radii)

    missed_before = missed(plain)
    if not missed_before.any():
        return plain
    with suppress(NoMapError, InputError):
        requested = arguments.get("fit")
        mode = requested if is_of_drawings(requested) else "whole"
        pinned = fit(**arguments | {"pins": places, "fit": mode})
        pins_fix_turn = (
            arguments.get("turn") is None and len(names) > 1
        )  # several pins determine the rotation
        free = fit(
            **arguments | {"start": pinned.map, "fit": mode} | ({"turn": "any"} if pins_fix_turn else {})
        )
        missed_now = missed(free)
        gained = [name for name, is_gained in zip(names, missed_before & ~missed_now) if is_gained]
        if (
            free.status.ok
            and missed_now.sum() < missed_before.sum()
            and _cost(free) <= MOST_COST_RATIO * _cost(plain)
        ):
            tell(
                f"{target.spec}: the search starts from elements with the same names in both drawings: "
                f"{', '.join(gained)} (names)"
            )
            return free
    return plain


def read_start(job: Job) -> Fit:
    """Return the map that a job continues from.

    Raises:
        InputError: the file cannot be read, the map is not of the balanced method, or the job cannot use such a map.
    """
    from ...maps.triangulated.map import TriangulatedMap
    from ...result import load

    if job.several or not job.exact:
        needed = f"--parts {job.parts}" if job.exact else "--method balanced"
        raise InputError(
            f"--start: only works with one balanced map, {'not with' if job.exact else 'so add'} {needed}"
        )
    files.open_input(job.start or "")
    fit = load(job.start or "")
    if not isinstance(fit.map, TriangulatedMap):
        raise InputError(f"{job.start}: not a balanced map, so --start cannot continue from it")
    return fit


def go_on(
    start: Fit,
    source: Shape,
    target: Shape | None,
    arguments: dict[str, Any],
    *,
    holed: bool,
    tell: Callable[[str], None],
) -> Fit:
    """Solve as in `solve`, starting from an earlier map; if a new map is `better`, return that with a note.

    A map of exactly the same shapes is returned unchanged.
    """
    free = not any(arguments.get(name) is not None for name in CONSTRAINTS)
    if target is not None and start.target is not None and free:
        earlier = [start.source, *start.source_holes], [start.target, *start.target_holes]
        if all(
            _is_same([shape.curve, *(Curve(shape.holes[k]) for k in shape.mappable_holes if holed)], rings)
            for shape, rings in zip((source, target), earlier)
        ):
            return start
    continued = None
    with suppress(NoMapError, InputError):
        if start.details.filled is None and (not holed or _have_holes(start, source, target)):
            continued = solve(source, target, arguments | {"start": start.map}, holed=holed, tell=tell)
    best = better(start, continued, lambda: solve(source, target, arguments, holed=holed, tell=tell))
    if best is not continued:
        tell(
            f"{(target or source).spec}: the shapes differ too much from those of the earlier map, so a "
            "new one is computed"
        )
    return best


def better(start: Fit, continued: Fit | None, anew: Callable[[], Fit]) -> Fit:
    """Return the map that was continued from another, or a new one if that is better.

    Args:
        start: the earlier map.
        continued: the map continued from it; None if that failed.
        anew: computes a map of the same shapes from scratch. It is called if the continued map costs more than
            `MOST_COST_RATIO` times as much as the earlier one, or if protrusions have merged or separated. Its map is
            returned if it costs less: by that factor in the first case, by any amount in the second.
    """
    if continued is None or not continued.status.ok:
        return anew()
    outlines = (start.source, continued.source), (start.target, continued.target)
    ratio = 1.0 if any(a and b and is_reshaped(a, b) for a, b in outlines) else MOST_COST_RATIO
    if ratio > 1 and _cost(continued) <= ratio * _cost(start):
        return continued
    new = anew()
    return new if new.status.ok and _cost(continued) > ratio * _cost(new) else continued


def _have_holes(start: Fit, source: Shape, target: Shape | None) -> bool:
    """Return whether shapes have the same numbers of holes as the shapes of a map."""
    sides = zip((source, target), (start.source_holes, start.target_holes))
    return all(len(shape.mappable_holes) == len(holes) for shape, holes in sides if shape)


def _is_same(outlines: list[Curve], rings: list[Curve]) -> bool:
    """Return whether outlines are the same up to rounding and the choice of the first vertex, in the same order."""
    return len(outlines) == len(rings) and all(
        a.z.size == b.z.size and b.distances(a.z).max() <= SAME_OUTLINE_SHARE * a.diagonal
        for a, b in zip(outlines, rings)
    )


def _cost(fit: Fit) -> float:
    """Return the cost of a map, without that of its rotation; see `drawings.cost`."""
    from ...drawings.cost import Cost

    coverage = fit.coverage
    if coverage.seen is not None:
        return coverage.seen.total
    energies = fit.distortion.energies()["total"]
    energy = float(np.average(energies, weights=fit.distortion.area))
    return Cost(energy, coverage.left_out, coverage.uncovered).total


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
