"""Pictures as outlines: what is opaque, or what stands out from the background, traced to a part of a pixel.

Coordinates are pixels, x right and y down, the centre of the upper left pixel at (0.5, 0.5).
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from ...arrays import complex_of
from ...errors import InputError, naming
from ...plane import cross
from .. import files, limits
from ..svg.drawing import Drawing
from ..svg.fill import FilledOutline

STRAY = 1e-3  # of the pixels: so few transparent ones in an opaque picture are no shape
SPECK = 4  # pixels; smaller pieces are noise
# Tolerances of the simplification in pixels. A hard mask knows its outline to half a pixel, and a straight edge in
# it is a staircase that far to either side: less than 0.75 would keep the stairs.
SOFT, HARD = 0.25, 0.75
UNEVEN = 0.1  # of the border's pixels: if more are neither background nor shape, it is no plain background (by hand)
INSIDE = "the inside of its line is taken; --trace dark takes the line itself"
APART = 1e-3
"""Coverage by which no pixel is nearer to the level than that: they keep contours apart (by hand)."""
REACH = 1.5  # pixels that a vertex may move when lines are fitted to its edges


def read(
    path: Path,
    chosen: str | None = None,
    *,
    flatness: float = 1e-4,
    max_bytes: int = limits.DRAWING_BYTES,
    max_pixels: int = limits.SILHOUETTE_PIXELS,
    trace: str = "auto",
) -> Drawing:
    """The outlines in a picture: of its alpha channel, of a mask or drawing on a plain background, or of a scan.

    With `trace` "auto" alpha is taken where it varies, then what stands out from a plain background, else, as under
    uneven light, what `scan` finds; of a line that encloses much more than itself its inside. For "dark", "light" and
    "inside" see there.

    Outlines follow the level where coverage is one half, between pixel centres, and are simplified to 0.25 pixel
    (0.75 in a mask without grey levels), or to `flatness` times their diagonal where that is more.

    Raises:
        InputError: not a picture, too large, or nothing in it stands out.
    """
    from ..pictures import image_files

    files.open_input(path, max_bytes=max_bytes)
    image = image_files.read(path, max_pixels=max_pixels)
    with naming(path):
        field, by, said = _field(image.pixels, image.alpha, trace)
        found, rest = traced(field, flatness)
    found = [_enlarged(each, by) for each in found]
    height, width = image.pixels.shape[:2]
    drawing = Drawing(found, (0.0, 0.0, float(width), float(height)), flip=True, notes=said)
    if rest:
        drawing.notes.append(
            f"left out {rest} specks of less than {SPECK} pixels or beyond the {limits.PIECES} largest pieces"
        )
    return drawing


def _field(pixels: NDArray, alpha: int, trace: str) -> tuple[NDArray[np.float32], float, list[str]]:
    """Coverages to be traced, how many pixels of the picture each is wide, and what is to be said of that."""
    from . import scan

    if trace == "auto":
        field = coverage(pixels, alpha)
        if _is_alpha(pixels, alpha):
            return field, 1.0, []
        border = np.concatenate([field[0], field[-1], field[:, 0], field[:, -1]])
        if np.mean((border > 0.25) & (border < 0.75)) < UNEVEN:
            ink = field >= 0.5
            if not scan.is_line(ink):
                return field, 1.0, []
            try:
                return scan.smooth(scan.inside_of(ink)), 1.0, [INSIDE]
            except InputError:
                return field, 1.0, []
    scale = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    if pixels.dtype.kind == "f" and not np.isfinite(pixels).all():
        raise InputError("some pixels are not finite numbers")
    colours = np.delete(pixels, alpha, axis=2) if alpha >= 0 else pixels
    field, by, inside = scan.field_of((colours / np.float32(scale)).astype(np.float32), trace)
    return field, by, [INSIDE] if inside and trace == "auto" else []


def _enlarged(outline: FilledOutline, by: float) -> FilledOutline:
    if by == 1:
        return outline
    holes = tuple(by * hole for hole in outline.holes)
    return replace(outline, z=by * outline.z, area=by * by * outline.area, holes=holes)


def _is_alpha(pixels: NDArray, alpha: int) -> bool:
    """Whether alpha, where there is any, says what the shape is: it varies, in more than a few pixels."""
    if alpha < 0:
        return False
    half = np.iinfo(pixels.dtype).max / 2 if pixels.dtype.kind == "u" else 0.5
    opaque = pixels[..., alpha]
    return bool(float(opaque.max()) - float(opaque.min()) > half and (opaque < half).mean() >= STRAY)


def coverage(pixels: NDArray, alpha: int) -> NDArray[np.float32]:
    """(h, w) how much of each pixel the shape covers, 0 to 1, from (h, w, c) pixels.

    That is alpha where it varies, in more than a few pixels or in a picture of one colour. Otherwise the difference
    from the background, the middle colour of the border, relative to the middle difference of all that stands out:
    exact for masks of two colours, light or dark.

    Raises:
        InputError: the picture is of one colour, or has values that are not finite.
    """
    scale = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    if pixels.dtype.kind == "f" and not np.isfinite(pixels).all():
        raise InputError("some pixels are not finite numbers")
    if alpha >= 0:
        opaque = pixels[..., alpha].astype(np.float32) / scale
        varies = opaque.max() - opaque.min() > 0.5
        if varies and (opaque < 0.5).mean() >= STRAY:
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
            "the picture is of one colour; a silhouette needs alpha, or a shape on a plain background"
        )
    usual = np.median(distance[distance > 0.25 * distance.max()])
    return np.clip(distance / usual, 0, 1)


def traced(field: NDArray[np.float32], flatness: float = 1e-4) -> tuple[list[FilledOutline], int]:
    """The outlines of the pieces of a picture of coverages, the largest first, and the number of pieces not traced.

    Raises:
        InputError: no piece has at least SPECK pixels.
    """
    import cv2

    inside = (field >= 0.5).astype(np.uint8)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(inside, connectivity=4)
    sizes = boxes[1:, cv2.CC_STAT_AREA]
    order = [int(k) + 1 for k in np.argsort(-sizes, kind="stable")[: limits.PIECES] if sizes[k] >= SPECK]
    if not order:
        raise InputError(f"nothing of at least {SPECK} pixels stands out")
    found = [outline for k in order if (outline := _piece(field, labels, boxes[k], k, flatness))]
    if not found:
        raise InputError("nothing in it encloses an area")
    return sorted(found, key=lambda o: -o.area), count - 1 - len(order)


def _piece(
    field: NDArray, labels: NDArray, box: NDArray, label: int, flatness: float
) -> FilledOutline | None:
    """The outline of one connected piece, the pixels of all others taken for background."""
    from skimage.measure import find_contours

    left, top, width, height = (int(n) for n in box[:4])
    rows, columns = (slice(max(a - 1, 0), a + n + 1) for a, n in ((top, height), (left, width)))
    own = labels[rows, columns]
    values = np.where((own == label) | (own == 0), field[rows, columns], 0)
    near = np.abs(values - 0.5) < APART  # or contours could meet in a pixel's centre
    values[near] = np.where(values[near] < 0.5, 0.5 - APART, 0.5 + APART)
    # the frame of zeros closes outlines at the picture's edge, half a pixel beyond the outermost centres
    corner = columns.start - 0.5, rows.start - 0.5
    found = find_contours(np.pad(values, 1), 0.5)
    contours = [shapely.Polygon(c[:, ::-1] + corner) for c in found if len(c) > 3]
    if not contours:
        return None
    whole = max(contours, key=lambda p: p.area)
    bounds = whole.bounds
    diagonal = np.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1])
    soft = np.mean((values > 0.02) & (values < 0.98)) * values.size > 0.25 * len(whole.exterior.coords)
    tolerance = max(SOFT if soft else HARD, flatness * diagonal)
    smooth = _straightened(whole, tolerance)
    inner = [c for c in contours if c is not whole and c.area >= SPECK]
    holes = [_straightened(c, tolerance) for c in inner]
    if not shapely.Polygon(smooth.exterior, [hole.exterior for hole in holes]).is_valid:
        smooth = shapely.simplify(
            shapely.Polygon(whole.exterior, [hole.exterior for hole in inner]), tolerance
        )
        holes = [shapely.Polygon(hole) for hole in smooth.interiors]
    rings = [smooth.exterior, *(hole.exterior for hole in holes)]
    z, *rest = (complex_of(shapely.get_coordinates(ring)[:-1]) for ring in rings)
    return FilledOutline(f"piece at ({left}, {top})", z, shapely.Polygon(smooth.exterior).area, tuple(rest))


def _straightened(polygon: shapely.Polygon, tolerance: float) -> shapely.Polygon:
    """The outline with few vertices, most of them sharper than a pixel.

    Douglas and Peucker's choice says which points make up an edge; the line fitted to all of these points is the edge,
    and a vertex is where two edges meet. The choice alone is off by up to the tolerance, and cuts corners.
    """
    simple = shapely.simplify(polygon, tolerance)
    z, corners = (complex_of(shapely.get_coordinates(p.exterior)[:-1]) for p in (polygon, simple))
    index = {point: k for k, point in enumerate(z.tolist())}
    start = np.array([index[point] for point in corners.tolist()])
    count = np.mod(np.roll(start, -1) - start - 1, z.size) + 2
    edges = [_line(np.take(z, np.arange(a, a + n), mode="wrap")) for a, n in zip(start, count)]
    moved = [_meeting(edges[k - 1], edges[k], corner) for k, corner in enumerate(corners)]
    better = shapely.Polygon(np.column_stack([np.real(moved), np.imag(moved)]))
    return better if better.is_valid and better.area > 0 else simple


def _line(z: NDArray[np.complex128]) -> tuple[complex, complex]:
    """A point and the unit direction of the line that fits points best, by total least squares."""
    z = z[1:-1] if z.size > 4 else z  # the ends are shared with the neighbours, and may be cut corners
    middle = complex(z.mean())
    direction = np.sqrt(complex(np.mean((z - middle) ** 2)))
    return middle, (direction / abs(direction) if direction else complex(z[-1] - z[0]) / abs(z[-1] - z[0]))


def _meeting(before: tuple[complex, complex], after: tuple[complex, complex], corner: complex) -> complex:
    """Where two lines meet, when that is near the corner; otherwise the middle of the corner's feet on both."""
    (a, d), (b, e) = before, after
    turn = cross(d, e)
    if abs(turn) > 0.05:
        point = a + d * cross(b - a, e) / turn
        if abs(point - corner) <= REACH:
            return point
    feet = [p + u * ((corner - p) * u.conjugate()).real for p, u in (before, after)]
    return sum(feet) / 2 if max(abs(foot - corner) for foot in feet) <= REACH else corner
