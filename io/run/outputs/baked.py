"""The texture resampled into the existing layout of the target mesh (--bake)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....arrays import Box
from ....fits import leaves_bare
from ....maps.approximation import AnyMap
from ....maps.extended_inverse import ExtendedInverse
from ....meshes import bake as baking
from ....meshes import layout
from ....pixels.sampler import Sampler
from ....pixels.texture import Texture
from ...pictures import image_files
from ...pictures.image import Image
from ...pictures.tiles import number_of
from ...shapes.mesh_shape import MeshShape, as_mesh
from ...shapes.shape import Shape
from .. import framing
from ..report import OutputReport
from ..state import Run
from . import checks
from .picture import Picture

Parts = Sequence[tuple[MeshShape, AnyMap, Shape]]
BAKED = "the whole picture at once (--bake)"


class Baked(Picture):
    """A picture for the texture coordinates of the target mesh."""

    def check(self, run: Run) -> None:
        """Check the layouts, the texture, memory, and the format."""
        self.check_format(run, *check_bake(run, self.tile))

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Bake the whole picture, and write it."""
        picture, figures = baked_picture(run, self.tile)
        bake_report = report_bake(run, figures, self.tile)
        with run.phases.timed("write"):
            image_files.write(path, picture)
        return bake_report


def baked_picture(run: Run, tile: complex | None = None) -> tuple[Image, dict[str, Any]]:
    """Return the texture of a job in the layout of its target, or in a tile of it, and figures for the report."""
    texture_alpha, partial = run.image.alpha, is_partial(run)
    marked = partial and texture_alpha < 0
    with run.phases.timed("resample"):
        pixels, figures = bake(
            parts_of(run),
            run.sampler,
            size(run),
            tiles=run.tiles,
            tile=tile,
            threads=run.threads,
            partial=partial,
            alpha=marked,
            padding=run.job.padding,
            max_error=run.job.max_pixel_error,
        )
    return run.image.with_pixels(pixels, pixels.shape[2] - 1 if marked else texture_alpha), figures


def check_bake(run: Run, tile: complex | None = None) -> tuple[Image, int, int]:
    """Check the layouts, the texture and memory; return a picture like the baked one, and its width and height.

    Raises:
        InputError: a layout or the texture is invalid, or there is not enough memory.
    """
    check_layouts(run, tile)
    checks.texture(run)
    (width, height), image = size(run), run.image
    image = image.covered() if leaves_bare(run.job.fit) else image
    checks.room(run)
    room = baking.whole_bytes(height, width, image.pixels.shape[2], image.pixels.itemsize)
    run.room.check(room, BAKED)
    return image, width, height


def check_layouts(run: Run, tile: complex | None) -> None:
    """Check that layouts can be filled, and note coordinates outside of 0..1.

    Raises:
        InputError: a mesh has no texture coordinates, or invalid ones.
    """
    for _, part in run.pairs:
        target = as_mesh(part)
        layout.check_layout(target.spec, target.uv, target.uv_faces)
    shapes = [*run.shapes(0), *(run.shapes(1) if tile is None else ())]
    checks.coordinates(run, *(shape for shape in shapes if shape.is_mesh))


def bake(
    parts: Parts,
    sampler: Sampler,
    size: tuple[int, int],
    *,
    tiles: Box | None = None,
    tile: complex | None = None,
    threads: int | None = None,
    partial: bool = False,
    **options: Any,
) -> tuple[NDArray, dict[str, Any]]:
    """Resample the texture into the target's own UV layout; return the pixels, and figures for the report.

    Args:
        parts: of the target, with the map from the source's plane to each, and the source's shape; a mesh provides its
            own texture coordinates.
        sampler: the texture, which lies in the source's plane or on a mesh that is the source.
        size: width and height of the picture to make.
        tiles: the box of a mesh source's layout that the texture covers, if it consists of several tiles.
        tile: lower left corner of the unit square of the target's layout to fill; None: 0..1, with coordinates
            repeated.
        threads: number of threads; None for all processors.
        partial: whether texels that the maps do not reach stay empty.
        options: `padding`, `max_error` and `alpha` of `iccm.meshes.bake.bake`.

    Raises:
        InputError: the target, or a mesh source, has no texture coordinates.
    """
    grid = layout_of([target for target, _, _ in parts], *size, tile)
    placed = baked_parts(parts, sampler.texture, threads, tiles, partial=partial)
    pixels, figures = baking.bake(placed, grid, sampler, threads=threads, **options)
    return pixels, figures | {"flattening": parts[0][0].flattening.report()}


def layout_of(
    targets: Sequence[MeshShape], width: int, height: int, tile: complex | None = None
) -> layout.Layout:
    """Return the texel grid for the parts of a mesh, or for a tile of it, with the triangles of all parts in sequence.

    Raises:
        InputError: a part has no texture coordinates, or invalid ones.
    """
    twins, first = [], 0
    for target in targets:
        twin = target.flattening.patch.triangles.twin
        twins.append(np.where(twin < 0, -1, twin + first))
        first += twin.size
    faces = np.concatenate([target.uv_faces for target in targets])
    return layout.layout(targets[0].spec, targets[0].uv, faces, np.concatenate(twins), width, height, tile)


def baked_parts(
    parts: Parts, texture: Texture, threads: int | None, tiles: Box | None = None, *, partial: bool = False
) -> list[baking.BakedPart]:
    """Return the parts of a target with the texture's place on their sources; arguments as for `bake`."""
    return [
        baking.BakedPart(
            target.flattening, ExtendedInverse(map, threads), source.placing(texture, tiles), partial
        )
        for target, map, source in parts
    ]


def report_bake(run: Run, figures: dict[str, Any], tile: complex | None) -> OutputReport:
    """Return the figures of baking, for a tile under its number, and note texels that lie in several triangles."""
    if count := figures["overlapping_texels"]:
        where = "" if tile is None else f" in tile {number_of(tile)}"
        run.note(
            f"{run.target.spec}: {count} texels{where} lie in several triangles of the layout, which "
            "overlaps; they show the first triangle"
        )
    return OutputReport(figures, tile=None if tile is None else number_of(tile))


def parts_of(run: Run) -> Parts:
    """Return the parts of the target mesh with the map to each and the source's part."""
    return [(as_mesh(target), fit.map, source) for (source, target), fit in zip(run.pairs, run.fits)]


def is_partial(run: Run) -> bool:
    """Return whether parts of the target may stay bare."""
    return any(fit.coverage.is_partial for fit in run.fits)


def size(run: Run) -> tuple[int, int]:
    """Return width and height of a baked picture: by default those of the texture, or of one of its tiles."""
    height, width = run.image.pixels.shape[:2]
    if run.tiles:
        across = run.tiles[1] - run.tiles[0]
        width, height = width // int(across.real), height // int(across.imag)
    return framing.size_within(run.job.size or (width, height), complex(width, height), run.job.max_pixels)
