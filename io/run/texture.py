"""The texture of a job: reading it, and its place in the source's plane."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from ...arrays import Box, Complex
from ...curve import polygon_of
from ...drawings.drawing import Drawing
from ...errors import InputError
from ...maps.summary import WELL_SEEN_SHARE
from ...plane import bounding_box
from .. import formats, limits
from ..shapes.silhouette import CANVAS
from ..spec import Spec, is_view
from . import framing
from .job import Job

if TYPE_CHECKING:
    from ...drawings.detail import Detail
    from ...memory import Memory
    from ...pixels.sampler import Sampler
    from ...solve import Fit
    from ..pictures.image_files import Image
    from ..pictures.tiles import TiledImage
    from ..shapes.shape import Shape

FIRST_RENDERED_PIXELS = 1024
"""Pixels of the longer side of a drawing, until the resolution needed by a map is known."""
HELD_PIXELS = 2048  # pixels of the longer side of a drawing on a mesh
BESIDE_SIZE_SHARE = 1 / 16
"""Margin around a drawing's box that is rendered for filters reading beyond the outline, relative to the shape's
size.
"""
MOST_PIXELS_PER_PIXEL = 1024
"""Pixels of a drawing rendered for a map, per pixel of the result: 32 by 32, which suffices for every filter."""
BYTES_PER_RENDERED_PIXEL = 16
"""Of memory per rendered pixel: its four channels as a PNG, decoded, and while it is rotated."""
MOST_STRETCHED_SHARE = 0.98
"""Share of the source; the rest may be stretched more, and then has fewer texels than pixels."""
MOST_PAINTED_BY_LINES_SHARE = 1 / 3
"""Relative to its convex hull: a drawing that paints less consists of lines."""
DETAIL_PIXELS = 512  # of the longer side of a picture in which edges are found
PICTURES = formats.holding("picture")
CELL_PIXELS = 128  # side of a square of the checkerboard
KEPT_VALUES = 1 << 24  # numbers in a picture that is cached for the next job at most: 64 MB as floats


def on_mesh(job: Job, source: Shape) -> bool:
    """Return whether the texture lies on a mesh that is the source, rather than in the plane of its coordinates."""
    return source.is_mesh and not source.is_layout and has_texture(job, source)


def has_texture(job: Job, source: Shape) -> bool:
    """Return whether there is a texture, other than the checkerboard."""
    return bool(job.texture or own_pictures(job, source))


def own_pictures(job: Job, source: Shape) -> tuple[Path | bytes, ...]:
    """Return the pictures of the source itself, unless the checkerboard is requested."""
    return () if job.checkered else source.pictures


def is_own_picture(job: Job, source: Shape) -> bool:
    """Return whether the texture is a picture of the source itself, without --texture."""
    return not job.texture and bool(own_pictures(job, source))


def shows_itself(job: Job, source: Shape) -> bool:
    """Return whether the texture is the drawing that is the source: because it has its own colours, or because
    --texture names its file.
    """
    if source.is_mesh:
        return False
    if job.texture:
        return Path(job.texture).absolute() == Path(source.path).absolute()
    return is_own_picture(job, source)


def shows_lettering(job: Job, source: Shape) -> bool:
    """Return whether the texture is the word that is the source, in black."""
    return is_own_picture(job, source) and formats.suffix_of(source.path) in formats.FONTS


def is_rendered(job: Job, source: Shape) -> bool:
    """Return whether the texture is a drawing or a word, which is rendered at the resolution that the map needs."""
    return drawing_of(job, source) is not None or shows_lettering(job, source)


def as_own_picture(job: Job, source: Shape, target: Shape) -> Shape:
    """Return the source as its own picture if it is a drawing of one colour with something to see.

    Where both shapes are plain outlines, each a single part of one colour without holes or with --holes fill, its
    picture would be one flat colour.
    """
    if job.texture or job.checkered or source.coloured or job.target is None or target.is_mesh:
        return source
    suffix = formats.suffix_of(source.path)
    is_lettering = suffix in formats.FONTS
    if source.drawing is None or not (is_lettering or suffix in PICTURES or suffix in (".svg", ".svgz")):
        return source
    if not is_lettering and all(_is_plain(shape, job.holes) for shape in (source, target)):
        return source
    return replace(source, coloured=True)


def _is_plain(shape: Shape, holes: str) -> bool:
    """Return whether a shape is a single part of one colour without holes that --holes keeps."""
    if shape.coloured:
        return False
    if shape.drawing is None:
        return True
    if shape.ink is not None and (len(shape.ink.holes) > 1 or not shape.ink.is_one_part):
        return False  # an icon of lines, whose closed lines count as filled
    return shape.drawing.is_one_part and (holes == "fill" or not shape.drawing.holes)


def detail_of(job: Job, source: Shape, image: Image, box: Box) -> Detail:
    """Return the edges of the picture by which maps are compared."""
    from ...drawings.detail import Detail

    pixels = np.asarray(image.pixels)
    largest = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    height, width = pixels.shape[:2]
    step = max(1, max(height, width) // DETAIL_PIXELS)
    pixels = pixels[::step, ::step].astype(np.float32) / largest
    colours = np.delete(pixels, image.alpha, axis=2) if image.alpha >= 0 else pixels
    alpha = pixels[..., image.alpha] if image.alpha >= 0 else np.ones(pixels.shape[:2], np.float32)
    if colours.shape[2] != 3:
        colours = np.repeat(colours[..., :1], 3, axis=2)
    rgba = np.clip(np.nan_to_num(np.concatenate([colours, alpha[..., None]], axis=2)), 0, 1)
    weight = 1.0 if job.detail is None else job.detail
    is_photo = _shows_photo(job, source)
    edges = Detail.of_picture(rgba, box, on_paper=has_ground(job, source), weight=weight)
    detail = replace(edges, is_photo=is_photo)
    if job.faces == "off" or detail.is_empty or not (job.faces == "on" or is_photo):
        return detail
    from ...drawings.faces import faces_of

    faces = faces_of(rgba[..., :3], box, required=job.faces == "on")
    return detail.with_faces(faces) if faces else detail


def _shows_photo(job: Job, source: Shape) -> bool:
    """Return whether the texture is a picture, or a drawing with embedded pictures, so that it may be a photo."""
    if drawing_of(job, source) is None:
        return not shows_lettering(job, source)
    return any(outline.name.startswith("<image>") for outline in source.selected_outlines)


def on_paper(job: Job, source: Shape) -> bool:
    """Return whether paper is shown where the texture is transparent."""
    return job.background != "target" and has_ground(job, source)


def has_ground(job: Job, source: Shape) -> bool:
    """Return whether paper, or the target's own drawing, is shown where the texture is transparent.

    This is so below a drawing that is its own picture, unless it is placed inside the target, which then need not be
    filled, or lies on an object or along a line, which shows through. Of a whole `#canvas`, what is transparent is part
    of the picture.
    """
    whole_canvas = Spec.of(source.spec).selection == CANVAS
    return (
        shows_itself(job, source)
        and job.place != "inside"
        and (job.background or ("transparent" if whole_canvas or job.along else "paper")) != "transparent"
        and job.target is not None
        and not is_view(job.target)
        and job.kind == "colour"
    )


def notes_on_lines(job: Job, source: Shape, fit: Fit) -> list[str]:
    """Return a note if a line drawing is its own picture and much of it is hidden.

    A narrow target shows only short pieces of lines, from which nobody can recognise the drawing.
    """
    if source.ink is None or fit.coverage.seen is None or not shows_itself(job, source):
        return []
    painted = source.ink.region.area / source.ink.hull_region.area
    if fit.coverage.seen.hidden <= 1 - WELL_SEEN_SHARE or painted >= MOST_PAINTED_BY_LINES_SHARE:
        return []
    return [
        f"{source.spec}: drawn with lines, of which the target shows only short pieces; show the drawing in a "
        "wider target, or use --texture with a picture that has areas of colour, or --texture checker"
    ]


def note_on_faces(job: Job, source: Shape, detail: Detail | None) -> list[str]:
    """Return a note on faces that were found, since they may decide which part of a photo is seen."""
    if detail is None or not detail.faces or job.faces == "on":
        return []
    count = len(detail.faces)
    found = "a face is" if count == 1 else f"{count} faces are"
    return [f"{source.spec}: {found} found, and hardly bent or cropped (--faces off: like the rest)"]


def drawing_of(job: Job, source: Shape) -> Path | None:
    """Return the SVG that is rendered as the texture: --texture, or the source if it has its own colours."""
    name = job.texture or next((path for path in own_pictures(job, source) if not source.is_mesh), None)
    if name is None or isinstance(name, bytes):
        return None
    return Path(name) if formats.suffix_of(name) in (".svg", ".svgz") else None


def rendered(
    job: Job,
    source: Shape,
    room: Memory,
    density: float | None = None,
    own_box: Box | None = None,
    pixels: float = math.inf,
) -> Image:
    """Render the drawing that is the texture.

    Args:
        job: the job.
        source: the shape that it lies on.
        room: rejects more than --memory.
        density: pixels per unit of the source's plane; None: `FIRST_RENDERED_PIXELS` pixels along the longer side.
        own_box: visible box of a drawing that is its own texture, by default `own_box_of(source)`.
        pixels: number of pixels of the result, which limits those of the drawing.

    Raises:
        InputError: the drawing cannot be rendered, or does not fit into --memory.
    """
    from ...pixels.texture import strip_bytes
    from ..artwork import rendering

    path = drawing_of(job, source)
    box = rendering.canvas_of(path) if path and job.texture else own_box or own_box_of(source)
    extent = box[1] - box[0]
    if density is None:
        density = FIRST_RENDERED_PIXELS / max(extent.real, extent.imag)
    elif job.texture:  # it may be stretched onto the source
        covered = framing.texture_box(job, source, extent.real / extent.imag)
        density *= abs(covered[1] - covered[0]) / abs(extent)
    width, height = rendering.pixels_across(box, density, _most_pixels(job, pixels))
    room.check(strip_bytes(height, width, 4), "the drawing as a texture")
    if path is None:
        return rendering.render_data(_lettering(source), source.path, box, (width, height))
    return rendering.render(path, box, (width, height))


def _lettering(source: Shape) -> bytes:
    """Return the text that is the source as an SVG file."""
    from ..outlines import lettering
    from ..shapes.shape import without_box

    return lettering.svg(source.path, without_box(source.path, Spec.of(source.spec).selection or ""))


def _most_pixels(job: Job, pixels: float) -> int:
    """Return the largest number of pixels of a drawing for a result of so many, within --max-pixels and --memory."""
    within_memory = [max(1, job.memory // BYTES_PER_RENDERED_PIXEL)] if job.memory else []
    needed = max(FIRST_RENDERED_PIXELS**2, MOST_PIXELS_PER_PIXEL * min(pixels, limits.RENDERED_PIXELS))
    return min(job.max_pixels, limits.RENDERED_PIXELS, int(needed), *within_memory)


def held_drawing(job: Job, source: Shape) -> bytes | None:
    """Return the drawing that is the texture as a PNG file of the source's canvas; None if the texture is not a
    drawing.

    Raises:
        InputError: the drawing cannot be rendered.
    """
    path = drawing_of(job, source)
    if path is None:
        return None
    from ..artwork import rendering

    box = rendering.canvas_of(path) if job.texture else framing.texture_box(job, source)
    extent = box[1] - box[0]
    size = rendering.pixels_across(
        box, HELD_PIXELS / max(extent.real, extent.imag), min(job.max_pixels, limits.RENDERED_PIXELS)
    )
    return rendering.render_png(path, box, size)


def own_box_of(source: Shape) -> Box:
    """Return the box that is rendered of a drawing that is its own texture."""
    low, high = source.bounds
    margin = BESIDE_SIZE_SHARE * max((high - low).real, (high - low).imag) * (1 + 1j)
    return low - margin, high + margin


def density_needed(fits: Sequence[Fit], step: float) -> float:
    """Return the texels per unit of the source's plane that a map needs so that each pixel shows a different texel.

    Args:
        fits: the maps of all parts.
        step: size of a pixel in the target's plane.
    """
    from ...maps.approximation import triangulated

    stretches = []
    for fit in fits:
        map = triangulated(fit.map)
        _, a, b = map.jet(_scattered(map.rims[0]))
        stretches.append(np.abs(a) + np.abs(b))
    all_stretches = np.concatenate(stretches)
    all_stretches = all_stretches[np.isfinite(all_stretches)]
    return float(np.quantile(all_stretches, MOST_STRETCHED_SHARE)) / step if all_stretches.size else 1 / step


def _scattered(outline: Complex) -> Complex:
    """Return points on a grid over the box of an outline; at those outside, a map has no value."""
    low, high = bounding_box(outline)
    x, y = (np.linspace(a, b, 66)[1:-1] for a, b in ((low.real, high.real), (low.imag, high.imag)))
    return (x[None, :] + 1j * y[:, None]).ravel()


def tiles_of(job: Job, sources: Sequence[Shape], room: Memory) -> TiledImage | None:
    """Return the pictures of the tiles (UDIM) that sources lie on, if the texture's name is a pattern.

    Raises:
        InputError: the source is not a mesh, or the tiles cannot be read.
    """
    from ..pictures import tiles

    name = job.texture or next(iter(own_pictures(job, sources[0])), None)
    if name is None or isinstance(name, bytes) or not tiles.is_pattern(name):
        return None
    if not sources[0].has_uv:
        raise InputError(f"{name}: <UDIM> tiles need a mesh with texture coordinates as the source")
    from ..shapes.mesh_shape import as_mesh

    used_tiles = set().union(*(as_mesh(source).tiles for source in sources))
    return tiles.read(name, used_tiles, **_limits(job, room))


def box_of(
    job: Job, source: Shape, image: Image, tiles: Box | None = None, own_box: Box | None = None
) -> Box:
    """Return the box of the source's plane that the texture covers, given its box in the layout. The checkerboard's is
    a square.
    """
    if is_rendered(job, source) and not job.texture:
        return framing.placed(job, source, own_box or own_box_of(source))
    if tiles is not None:
        low, high = (complex(corner.real * source.aspect, corner.imag) for corner in tiles)
        return low, high
    return (
        framing.texture_box(job, source, image.pixels.shape[1] / image.pixels.shape[0])
        if has_texture(job, source)
        else framing.checkerboard_box(job, source)
    )


class LastValueCache:
    """A cache for the last value if it is small: consecutive jobs of a batch often share their texture."""

    def __init__(self) -> None:
        self._entry: tuple[Any, Any] | None = None

    def get(self, key: Any, size: Callable[[Any], int], make: Callable[[], Any]) -> Any:
        """Return the cached value for a key, or make it and cache it unless the key is None; `size` returns its
        size.
        """
        if self._entry is not None and self._entry[0] == key:
            return self._entry[1]
        value = make()
        self._entry = (key, value) if key is not None and size(value) <= KEPT_VALUES else None
        return value


_read, _ready = LastValueCache(), LastValueCache()


def outlines_of(job: Job, sources: Sequence[Shape], fits: Sequence[Fit]) -> list[Complex]:
    """Return the outlines of sources, and of holes that take part in the map, if the texture lies flat on them.

    Frames of whole drawings have no such holes: their holes are gaps, which belong to the picture.
    """
    if sources[0].is_mesh:
        return []
    mapped = job.holed and not any(fit.details.drawings and not fit.source_holes for fit in fits)
    holes = [[shape.holes[k] for k in shape.mappable_holes if mapped] for shape in sources]
    if len(sources) == 1:
        return [sources[0].curve.z, *holes[0]]
    # parts may lie on each other, such as an eye on a face; below them, the texture continues
    painted = shapely.union_all(
        [polygon_of(shape.curve.z, *shape_holes) for shape, shape_holes in zip(sources, holes)]
    )
    return Drawing(painted).rings


def sampler_of(
    job: Job,
    image: Image,
    box: Box,
    outlines: Sequence[Complex],
    room: Memory,
    threads: int | None,
    *,
    on_paper: bool = False,
    painted: Sequence[Complex] = (),
) -> Sampler:
    """Return the picture in its place in the source's plane, prepared for filtering.

    `outlines` as for `Sampler`; `on_paper` if transparent parts show paper; `painted` as for `paper.on_paper`.
    """
    from ...pixels.sampler import Sampler

    visible_outlines = outlines if image.alpha >= 0 and not (framing.repeats(job) or image.raster) else ()
    on_paper = on_paper and image.raster is None  # where a raster has no data, nothing is shown
    rotation = framing.texture_rotation(job)

    filter = "nearest" if image.raster and image.raster.labels and job.filter == "auto" else job.filter

    def make() -> Sampler:
        placed = image.texture(box, kind=job.kind, room=room, rotation=rotation)
        if on_paper and placed.alpha >= 0:
            from ...pixels import own_edge, paper

            # first remove its antialiased edge, which would be a bright line along the target's outline
            placed = paper.on_paper(own_edge.without_own_edge(placed, visible_outlines), painted)
            return Sampler(placed, filter, job.kind, job.edge, memory=room, threads=threads)
        return Sampler(
            placed, filter, job.kind, job.edge, outlines=visible_outlines, memory=room, threads=threads
        )

    key: Any = None
    if not job.memory:
        key = (
            image,
            box,
            rotation,
            job.kind,
            job.filter,
            job.edge,
            on_paper,
            *(z.tobytes() for z in (*visible_outlines, *painted)),
        )
    return _ready.get(key, lambda sampler: sampler.texture.pixels.size, make)


def image_of(job: Job, source: Shape, room: Memory, own_box: Box | None = None) -> Image:
    """Return the texture: --texture, the source's own picture, or a checkerboard.

    Raises:
        InputError: it cannot be read, or exceeds --max-pixels.
    """
    from ..pictures import image_files, rasters

    limits = _limits(job, room)
    if is_rendered(job, source):
        return rendered(job, source, room, own_box=own_box)
    nearest = job.filter in ("auto", "nearest") and not job.colorspace
    if name := job.texture:
        if formats.of(name).picture and (
            raster := rasters.read(name, max_pixels=job.max_pixels, nearest=nearest)
        ):
            return raster
        key = None if job.memory else (_stamp(name), job.max_pixels, job.colorspace)
        return _read.get(key, _numbers, lambda: image_files.read(name, **limits))
    pictures = own_pictures(job, source)
    if pictures and source.is_mesh:
        from ..shapes import mesh_reading

        return mesh_reading.read_texture(source, **limits)
    if pictures:
        from ..shapes import own_picture

        own = Spec.of(source.spec).path
        if raster := rasters.read(own, max_pixels=job.max_pixels, nearest=nearest):
            return raster
        if source.view is not None:  # a sheet on a photo also shows what resembles the photo's background
            return image_files.read(own, **limits)
        # memory is checked against --memory when the picture is decoded
        return own_picture.read(Spec.of(source.spec), source.trace, anew=bool(job.memory), **limits)
    from ...pixels.checkerboard import checkerboard

    cells = framing.checkerboard_cells(source)
    size = cells * CELL_PIXELS
    return _read.get(size, _numbers, lambda: image_files.Image(checkerboard(size, cells)))


def _numbers(image: Image) -> int:
    return image.pixels.size


def _stamp(name: str) -> tuple[str, int, int] | None:
    """Return path, modification time and size of a file; None if it does not exist."""
    try:
        status = os.stat(name)
    except (OSError, ValueError):
        return None
    return os.path.realpath(name), status.st_mtime_ns, status.st_size


def _limits(job: Job, room: Memory) -> dict[str, Any]:
    return {"max_pixels": job.max_pixels, "colorspace": job.colorspace, "room": room}
