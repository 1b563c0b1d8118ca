"""Shapes from files of every format: `file` or `file#id` to a domain in the core plane."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Box, Complex
from ...curve import Curve
from ...errors import InputError
from ..svg import reader as svg
from ..svg.drawing import Drawing
from ..svg.fill import Outline
from . import planar_obj, silhouette


@dataclass(frozen=True, eq=False)
class Shape:
    """A planar domain as read from a file.

    Attributes:
        spec: what the user wrote, `file` or `file#id`.
        path: the file.
        curve: the domain's boundary in the core plane (y up), counter-clockwise and simple.
        box: lower left and upper right corner of the canvas in the core plane.
        flip: whether the file's y axis points down.
        pins: places of pins drawn in the file, by name, core plane.
        strokes: strokes drawn in the file, by name, core plane.
        notes: sentences about what was left out or changed.
    """

    spec: str
    path: Path
    curve: Curve
    box: Box
    flip: bool
    pins: dict[str, complex]
    strokes: dict[str, Curve]
    notes: tuple[str, ...] = ()

    def to_core(self, xy: ArrayLike) -> Complex:
        """(..., 2) coordinates in the file's units to complex numbers of the core plane."""
        xy = np.asarray(xy, dtype=float)
        return _core(xy[..., 0] + 1j * xy[..., 1], self.flip)

    def to_file(self, z: ArrayLike) -> NDArray[np.float64]:
        """Complex numbers of the core plane to (..., 2) coordinates in the file's units."""
        points: Complex = _core(np.asarray(z, dtype=complex), self.flip)
        return np.stack([points.real, points.imag], axis=-1)


THINNEST = 1e6  # square of the outline's length by the area: of a strip, four times its length by its width
PICTURES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".webp", ".bmp", ".exr")
READERS: dict[str, tuple[Callable[..., Drawing], int]] = {
    ".svg": (svg.read, svg.MAX_BYTES),
    ".svgz": (svg.read, svg.MAX_BYTES),
    ".obj": (planar_obj.read, planar_obj.MAX_BYTES),
    **dict.fromkeys(PICTURES, (silhouette.read, silhouette.MAX_BYTES)),
}


def split(spec: str) -> tuple[Path, str | None]:
    """`file#id` as file and id; a file that is really called so is taken whole."""
    file, mark, chosen = spec.rpartition("#")
    if not mark or Path(spec).exists():
        return Path(spec), None
    return Path(file), chosen or None


def read(
    spec: str,
    *,
    vertices: int | None = None,
    flatness: float = 1e-4,
    max_bytes: int | None = None,
    max_segments: int | None = None,
) -> Shape:
    """The shape that `spec` names: `file`, `file#id` or `file#number`.

    Without an id it is the largest outline of the file; an id is an SVG element's or group's id or Inkscape label, or
    an OBJ object or group; a number counts the outlines from the largest, 1. Curves are flattened to `flatness` times
    the shape's size with corners kept exactly; `vertices` resamples the result to about so many even edges.

    Raises:
        InputError: anything that makes the file no domain, in one line: file, place, what is wrong, what to do.
    """
    path, chosen = split(spec)
    drawing = drawn(path, chosen, flatness=flatness, max_bytes=max_bytes, max_segments=max_segments)
    outline, notes = _choose(drawing, spec, chosen)
    curve = Curve.domain(_core(outline.z, drawing.flip), spec)
    if curve.length**2 > THINNEST * curve.area:
        times = curve.length**2 / (4 * curve.area)
        raise InputError(
            f"{spec}: the shape is about {times:.2g} times as long as wide; make it wider, or shorter"
        )
    if vertices is not None:
        curve = Curve.domain(curve.resample(vertices).z, f"{spec} with {vertices} vertices")
    strokes = {k: Curve.stroke(_core(z, drawing.flip), f"{path}: {k}") for k, z in drawing.strokes.items()}
    pins = {k: complex(_core(z, drawing.flip)) for k, z in drawing.pins.items()}
    box = _box(drawing, curve)
    return Shape(spec, path, curve, box, drawing.flip, pins, strokes, tuple(notes))


def drawn(
    path: Path,
    chosen: str | None = None,
    *,
    flatness: float = 1e-4,
    max_bytes: int | None = None,
    max_segments: int | None = None,
) -> Drawing:
    """Everything that a file draws, by the reader that its suffix names.

    Raises:
        InputError: an unknown suffix, or what the reader finds wrong.
    """
    if not 1e-9 <= flatness <= 0.1:
        raise InputError(
            f"flatness {flatness:g}: a number from 1e-9 to 0.1, relative to the shape's size, is needed"
        )
    if path.suffix.lower() not in READERS:
        kind = repr(path.suffix) if path.suffix else "a file without suffix"
        raise InputError(f"{path}: no shape is read from {kind}; use one of {', '.join(sorted(READERS))}")
    reader, limit = READERS[path.suffix.lower()]
    number = chosen if chosen is not None and chosen.isdecimal() else None
    options: dict[str, Any] = {"flatness": flatness, "max_bytes": max_bytes or limit}
    if max_segments is not None and reader is svg.read:
        options["max_segments"] = max_segments
    drawing = reader(path, chosen, **options)
    if number is None or drawing.outlines or drawing.refused:
        return drawing
    return reader(path, None, **options)


def _choose(drawing: Drawing, spec: str, chosen: str | None) -> tuple[Outline, list[str]]:
    """The outline that is meant, and the notes about all the others."""
    found = drawing.outlines
    number = int(chosen) if chosen is not None and chosen.isdecimal() and chosen not in drawing.ids else None
    if chosen is not None and number is None and chosen not in drawing.ids:
        raise InputError(f"{spec}: no {chosen!r} in the file; it has {_listed(drawing.ids)}")
    if number is not None and not 1 <= number <= len(found):
        raise InputError(f"{spec}: no outline {number}; the file has {len(found)}")
    largest = max(drawing.refused, key=lambda r: r[0], default=None)
    if largest and (not found or (number is None and largest[0] > found[0].area)):
        raise InputError(f"{spec}: {largest[1]}")
    if not found:
        raise InputError(
            f"{spec}: nothing in it has an outline; draw a closed path (text must be made paths)"
        )
    outline = found[(number or 1) - 1]
    return outline, [*drawing.notes, *outline.notes, *_left_out(drawing, outline)]


def _left_out(drawing: Drawing, outline: Outline) -> list[str]:
    notes = []
    if outline.holes:
        count = len(outline.holes)
        notes.append(f"{outline.name}: left out {count} hole{'s' * (count > 1)}")
    others = [o for o in drawing.outlines if o is not outline]
    if others:
        share = others[0].area / outline.area
        notes.append(
            f"left out {len(others)} other outline{'s' * (len(others) > 1)}, "
            f"the largest {share:.1%} of this one's area; #id or #2 picks another"
        )
    notes += [f"left out: {error}" for _, error in drawing.refused]
    return notes


def _listed(ids: list[str], most: int = 12) -> str:
    if not ids:
        return "no names"
    more = f" and {len(ids) - most} more" if len(ids) > most else ""
    return ", ".join(ids[:most]) + more


def _box(drawing: Drawing, curve: Curve) -> Box:
    if drawing.rectangle is None:
        return curve.box
    x, y, width, height = drawing.rectangle
    low = y + height if drawing.flip else y
    high = y if drawing.flip else y + height
    return complex(_core(complex(x, low), drawing.flip)), complex(
        _core(complex(x + width, high), drawing.flip)
    )


def _core(z, flip: bool):
    return z.conjugate() if flip else z
