"""The matplotlib figure of a map: grids, the mapped picture, distortion, figures and notes.

It uses matplotlib objects without pyplot, so that neither a display nor global state is needed.
"""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from ..arrays import Box, Complex, xy_of
from ..curve import Curve
from ..plane import bounding_box, longer_side
from .approximation import AnyMap
from .distortion import area_scale, dilatation
from .summary import in_words

GRID_LINES, POINTS_PER_LINE, HEAT_PIXELS = 24, 400, 220  # HEAT_PIXELS: along the longer side
PANEL_CHARACTERS, PANEL_LINES = 50, 24  # letters per line and lines of the text panel
INK, SOFT, ACROSS, UP, MARK = "#22262b", "#8a929b", "#2a78b8", "#d1662b", "#b0122f"


def figure(
    map: AnyMap,
    source: Curve,
    target: Curve | None,
    image: Complex,
    *,
    openings: tuple[list[Complex], list[Complex]] = ([], []),
    lost: Sequence[shapely.Geometry] = (),
    painted: Sequence[shapely.Geometry] = (),
    pins: Complex,
    strokes: Sequence[tuple[Curve, Curve]] = (),
    regions: Sequence[Complex] = (),
    carried: tuple[NDArray, Box],
    report: dict[str, Any],
    names: tuple[str, str],
) -> Figure:
    """Return a figure with six panels.

    They show the source with a grid and its pins, the grid's image over the target, the mapped picture, the
    logarithm of the area scale and the dilatation over the source, and the report with its notes.

    Args:
        map: source → target.
        source: its outline.
        target: outline of the target, if there is one.
        image: image of the source's outline.
        openings: outlines of holes in the map, in the source and in the image.
        lost: hidden parts of the source, and bare parts of the target; they are hatched.
        painted: painted regions of whole drawings in the source and in the target, whose outlines are drawn.
        pins: (k, 2) source and target of each.
        strokes: source and target of each.
        regions: outlines of rigid regions, which are shaded.
        carried: a mapped picture, 8 bits per channel in sRGB, and its box in the target's plane.
        report: of the map, with its message and notes.
        names: titles of the source and of its image.
    """
    figure = Figure(figsize=(15, 9.4), layout=ConstrainedLayoutEngine(w_pad=0.15, h_pad=0.12))
    (left, right, picture), (area, shear, words) = figure.subplots(2, 3)
    for lines, colour in zip(grid(map.polygon, holes=openings[0]), (ACROSS, UP)):
        _strands(left, lines, colour)
        _strands(right, _apply(map, lines), colour)
    _outline(left, source.z, INK, 1.4)
    if target is not None:
        _outline(right, target.z, INK, 2.6, alpha=0.25)
    _outline(right, image, INK, 1.0)
    for axes, holes in zip((left, right), openings):
        for hole in holes:
            _outline(axes, hole, INK, 1.0)
    for axes, region in zip((left, right), painted):
        for ring in shapely.get_parts(shapely.boundary(region)):
            axes.plot(*shapely.get_coordinates(ring).T, color=SOFT, lw=0.9)
    for axes, region in zip((left, right), lost):
        _hatched(axes, region)
    if pins.size:
        pin_images = map(pins[:, 0])
        left.plot(pins[:, 0].real, pins[:, 0].imag, "o", color=MARK, ms=5)
        right.plot(pins[:, 1].real, pins[:, 1].imag, "o", color=MARK, ms=7, mfc="none")
        right.plot(pin_images.real, pin_images.imag, ".", color=MARK, ms=5)
    for pair in strokes:
        for axes, stroke in zip((left, right), pair):
            axes.plot(stroke.z.real, stroke.z.imag, color=MARK, lw=1.6)
    for ring in regions:
        for axes, z in ((left, ring), (right, map(ring))):
            axes.fill(z.real, z.imag, color=MARK, alpha=0.25, lw=0)
    for axes, name in zip((left, right), names):
        _frame(axes, name)
    pixels, (low, high) = carried
    picture.imshow(pixels, extent=(low.real, high.real, low.imag, high.imag), interpolation="none")
    _frame(picture, "the mapped texture")
    _distortion(map, source, openings[0], area, shear)
    write_words(in_words(report), words)
    return figure


def draw_carried(axes: Any, carried: tuple[NDArray, Box], target: Curve) -> None:
    """Draw a mapped picture in its box, and the target's outline, into given axes."""
    pixels, (low, high) = carried
    axes.imshow(pixels, extent=(low.real, high.real, low.imag, high.imag), interpolation="none")
    _outline(axes, target.z, INK, 1.0)
    axes.set_aspect("equal")


def write_words(
    lines: Sequence[str], axes: Any, wide: int = PANEL_CHARACTERS, most: int = PANEL_LINES
) -> None:
    """Write lines as the text of a panel, wrapped and truncated to its size."""
    axes.set_axis_off()
    wrapped = [
        part
        for line in lines
        for part in textwrap.wrap(line, wide, subsequent_indent=" " * (12 if line[10:12] == "  " else 0))
        or [""]
    ]
    if len(wrapped) > most:
        wrapped[most - 1 :] = ["… more notes are in the report"]
    style = {"va": "top", "family": "monospace", "fontsize": 10, "color": INK}
    axes.text(0, 1, "\n".join(wrapped), transform=axes.transAxes, **style)


def grid(
    outline: np.ndarray,
    lines: int = GRID_LINES,
    per_line: int = POINTS_PER_LINE,
    holes: Sequence[np.ndarray] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Return grid lines inside an outline: horizontal and vertical ones.

    Each is a (lines, points) complex array, NaN outside and in holes.
    """
    low, high = bounding_box(outline)
    step = longer_side(low, high) / lines
    columns = np.arange(low.real + step / 2, high.real, step)
    rows = np.arange(low.imag + step / 2, high.imag, step)
    x, y = np.linspace(low.real, high.real, per_line), np.linspace(low.imag, high.imag, per_line)
    across, up = x[None, :] + 1j * rows[:, None], columns[:, None] + 1j * y[None, :]
    return _inside(across, outline, holes=holes), _inside(up, outline, holes=holes)


def _inside(
    z: np.ndarray, outline: np.ndarray, margin: float = 0.0, holes: Sequence[np.ndarray] = ()
) -> np.ndarray:
    rings = [xy_of(ring) for ring in (outline, *holes)]
    region = shapely.Polygon(rings[0], rings[1:]).buffer(-margin)
    shapely.prepare(region)
    return np.where(shapely.contains_xy(region, z.real, z.imag), z, complex(np.nan, np.nan))


def _apply(evaluate: Any, z: np.ndarray) -> np.ndarray:
    """Evaluate a function where z is finite; NaN elsewhere."""
    finite = np.isfinite(z)
    image = np.full(z.shape, complex(np.nan, np.nan))
    image[finite] = evaluate(z[finite])
    return image


def _strands(axes: Any, lines: np.ndarray, colour: str) -> None:
    points = xy_of(lines)
    axes.add_collection(LineCollection(list(points), colors=colour, linewidths=0.7))


def _outline(axes: Any, z: np.ndarray, colour: str, width: float, alpha: float = 1.0) -> None:
    closed = np.append(z, z[:1])
    axes.plot(closed.real, closed.imag, color=colour, lw=width, alpha=alpha, solid_joinstyle="round")


def _hatched(axes: Any, region: shapely.Geometry) -> None:
    for part in shapely.get_parts(region):
        if isinstance(part, shapely.Polygon):
            rings = [Path(ring.coords) for ring in (part.exterior, *part.interiors)]
            path = Path.make_compound_path(*rings)
            axes.add_patch(PathPatch(path, facecolor="none", edgecolor=SOFT, hatch="/////", lw=0))


def _frame(axes: Any, title: str) -> None:
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(_clipped(title), fontsize=11, color=INK)


def _clipped(text: str, width: int = 52) -> str:
    return text if len(text) <= width else text[: width - 1] + "…"


def _distortion(map: AnyMap, source: Curve, holes: list[Complex], left: Any, right: Any) -> None:
    """Draw log10 of the area scale (relative to its median) and the dilatation, over the source."""
    low, high = source.box
    step = longer_side(low, high) / HEAT_PIXELS
    x, y = np.arange(low.real + step / 2, high.real, step), np.arange(low.imag + step / 2, high.imag, step)
    z = _inside(x[None, :] + 1j * y[:, None], map.polygon, 1e-3 * source.diagonal, holes)
    area, shear = np.full(z.shape, np.nan), np.full(z.shape, np.nan)
    finite = np.isfinite(z)
    f_z, f_zbar = map.derivatives(z[finite])
    area[finite], shear[finite] = area_scale(f_z, f_zbar), dilatation(f_z, f_zbar)
    extent = (low.real, low.real + x.size * step, low.imag, low.imag + y.size * step)
    _area(left, area, extent)
    _shear(right, shear, area, extent)
    for axes in (left, right):
        _outline(axes, source.z, INK, 1.0)


def _area(axes: Any, area: np.ndarray, extent: tuple) -> None:
    value = np.log10(np.where(area > 0, area, np.nan))
    value -= np.nanmedian(value) if np.isfinite(value).any() else 0
    reach = max(0.1, float(np.nanquantile(np.abs(value), 0.98)) if np.isfinite(value).any() else 1)
    image = axes.imshow(
        value, origin="lower", extent=extent, cmap="RdBu_r", norm=TwoSlopeNorm(0, -reach, reach)
    )
    _folded(axes, area, extent)
    axes.figure.colorbar(image, ax=axes, shrink=0.75, extend="both")
    _frame(axes, "log10 area scale, relative to its median")


def _shear(axes: Any, shear: np.ndarray, area: np.ndarray, extent: tuple) -> None:
    finite = shear[np.isfinite(shear)]
    top = max(1.05, float(np.quantile(finite, 0.98)) if finite.size else 2)
    image = axes.imshow(shear, origin="lower", extent=extent, cmap="viridis", norm=Normalize(1, top))
    _folded(axes, area, extent)
    bar = axes.figure.colorbar(image, ax=axes, shrink=0.75, extend="max")
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    _frame(axes, "dilatation (1 = conformal)")


def _folded(axes: Any, area: np.ndarray, extent: tuple) -> None:
    """Paint folded areas red."""
    red = np.zeros((*area.shape, 4))
    red[area <= 0] = (0.85, 0, 0.1, 1)
    axes.imshow(red, origin="lower", extent=extent)
