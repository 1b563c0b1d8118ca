"""The figure of `iccm info --plot`: the parts of a file, with the numbers and names to use after `#`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from ..arrays import Complex, Index, Real, xy_of
from ..curve import polygon_of
from ..errors import InputError
from ..flattening.charts import Atlas
from ..maps.figure import INK, MARK
from ..meshes import render
from ..meshes.disk_patch import Joined
from ..pixels.sampler import Sampler
from ..pixels.texture import Texture
from . import formats, limits
from .meshes import mesh_files
from .run.plots import save
from .shapes import shape as shapes
from .spec import Spec

NUMBERED_PARTS = 60  # parts with a number: more could not be read
LONGER_SIDE_PIXELS = 900  # of the rendered surface
PALETTE = np.round(255 * np.array(colormaps["tab20"].colors)).astype(np.uint8)  # type: ignore[attr-defined]


def draw(path: Path, to: Path, *, max_faces: int = limits.FACES) -> None:
    """Draw the parts of a file with their numbers.

    Args:
        path: a drawing, a picture or a mesh.
        to: .png, .svg or .pdf.
        max_faces: limit for a mesh.

    Raises:
        InputError: the file has no parts, is invalid, or is a mesh with more faces.
    """
    form = formats.of(path)
    if not (form.mesh or form.drawing or form.picture):
        raise InputError(f"{path}: --plot: not a drawing, picture or mesh, so there are no parts to number")
    opened = mesh_files.open_mesh(path, max_faces) if form.mesh else None
    if opened is not None:
        opened.check_size(max_faces)
    if opened is not None and opened.is_mesh():
        figure = _mesh(mesh_files.read(str(path), opened).mesh)
    else:
        figure = _outlines(shapes.read_drawing(Spec(path)))
    figure.suptitle(path.name, fontsize=11, color=INK)
    save(figure, to)


def _outlines(drawing: Any) -> Figure:
    """Draw filled outlines, the largest at the bottom, and pins and strokes with their names."""
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.subplots()
    for number, outline in enumerate(drawing.outlines, 1):
        rings = [_closed(ring) for ring in (outline.z, *outline.holes)]
        colour = PALETTE[(number - 1) % len(PALETTE)] / 255
        axes.add_patch(PathPatch(Outline.make_compound_path(*rings), fc=(*colour, 0.5), ec=INK, lw=0.8))
        if number <= NUMBERED_PARTS:
            inside = polygon_of(outline.z, *outline.holes).buffer(0)
            _label(axes, f"#{number} {outline.name}", *inside.representative_point().coords[0])
    for name, z in drawing.pins.items():
        axes.plot(z.real, z.imag, "o", color=MARK, ms=5)
        _label(axes, name, z.real, z.imag)
    for name, line in drawing.strokes.items():
        axes.plot(line.real, line.imag, color=MARK, lw=1.6)
        _label(axes, name, line[0].real, line[0].imag)
    axes.autoscale_view()
    axes.set_aspect("equal")
    if drawing.flip:
        axes.invert_yaxis()
    axes.set_axis_off()
    return figure


def _closed(z: Complex) -> Outline:
    return Outline(xy_of(np.append(z, z[:1])), closed=True)


def _mesh(mesh: Any) -> Figure:
    """Draw the pieces of a mesh in space, and the charts of its texture coordinates."""
    joined = Joined.of(mesh)
    rank = np.argsort(joined.order)[joined.shape.components()]
    panels = [("pieces", mesh.points[joined.vertex], joined.shape.faces, rank, "piece-")]
    if mesh.uv is not None:
        atlas = Atlas.of(mesh)
        chart = np.empty(len(atlas.shape.faces), np.int64)
        for k in range(atlas.count):
            chart[atlas.triangles(k + 1)] = k
        flat = np.column_stack([atlas.uv, np.zeros(len(atlas.uv))])
        panels.append(("charts of the texture coordinates", flat, atlas.shape.faces, chart, "uv-"))
    figure = Figure(figsize=(8 * len(panels), 8), layout="constrained")
    for axes, (title, points, faces, group, name) in zip(np.ravel(figure.subplots(1, len(panels))), panels):
        view = np.eye(3) if name == "uv-" else render.view(points, faces)
        _groups(axes, points, faces, group, name, view)
        axes.set_title(title, fontsize=11, color=INK)
        axes.set_axis_off()
    return figure


def _groups(axes: Any, points: Real, faces: Index, group: Index, name: str, view: Real) -> None:
    """Draw triangles in the colour of their group, with each group's name at its centre."""
    colours = Sampler(Texture(PALETTE[None], (0j, 1 + 1j)), "nearest", "data")
    places = np.stack([group % len(PALETTE) + 0.5, np.full(group.size, 0.5)], axis=1)
    uv = np.repeat(places[:, None], 3, axis=1)
    pixels: NDArray = render.render(points, faces, uv, colours, LONGER_SIDE_PIXELS, view)
    projected = (points @ view.T)[:, :2]
    (low, bottom), (high, top) = projected[faces].min(axis=(0, 1)), projected[faces].max(axis=(0, 1))
    axes.imshow(pixels, extent=(low, high, bottom, top))
    middles = projected[faces].mean(axis=1)
    for k in range(min(int(group.max()) + 1, NUMBERED_PARTS)):
        group_middles = middles[group == k]
        nearest = group_middles[np.argmin(np.linalg.norm(group_middles - group_middles.mean(axis=0), axis=1))]
        _label(axes, f"#{name}{k + 1}", *nearest)


def _label(axes: Any, text: str, x: float, y: float) -> None:
    box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75}
    axes.text(x, y, text, ha="center", va="center", fontsize=9, color=INK, bbox=box, parse_math=False)
