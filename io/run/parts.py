"""`--parts`: map the shapes of both files in pairs, or one onto each, and report on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Complex, Index
from ...errors import InputError, first_names
from .. import formats, limits
from ..spec import Spec
from . import framing
from .job import Job
from .phases import Doubt

if TYPE_CHECKING:
    import shapely

    from ...drawings.drawing import Drawing
    from ...maps.triangulated.map import TriangulatedMap
    from ...pixels.composed import Several
    from ...pixels.preimages import AnyMap
    from ...solve import Fit
    from ..shapes.shape import Shape
    from .inputs import Inputs

Pair = tuple["Shape", "Shape"]
Pairs = list[Pair]

LISTED_PARTS = 12  # largest number of parts that a note names
TOUCHING_AREA_SHARE = 1e-3  # relative to the smaller part's area: parts that overlap by less only touch
FIGURES = ("status", "boundary", "dilatation", "log10_area", "injective", "notes")


def read(job: Job, inputs: Inputs) -> tuple[Pairs, list[str], dict[str, Any]]:
    """Return pairs of shapes, the largest targets first, with notes and figures on those without a partner.

    Raises:
        InputError: a file has no shapes, or there are constraints, which are possible for one shape only.
    """
    from ..shapes import parts

    if job.has_pins:
        raise InputError(f"--parts {job.parts}: pins and strokes only work for one shape; choose it with #id")
    for name in ("rigid", "rigid_target", "importance", "size_map"):
        if getattr(job, name):
            option = f"--{name.replace('_', '-')}"
            raise InputError(f"--parts {job.parts}: {option} only works for one shape; choose it with #id")
    if job.parts == "each":
        is_placed = _is_placed_whole(job, inputs)
        source = inputs.drawing(job.source) if is_placed else inputs.shape(job.source)
        targets, more_notes = inputs.shapes(job.target or "", limits.PARTS, target=True, source=source)
        if is_placed:
            targets = [_as_drawing(target) for target in targets]
        empty_ones: list[str] = [Doubt(f"{note}; they stay empty") for note in more_notes]
        pairs = [(source, target) for target in targets]
        return _with_overlap(_at_one_scale(pairs) if _is_pattern(job, source) else pairs, empty_ones, {})
    if job.parts == "elements":
        return _onto_elements(job, inputs)
    sources, notes = inputs.shapes(job.source, limits.PARTS)
    targets, more_notes = inputs.shapes(job.target or "", limits.PARTS, target=True)
    notes += more_notes
    turn = job.turn if isinstance(job.turn, float | int) else 0.0
    matches = parts.pair(sources, targets, turn)
    if not job.texture:
        matches, more_notes = _of_one_picture(sources, targets, matches)
        notes += more_notes
    alone = [
        [shape for number, shape in enumerate(shapes) if number not in paired]
        for shapes, paired in zip((sources, targets), zip(*matches))
    ]
    empty = sum(shape.curve.area for shape in alone[1]) / sum(shape.curve.area for shape in targets)
    if alone[0]:
        notes.append(_unpaired(alone[0], targets[0].spec))
    if alone[1]:
        cure = "; use --parts each to map the source onto each" if len(sources) == 1 else ""
        consequence = f"they stay empty, {empty:.0%} of the total area{cure}"
        notes.append(Doubt(f"{_unpaired(alone[1], sources[0].spec)}: {consequence}"))
    figures = {
        "source": [shape.part for shape in alone[0]],
        "target": [shape.part for shape in alone[1]],
        "empty": empty,
    }
    pairs = [(sources[i], targets[j]) for i, j in sorted(matches, key=lambda pair: pair[1])]
    return _with_overlap(pairs, notes, {"unpaired": figures} if any(alone) else {})


def _of_one_picture(
    sources: Sequence[Shape], targets: Sequence[Shape], matches: list[tuple[int, int]]
) -> tuple[list[tuple[int, int]], list[str]]:
    """Return the pairs of two meshes whose sources show the same picture as that of the largest target, with a note on
    the others.
    """
    if not all(shape.is_mesh for shape in (sources[0], targets[0])):
        return matches, []
    largest_pair = min(matches, key=lambda pair: pair[1])
    picture = sources[largest_pair[0]].pictures[:1]
    other_pairs = [pair for pair in matches if sources[pair[0]].pictures[:1] != picture]
    if not other_pairs:
        return matches, []
    names = ", ".join(_name(sources[i]) for i, _ in other_pairs[:LISTED_PARTS])
    largest = _name(sources[largest_pair[0]])
    cure = f"than {largest}, so they are left out; map them separately, or name one --texture for all"
    note = f"{sources[0].spec}: {names} show{'' if len(other_pairs) > 1 else 's'} another picture {cure}"
    return [pair for pair in matches if pair not in other_pairs], [Doubt(note)]


def _onto_elements(job: Job, inputs: Inputs) -> tuple[Pairs, list[str], dict[str, Any]]:
    """Return the source paired with each letter or element of the target, with notes on those beyond the limit.

    Raises:
        InputError: a shape is a mesh.
    """
    source = inputs.shape(job.source)
    target = inputs.shape(job.target or "", target=True, source=source)
    for shape in (source, target):
        if shape.drawing is None:
            raise InputError(
                f"{shape.spec}: --parts elements only works for planar drawings; use --parts each for meshes"
            )
    elements = target.by_element()
    beyond = max(len(elements) - limits.PARTS, 0)
    notes: list[str] = []
    if beyond:
        text = f"{target.spec}: ignored {beyond} elements, because only the {limits.PARTS} largest are mapped"
        notes.append(Doubt(f"{text}; they stay empty"))
    pairs = [(source, element) for element in elements[: limits.PARTS]]
    return _with_overlap(_at_one_scale(pairs) if _is_pattern(job, source) else pairs, notes, {})


def _is_placed_whole(job: Job, inputs: Inputs) -> bool:
    """Return whether the source is a planar drawing that is its own picture, and is placed whole in each target."""
    if job.texture or job.fit not in (None, "auto") or job.detail == 0 or job.holes not in ("auto", "fill"):
        return False
    spec = Spec.of(job.source)
    if spec.selection or inputs.is_mesh(job.source) or inputs.is_mesh(job.target or ""):
        return False
    return inputs.drawing(job.source).coloured


def _as_drawing(shape: Shape) -> Shape:
    """Return a shape with what it paints, as a drawing of one part."""
    from ...curve import polygon_of
    from ...drawings.drawing import Drawing

    drawing = Drawing(polygon_of(shape.curve.z, *shape.holes))
    return replace(shape, drawing=drawing, ink=drawing)


def _is_pattern(job: Job, source: Shape) -> bool:
    """Return whether the texture repeats endlessly, so that any part of the source's plane shows it at its scale."""
    drawings = any(formats.of(name).drawing for name in job.output if name != "-")
    return framing.repeats(job) and job.place == "fill" and not source.is_mesh and not drawings


def _at_one_scale(pairs: Pairs) -> Pairs:
    """Scale the source for each target relative to the largest one, so that all show a pattern at the same scale."""
    largest = max(target.curve.area for _, target in pairs)  # of the frame around all parts of an element
    return [(source.scaled(float(np.sqrt(target.curve.area / largest))), target) for source, target in pairs]


def _with_overlap(
    pairs: Pairs, notes: list[str], figures: dict[str, Any]
) -> tuple[Pairs, list[str], dict[str, Any]]:
    """Return what `read` returns, with a note and a figure on overlapping targets."""
    overlap, crossing = _overlaps([target for _, target in pairs])
    if crossing:
        first, second = (_name(target) for target in crossing[0])
        further = f" and {len(crossing) - 1} more" if len(crossing) > 1 else ""
        covered = f"parts overlap, such as {first} and {second}{further}; the smaller one lies on top"
        notes = [*notes, Doubt(f"{pairs[0][1].spec}: {covered}")]
    return pairs, notes, figures | ({"overlap": overlap} if overlap else {})


def _overlaps(shapes: Sequence[Shape]) -> tuple[float, list[tuple[Shape, Shape]]]:
    """Return the share of all parts' area that is covered twice, and the pairs that overlap partially.

    A part inside another is not reported, because it is meant to be drawn over it.
    """
    import shapely

    from ...curve import polygon_of

    def unreflected(z: Complex, line: float | None) -> Complex:
        return z if line is None else 2 * line - z.conj()

    regions = np.array(
        [
            polygon_of(*(unreflected(z, shape.mirror) for z in (shape.curve.z, *shape.holes)))
            for shape in shapes
        ]
    )
    first, second = shapely.STRtree(regions).query(regions, "intersects")
    once = first < second
    first, second = first[once], second[once]
    common = shapely.area(shapely.intersection(regions[first], regions[second]))
    areas = shapely.area(regions)
    least = np.minimum(areas[first], areas[second])
    partly = (common > TOUCHING_AREA_SHARE * least) & (common < (1 - TOUCHING_AREA_SHARE) * least)
    total = float(areas.sum())
    share = 1 - float(shapely.area(shapely.union_all(regions))) / total
    return (share if share > TOUCHING_AREA_SHARE else 0.0), [
        (shapes[i], shapes[j]) for i, j in zip(first[partly], second[partly])
    ]


def _unpaired(alone: Sequence[Shape], others: str) -> str:
    names = first_names([_name(shape) for shape in alone], LISTED_PARTS)
    return f"{alone[0].spec}: no matching part in {others} for {names}"


def _name(shape: Shape) -> str:
    """Return a part as messages refer to it: its number, and its name if it has one."""
    suffix = f" ({shape.names[-1]})" if shape.names else ""
    return f"#{shape.part}{suffix}"


def label(pair: Pair, note: str) -> str:
    """Return a note prefixed with the part that it is about: the source's, or else the target's, if there are
    several.
    """
    part = pair[0].part or pair[1].part
    return f"#{part}: {note}" if part else note


def compose(pairs: Pairs, fits: Sequence[Fit], maps: Sequence[AnyMap]) -> Several:
    """Combine the maps of all parts, with small parts over large ones; `maps` are the prepared maps of `fits`."""
    from ...curve import Curve
    from ...pixels.composed import Several, reflected

    boxes = [reflected(Curve(fit.image).box, target.mirror) for (_, target), fit in zip(pairs, fits)]
    return Several(maps[::-1], boxes[::-1])


def numbers_of_maps(source: Shape, target: Shape, maps: Sequence[TriangulatedMap]) -> list[tuple[int, int]]:
    """Return the numbers of the parts of both drawings that maps are of: those which their outlines overlap most.

    Raises:
        InputError: two of the maps are of the same part, or a shape has no parts.
    """
    from ...curve import Curve

    sides = []
    for shape, side in ((source, "source"), (target, "image")):
        outlines = [Curve(getattr(map, side)[map.loops[0]]).polygon for map in maps]
        painted = [] if shape.drawing is None else shape.drawing.parts
        shares = np.array([[_overlap(outline, part) for part in painted] for outline in outlines])
        sides.append(shares.argmax(axis=1).tolist() if shares.size else [0] * len(maps))
    if any(len(set(numbers)) < len(maps) for numbers in sides):
        raise InputError(
            "start: the triangles do not form a disk, with or without holes, nor maps of the parts of both drawings"
        )
    return [*zip(*sides)]


def _overlap(outline: shapely.Polygon, part: shapely.Polygon) -> float:
    """Return the area that two outlines share, relative to that of both together."""
    import shapely

    filled = shapely.Polygon(part.exterior)
    return float(outline.intersection(filled).area / outline.union(filled).area)


def drawings_of(
    source: Shape, target: Shape, numbers: Sequence[tuple[int, int]]
) -> list[tuple[Drawing, Drawing]]:
    """Return pairs of parts with these numbers as drawings."""
    from ...drawings.drawing import Drawing

    assert source.drawing is not None and target.drawing is not None
    return [(Drawing(source.drawing.parts[i]), Drawing(target.drawing.parts[j])) for i, j in numbers]


def pins_in_order(reports: Sequence[dict[str, Any]], numbers: Sequence[Index]) -> list[dict[str, Any]]:
    """Return the entries of all parts' pins in the order in which they were given; `numbers` are those in each part."""
    entries = {
        int(k): entry for report, own in zip(reports, numbers) for k, entry in zip(own, report["pins"])
    }
    return [entries[k] for k in sorted(entries)]


def figures(pairs: Pairs, reports: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the entries of the report for each part.

    Args:
        pairs: the shapes.
        reports: the solver's report for each part.
    """
    return [
        {"source": source.part, "target": target.part} | {name: report[name] for name in FIGURES}
        for (source, target), report in zip(pairs, reports)
    ]


def shares_seen(fits: Sequence[Fit]) -> dict[str, float]:
    """Return how much all parts together show of both drawings, as in `Fit.report`; empty if they are not drawings."""
    rows = [
        (fit, *(drawing.region.area for drawing in fit.details.drawings))
        for fit in fits
        if fit.details.drawings
    ]
    if len(rows) < len(fits):
        return {}
    sources, targets = (np.array([row[side] for row in rows]) for side in (1, 2))
    return {
        "shown": float(np.average([1 - fit.coverage.hidden for fit in fits], weights=sources)),
        "covered": float(np.average([1 - fit.coverage.bare for fit in fits], weights=targets)),
        "cracks": float(np.average([fit.coverage.cracks for fit in fits], weights=targets)),
    }


def without_map(failed: Sequence[tuple[Pair, InputError]]) -> list[dict[str, Any]]:
    """Return the entries of the report for parts without a map."""
    return [
        {"source": source.part, "target": target.part, "message": str(error)}
        for (source, target), error in failed
    ]
