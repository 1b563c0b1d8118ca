"""The figure of a mesh: its flattening with a grid, the textured surface, and a summary; and saving figures."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ...arrays import Complex, xy_of
from ...maps.approximation import AnyMap
from ...maps.figure import grid, write_words
from ...meshes.render import render
from ...pixels.sampler import Sampler
from ...pixels.warp import Texture
from ..shapes.mesh_shape import MeshShape
from ..shapes.shape import Shape
from .preview import textured

INK, ACROSS, UP, EDGE, MARK = "#22262b", "#2a78b8", "#d1662b", "#c6ccd2", "#b0122f"
MOST_EDGES = 20000  # edges of a mesh are drawn up to this number: more would fill the plot
LONGER_SIDE_PIXELS = 900  # of the rendered surface
MOST_DILATATION = 2.0  # at the end of the colours of a layout: checks that are twice as long as wide
HEAT_COLORMAP = "YlOrRd"
PANEL_CHARACTERS, PANEL_LINES = (
    150,
    10,
)  # of the summary: characters per line and lines that fit into the panel


def draw(
    target: MeshShape,
    path: Path,
    words: Sequence[str],
    *,
    map: AnyMap | None = None,
    source: Shape | None = None,
    texture: Texture | None = None,
    pins: Complex | None = None,
) -> None:
    """Draw the figure of a mesh into a .png, .svg or .pdf file.

    Args:
        target: the mesh.
        path: the file.
        words: lines to write beside it.
        map: from the source's plane to the target's; without one, the flattening itself is shown with a checkerboard.
        source: the map's source.
        texture: placed in the source's plane; with a mesh as source, that mesh's texture.
        pins: (k, 2) places in the planes of source and target.
    """
    figure = Figure(figsize=(13, 7.4), layout="constrained")
    places = [["flat", "surface"], ["words", "words"]]
    panels = figure.subplot_mosaic(places, height_ratios=(4, 1))  # type: ignore[arg-type]
    left, right = panels["flat"], panels["surface"]
    if map is None:
        _heat(figure, left, target)
    _flat(left, target, map)
    if pins is not None and len(pins):
        _pins(left, map, np.reshape(pins, (-1, 2)))
    right.imshow(surface(target, map, source, texture), interpolation="none")
    for axes, title in ((left, "flattened"), (right, Path(target.spec).name)):
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(title, fontsize=11, color=INK)
    write_words(words, panels["words"], PANEL_CHARACTERS, PANEL_LINES)
    save(figure, path)


def save(figure: Figure, path: Path) -> None:
    """Write a figure as .png, .svg or .pdf. Equal figures give equal bytes; the date follows SOURCE_DATE_EPOCH."""
    metadata = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    with mpl.rc_context({"svg.hashsalt": "iccm"}):  # otherwise element IDs would be random
        figure.savefig(path, dpi=100, metadata=metadata.get(path.suffix.lower()))


def surface(
    target: MeshShape,
    map: AnyMap | None = None,
    source: Shape | None = None,
    texture: Texture | None = None,
    size: int = LONGER_SIDE_PIXELS,
) -> NDArray[np.uint8]:
    """Return (h, w, 4) a picture of the textured surface, or of a checkerboard if there is no texture."""
    (points, faces, uv), placed = textured(target, map, source, texture)
    return render(points, faces, uv, Sampler(placed), size)


def _heat(figure: Figure, axes: Axes, target: MeshShape) -> None:
    """Colour the triangles of a layout by their dilatation, with a legend."""
    flat, faces = target.flattening.flat, target.flattening.patch.faces
    ramp = np.round(255 * mpl.colormaps[HEAT_COLORMAP](np.linspace(0, 1, 256))[:, :3]).astype(np.uint8)
    share = (np.minimum(target.flattening.dilatation, MOST_DILATATION) - 1) / (MOST_DILATATION - 1)
    places = np.stack([255 * share + 0.5, np.full(share.size, 0.5)], axis=1)
    uv = np.repeat(places[:, None], 3, axis=1)
    colours = Sampler(Texture(ramp[None], (0j, 1 + 1j)), "nearest", "data")
    xyz = np.column_stack([flat.real, flat.imag, np.zeros(flat.size)])
    pixels = render(xyz, faces, uv, colours, LONGER_SIDE_PIXELS, np.eye(3), shaded=False)
    low, high = xyz.min(axis=0), xyz.max(axis=0)
    axes.imshow(pixels, extent=(low[0], high[0], low[1], high[1]))
    scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(1, MOST_DILATATION), HEAT_COLORMAP)
    bar = figure.colorbar(scale, ax=axes, shrink=0.6, extend="max")
    bar.set_label("dilatation (1: angles are kept)", color=INK, fontsize=9)


def _flat(axes: Axes, target: MeshShape, map: AnyMap | None) -> None:
    flat, piece = target.flattening.flat, target.flattening.patch
    half = np.flatnonzero(piece.drawn & (piece.triangles.twin > np.arange(piece.drawn.size)))
    if half.size <= MOST_EDGES:
        ends = np.stack([flat[piece.triangles.tail[half]], flat[piece.triangles.head[half]]], axis=1)
        _strands(axes, ends, EDGE, 0.4)
    if map is not None:
        for lines, colour in zip(grid(map.polygon), (ACROSS, UP)):
            finite = np.isfinite(lines)
            image = np.full(lines.shape, complex(np.nan, np.nan))
            image[finite] = map(lines[finite])
            _strands(axes, image, colour, 0.7)
    for loop in piece.loops:
        closed = np.append(flat[loop], flat[loop[:1]])
        axes.plot(closed.real, closed.imag, color=INK, lw=1.2)


def _pins(axes: Axes, map: AnyMap | None, pins: Complex) -> None:
    """Draw the places of pins as circles, and their images as dots."""
    axes.plot(pins[:, 1].real, pins[:, 1].imag, "o", color=MARK, ms=7, mfc="none")
    if map is not None:
        image = map(pins[:, 0])
        axes.plot(image.real, image.imag, ".", color=MARK, ms=5)


def _strands(axes: Axes, lines: Complex, colour: str, width: float) -> None:
    points = xy_of(lines)
    axes.add_collection(LineCollection(list(points), colors=colour, linewidths=width))
