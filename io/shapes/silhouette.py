"""Pictures as outlines: opaque regions, or what stands out from the background, traced with subpixel accuracy.

Coordinates are pixels, x right and y down; the centre of the upper left pixel is at (0.5, 0.5).
"""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from ... import progress
from ...arrays import complex_of
from ...errors import InputError, naming
from ...pixels.raster import Components, depths, dilated, eroded, pieces, resized_by_area, resized_linearly
from .. import files, limits
from ..svg import affine
from ..svg.drawing_content import DrawingContent, WrappedPicture
from ..svg.fill import FilledOutline

if TYPE_CHECKING:
    from ..pictures.image import Image

STRAY_PIXEL_SHARE = 1e-3  # of the pixels: fewer transparent pixels in an opaque picture are not a shape
SPECK_PIXELS = 4  # pixels; smaller pieces are noise
# Tolerances of outlines in pixels. In a mask without grey levels, the outline is known to half a pixel, and a straight
# edge is a staircase that deviates that far to either side: less than 0.75 would keep the steps.
SOFT_TOLERANCE_PIXELS, HARD_TOLERANCE_PIXELS = 0.25, 0.75
UNEVEN_BORDER_SHARE = 0.1
"""Of the border's pixels: if more are neither background nor shape, the background is not plain."""
EXACT_COLOUR_DISTANCE, ALIKE_COLOUR_DISTANCE = 0.03, 0.06
"""Differences of colours that are ignored: in a flat background, and with noise or JPEG artefacts."""
FLAT_BORDER_SHARE, HALF_BORDER_SHARE, CUT_SIDES, SLIVER_SHARE = 0.9, 0.5, 2, 0.02
"""Shares of the border. A background is plain if one colour has FLAT_BORDER_SHARE of it; or HALF_BORDER_SHARE of it, if
the object is cut off by at most CUT_SIDES sides, once each, like a bust: horizons, crosses of flags and contents of
photographs reach three or four sides. Contacts shorter than SLIVER_SHARE of a side do not count."""
LINE_WIDTHS_PER_SIDE = 32  # longer side / largest width of a pencil line around a drawing
FEW_SHARE = 0.005  # of the pixels: fewer of another colour, such as noise, do not count
CANVAS, SILHOUETTE = "canvas", "silhouette"
PHOTOGRAPH = (
    "the whole rectangle is used, because the picture has no transparency and no plain background "
    "(#silhouette or --trace uses the part that stands out)"
)
INSIDE = "the inside of the line is used; --trace dark uses the line itself"
LEAST_LEVEL_DISTANCE = 1e-3
"""Least difference of each pixel's coverage from the contour level, which keeps contours apart: a thousandth of a
pixel."""


class Handed:
    """Keeps the first picture that a shape is read from, decoded, until its colours are needed.

    A picture is often its own texture, as most photographs are. Pictures with more than `MOST` values are not kept.
    """

    MOST = 1 << 26  # 64 MB of bytes; 4600 by 4600 pixels of three channels

    def __init__(self) -> None:
        self._kept_picture: tuple[object, Image, Reading] | None = None

    def keep(self, path: Path, trace: str, part: str | None, image: "Image", reading: "Reading") -> None:
        """Keep a picture, unless there is one already."""
        if self._kept_picture is None and image.pixels.size <= self.MOST:
            self._kept_picture = _key(path, trace, part), image, reading

    def clear(self) -> None:
        """Forget the picture, so that the next one is kept."""
        self._kept_picture = None

    def take(self, path: Path, trace: str, part: str | None) -> "tuple[Image, Reading] | None":
        """Return the kept picture if its file has not changed, and forget it; None otherwise."""
        kept_picture, self._kept_picture = self._kept_picture, None
        return kept_picture[1:] if kept_picture and kept_picture[0] == _key(path, trace, part) else None


def _key(path: Path, trace: str, part: str | None) -> object:
    """Return a key for a picture's file, its state, and how it is read."""
    try:
        state = path.stat()
    except OSError:
        return object()
    return os.path.realpath(path), state.st_mtime_ns, state.st_size, trace, part


def read(
    path: Path,
    selection: str | None = None,
    *,
    flatness: float = 1e-4,
    max_bytes: int = limits.DRAWING_BYTES,
    max_pixels: int = limits.SILHOUETTE_PIXELS,
    trace: str = "auto",
) -> DrawingContent:
    """Return the outlines in a picture: of its alpha channel, of an object on a plain background, or of a scan.

    With `trace` "auto", alpha is used if it varies, then differences from a plain background, then `scan`, which copes
    with uneven light. For a line that encloses much more area than its own, the inside is used. A thin line has
    priority if less than half of its inside was found in this way, as for a drawing on paper with darker areas. A
    picture without any background is a photograph; its rectangle is used, with a note. For "dark", "light" and
    "inside" see `scan.field_of`.

    Outlines are contours at a coverage of one half between pixel centres: smooth curves with corners, accurate to 0.25
    pixels (0.75 in a mask without grey levels), or to `flatness` times their diagonal if that is more.

    Args:
        path: the picture.
        selection: `canvas` for the rectangle of any picture, `silhouette` to trace photographs, too; or None.
        flatness: tolerance relative to the diagonal of outlines.
        max_bytes, max_pixels: limits on the picture's size.
        trace: see above.

    Raises:
        InputError: not a picture, too large, or nothing in it stands out.
    """
    from ..pictures import georeferenced, image_files, rasters

    files.open_input(path, max_bytes=max_bytes)
    numbers = rasters.read(path, max_pixels=max_pixels)
    # what a raster marks as without data is transparent
    image = numbers if numbers and numbers.alpha >= 0 else image_files.read(path, max_pixels=max_pixels)
    height, width = image.pixels.shape[:2]
    part = part_of(selection)
    with naming(path):
        reading = interpret(image.pixels, image.alpha, trace, part)
        coloured = has_colours(image.pixels, image.alpha, reading)
        if coloured and image is not numbers:
            handed.keep(path, trace, part, image, reading)
        place, note = georeferenced.read(path)
        canvas = (0.0, 0.0, float(width), float(height))
        drawing = DrawingContent([], canvas, flip=True, coloured=coloured, georeference=place)
        drawing.ids.update({part: None} if part in (CANVAS, SILHOUETTE) else {})
        drawing.notes.extend(reading.notes)
        drawing.notes.extend([note] if note else [])
        if reading.field is None:
            corners = np.array([0, width, width + 1j * height, 1j * height])
            drawing.outlines.append(FilledOutline("the whole picture", corners, float(width * height)))
            return drawing
        traced_outlines, specks = traced(reading.field, flatness)
    drawing.outlines.extend(_enlarged(outline, reading.scale) for outline in traced_outlines)
    if specks:
        drawing.notes.append(
            f"ignored {specks} speck{'s' * (specks > 1)} smaller than {SPECK_PIXELS} pixels or beyond the "
            f"{limits.PIECES} largest pieces"
        )
    return drawing


def of_wrapped(picture: WrappedPicture, flatness: float) -> list[FilledOutline]:
    """Return the outlines of a picture that is a drawing's only content, in the drawing's units.

    Empty if the picture's alpha does not vary.

    Raises:
        InputError: it cannot be read.
    """
    from ..pictures import image_files

    image = image_files.read_held(picture.content, picture.name)
    reading = interpret(image.pixels, image.alpha)
    if reading.kind != "alpha" or reading.field is None:
        return []
    height, width = image.pixels.shape[:2]
    fit = picture.to_root @ affine.viewport(picture.place, (0.0, 0.0, width, height), picture.aspect)
    enlarged = [_enlarged(outline, reading.scale) for outline in traced(reading.field, flatness)[0]]
    return [
        FilledOutline(
            picture.name,
            fit(outline.z),
            outline.area * abs(fit.determinant),
            tuple(fit(hole) for hole in outline.holes),
        )
        for outline in enlarged
    ]


def part_of(selection: str | None) -> str | None:
    """Return the name in `name`, `name#number` or `number`; None without a name."""
    name, _, number = (selection or "").rpartition("#")
    return (name if number.isdecimal() else selection) or None


@dataclass(frozen=True, eq=False)
class Reading:
    """The interpretation of a picture: which part of it is the shape.

    Attributes:
        kind: how it was found: by "alpha", on a "plain" background, in a "scan", as the inside of a "line", or the
            whole "rectangle".
        field: (h, w) coverages to be traced; None for the rectangle.
        scale: width of their pixels in pixels of the picture.
        notes: what the user should know about it.
    """

    kind: str
    field: NDArray[np.float32] | None
    scale: float = 1.0
    notes: tuple[str, ...] = ()


def interpret(pixels: NDArray, alpha: int, trace: str = "auto", part: str | None = None) -> Reading:
    """Find the shape in a picture, see `read`.

    Raises:
        InputError: nothing stands out, or values are not finite.
    """
    if part == CANVAS:
        return Reading("rectangle", None)
    if trace == "auto" and _is_alpha(pixels, alpha):
        return Reading("alpha", coverage(pixels, alpha))
    small, by = _shrunk(pixels)
    reading = _opaque_reading(small, alpha, trace, part)
    if by == 1:
        return reading
    if reading.kind == "plain":  # recompute at full resolution, to locate the edge as finely as possible
        return replace(reading, field=coverage(pixels, alpha))
    return replace(reading, scale=by * reading.scale)


def _shrunk(pixels: NDArray) -> tuple[NDArray, float]:
    """Reduce a picture of more than twice scan.LONGER_SIDE_PIXELS pixels to that size; return it and the scale.

    The shape is recognized as well in a small picture, in a hundredth of the time.
    """
    from . import scan

    height, width, channels = pixels.shape
    by = max(height, width) / scan.LONGER_SIDE_PIXELS
    if by <= 2 or channels > 4 or pixels.dtype not in (np.uint8, np.uint16, np.float32):
        return pixels, 1.0
    size = max(1, round(width / by)), max(1, round(height / by))
    return resized_by_area(pixels, size), width / size[0]


def _opaque_reading(pixels: NDArray, alpha: int, trace: str, part: str | None) -> Reading:
    """Find the shape in a picture without transparency."""
    from . import scan

    reading = _foreground(pixels, alpha, trace, part)
    if trace != "auto" or part == SILHOUETTE or reading.kind not in ("rectangle", "plain", "scan"):
        return reading
    ink = reading.field if reading.kind == "plain" else None
    line = scan.thin_line(straight_colours(pixels, alpha), ink)
    if line is None:
        return reading
    field, scale = line
    inside = field >= HALF_BORDER_SHARE
    if reading.field is not None and np.mean(opaque_part(reading, inside.shape)[inside]) >= HALF_BORDER_SHARE:
        return reading
    return Reading("line", field, scale, (INSIDE,))


def _foreground(pixels: NDArray, alpha: int, trace: str, part: str | None) -> Reading:
    """Find what stands out from the background of an opaque picture."""
    from . import scan

    photographs = trace == "auto" and part != SILHOUETTE
    if trace == "auto":
        field = coverage(pixels, alpha)
        if _is_plain(pixels, alpha, field, strict=photographs):
            ink = field >= 0.5
            if not scan.is_line(ink):
                return Reading("plain", field)
            try:
                return Reading("line", scan.smooth(scan.inside_of(ink)), 1.0, (INSIDE,))
            except InputError:
                return Reading("plain", field)
    colours = straight_colours(pixels, alpha)
    try:
        field, by, inside = scan.field_of(colours, trace, photographs=photographs)
    except InputError:
        if not photographs:
            raise
        return Reading("rectangle", None, 1.0, (PHOTOGRAPH,))
    return Reading("line" if inside else "scan", field, by, (INSIDE,) if inside and trace == "auto" else ())


def opaque_part(reading: Reading, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Return (h, w) the coverage of a picture's pixels by the object, for a picture of the given shape.

    Pixels like the background count as covered if the object surrounds them.
    """
    height, width = shape
    if reading.field is None:
        return np.ones(shape, np.float32)
    field = np.clip(reading.field, 0, 1)
    if field.shape != shape:
        field = resized_linearly(field, (width, height))
    inside = field >= 0.5
    return np.where(eroded(inside), 1, np.where(dilated(inside), field, 0)).astype(np.float32)


def has_colours(pixels: NDArray, alpha: int, reading: Reading) -> bool:
    """Return whether the object in a picture has more than one colour, and so is more than a shape.

    Pixels at its edge are ignored, since they are mixed with the background; for the inside of a line, so is the line.
    """
    from . import scan

    # subsample large pictures, without mixing pixels
    step = max(1, max(pixels.shape[:2]) // scan.LONGER_SIDE_PIXELS)
    pixels = pixels[::step, ::step]
    height, width = pixels.shape[:2]
    mask = opaque_part(reading, (height, width)) >= 0.5
    edge = max(height, width) // LINE_WIDTHS_PER_SIDE if reading.kind == "line" else 1
    if reading.field is not None:
        mask = (depths(np.pad(mask, 1)) > edge)[1:-1, 1:-1]
    colours = straight_colours(pixels, alpha)
    largest = float(colours.max()) if pixels.dtype.itemsize > 1 else 1.0  # of 16 bits, few may be used
    colours = colours[mask]
    if not colours.size:
        return False
    low, high = np.quantile(colours, [FEW_SHARE, 1 - FEW_SHARE], axis=0)
    return bool((high - low).max() > ALIKE_COLOUR_DISTANCE * largest)


def straight_colours(pixels: NDArray, alpha: int) -> NDArray[np.float32]:
    """Return (h, w, c) colours without alpha, from 0 to 1."""
    scale = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    if pixels.dtype.kind == "f" and not np.isfinite(pixels).all():
        raise InputError("some pixels are not finite numbers")
    colours = np.delete(pixels, alpha, axis=2) if alpha >= 0 else pixels
    return (colours / np.float32(scale)).astype(np.float32)


def _is_plain(pixels: NDArray, alpha: int, field: NDArray[np.float32], *, strict: bool) -> bool:
    """Return whether a picture's border is background and shape with little in between.

    If `strict`, the border must also be mostly one colour, interrupted by the shape a few times at most, and the shape
    must not consist of many pieces.
    """
    from .scan import border_of, is_scattered

    border = border_of(field)
    if np.mean((border > 0.25) & (border < 0.75)) >= UNEVEN_BORDER_SHARE:
        return False
    if not strict:
        return True
    colours = border_of(straight_colours(pixels, alpha))
    away = np.abs(colours - np.median(colours, axis=0)).max(axis=1)
    if np.mean(away <= EXACT_COLOUR_DISTANCE) >= FLAT_BORDER_SHARE:
        return True
    free = float(np.mean(away <= ALIKE_COLOUR_DISTANCE))
    shape = field >= 0.5
    sides = [shape[0], shape[-1], shape[:, 0], shape[:, -1]]
    changes = sum(int(np.count_nonzero(np.diff(side))) for side in sides)
    cut_off = (
        sum(bool(np.mean(side) > SLIVER_SHARE) for side in sides) <= CUT_SIDES and changes <= 2 * CUT_SIDES
    )
    return free >= HALF_BORDER_SHARE and (free >= FLAT_BORDER_SHARE or cut_off) and not is_scattered(shape)


def _enlarged(outline: FilledOutline, by: float) -> FilledOutline:
    if by == 1:
        return outline
    holes = tuple(by * hole for hole in outline.holes)
    return replace(outline, z=by * outline.z, area=by * by * outline.area, holes=holes)


def _is_alpha(pixels: NDArray, alpha: int) -> bool:
    """Return whether alpha defines the shape: it exists, and varies in more than a few pixels."""
    if alpha < 0:
        return False
    half = np.iinfo(pixels.dtype).max / 2 if pixels.dtype.kind == "u" else 0.5
    opaque = pixels[..., alpha]
    return bool(
        float(opaque.max()) - float(opaque.min()) > half and (opaque < half).mean() >= STRAY_PIXEL_SHARE
    )


def coverage(pixels: NDArray, alpha: int) -> NDArray[np.float32]:
    """Return (h, w) the coverage, 0 to 1, of pixels (h, w, c) by the shape.

    It is alpha if that varies in more than a few pixels, or the picture has only one colour. Otherwise it is the
    difference from the background, the median colour of the border, relative to the median difference of everything
    that stands out. This is exact for masks of two colours, light or dark.

    Raises:
        InputError: the picture has only one colour, or values that are not finite.
    """
    scale = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    if pixels.dtype.kind == "f" and not np.isfinite(pixels).all():
        raise InputError("some pixels are not finite numbers")
    if alpha >= 0:
        opaque = pixels[..., alpha].astype(np.float32) / scale
        varies = opaque.max() - opaque.min() > 0.5
        if varies and (opaque < 0.5).mean() >= STRAY_PIXEL_SHARE:
            return np.clip(opaque, 0, 1)
        if opaque.max() <= 0.5:
            raise InputError("the picture is transparent everywhere")
    colours = np.delete(pixels, alpha, axis=2) if alpha >= 0 else pixels
    border = np.concatenate([colours[0], colours[-1], colours[:, 0], colours[:, -1]])
    background = np.median(border.astype(np.float32), axis=0)
    distance = np.zeros(colours.shape[:2], np.float32)
    for channel in range(colours.shape[2]):
        away = np.abs(colours[..., channel].astype(np.float32) - background[channel])
        np.maximum(distance, away / scale, out=distance)
    if distance.max() < 0.02 and alpha >= 0 and varies:
        return np.clip(opaque, 0, 1)
    if distance.max() < 0.02:
        raise InputError(
            "the picture has a single colour; a silhouette needs alpha, or a shape on a plain background "
            "(#canvas selects the whole rectangle)"
        )
    usual = np.median(distance[distance > 0.25 * distance.max()])
    return np.clip(distance / usual, 0, 1)


def traced(field: NDArray[np.float32], flatness: float = 1e-4) -> tuple[list[FilledOutline], int]:
    """Trace the pieces of a picture of coverages; return outlines, the largest first, and the number not traced.

    Raises:
        InputError: no piece has enough pixels.
    """
    connected = pieces(field >= 0.5, diagonally=False)
    sizes = connected.sizes
    order = [int(k) for k in np.argsort(-sizes, kind="stable")[: limits.PIECES] if sizes[k] >= SPECK_PIXELS]
    if not order:
        raise InputError(f"no piece of at least {SPECK_PIXELS} pixels stands out from the background")
    outlines = [_piece(field, connected, k, flatness) for k in progress.counted("tracing pieces", order)]
    closed_outlines = [outline for outline in outlines if outline]
    if not closed_outlines:
        raise InputError("the picture contains no enclosed area")
    return sorted(closed_outlines, key=lambda o: -o.area), connected.count - len(order)


def _piece(field: NDArray, connected: Components, number: int, flatness: float) -> FilledOutline | None:
    """Trace one connected piece, counted from 0, with the pixels of all others as background."""
    from skimage.measure import find_contours

    from .smooth_outline import smooth_outline

    top, left, bottom, right = (int(n) for n in connected.boxes[number])
    rows, columns = slice(max(top - 1, 0), bottom + 1), slice(max(left - 1, 0), right + 1)
    labels = connected.labels[rows, columns]
    values = np.where((labels == number + 1) | (labels == 0), field[rows, columns], 0)
    at_level = np.abs(values - 0.5) < LEAST_LEVEL_DISTANCE
    # contours could otherwise meet at a pixel's centre
    values[at_level] = np.where(
        values[at_level] < 0.5, 0.5 - LEAST_LEVEL_DISTANCE, 0.5 + LEAST_LEVEL_DISTANCE
    )
    # a frame of zeros closes outlines at the picture's border, half a pixel beyond the outermost centres
    corner = columns.start - 0.5, rows.start - 0.5
    lines = find_contours(np.pad(values, 1), 0.5)
    contours = [shapely.Polygon(c[:, ::-1] + corner) for c in lines if len(c) > 3]
    if not contours:
        return None
    outer = max(contours, key=lambda p: p.area)
    bounds = outer.bounds
    diagonal = np.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1])
    soft = np.mean((values > 0.02) & (values < 0.98)) * values.size > 0.25 * len(outer.exterior.coords)
    tolerance = max(SOFT_TOLERANCE_PIXELS if soft else HARD_TOLERANCE_PIXELS, flatness * diagonal)
    smooth = smooth_outline(outer, tolerance, flatness * diagonal)
    inner = [c for c in contours if c is not outer and c.area >= SPECK_PIXELS]
    holes = [smooth_outline(c, tolerance, flatness * diagonal) for c in inner]
    if not shapely.Polygon(smooth.exterior, [hole.exterior for hole in holes]).is_valid:
        smooth = shapely.simplify(
            shapely.Polygon(outer.exterior, [hole.exterior for hole in inner]), tolerance
        )
        holes = [shapely.Polygon(hole) for hole in smooth.interiors]
    rings = [smooth.exterior, *(hole.exterior for hole in holes)]
    z, *inner_rings = (complex_of(shapely.get_coordinates(ring)[:-1]) for ring in rings)
    return FilledOutline(
        f"piece at ({left}, {top})", z, shapely.Polygon(smooth.exterior).area, tuple(inner_rings)
    )


handed = Handed()
