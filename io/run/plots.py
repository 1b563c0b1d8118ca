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
from ...maps.extended_inverse import ExtendedInverse
from ...maps.figure import grid, write_words
from ...meshes.render import render
from ...pixels.checkerboard import checkerboard
from ...pixels.sampler import Sampler
from ...pixels.warp import Texture
from ..shapes.mesh_shape import MeshShape
from ..shapes.shape import Shape
from .framing import square

INK, ACROSS, UP, EDGE, MARK = "#22262b", "#2a78b8", "#d1662b", "#c6ccd2", "#b0122f"
MOST_EDGES = 20000  # edges of a mesh are drawn up to this number: more would fill the plot
LONGER_SIDE_PIXELS = 900  # of the rendered surface
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
    piece = target.flattening.patch
    z = target.flattening.flat if map is None else ExtendedInverse(map)(target.flattening.flat)
    if texture is None:
        box = target.box if map is None or source is None else source.box
        texture = Texture(checkerboard(1024), square(box))
        source = None
    place = (source if source is not None else target_plane(target)).placing(texture)
    still = np.zeros(z.size, complex)
    uv = place.places(z, still, still).xy[piece.faces]
    return render(piece.points, piece.faces, uv, Sampler(texture), size)


def target_plane(target: MeshShape) -> Shape:
    """Return the target's plane as a plain shape."""
    return Shape(target.spec, target.path, target.curve, target.box, False, {}, {})


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
