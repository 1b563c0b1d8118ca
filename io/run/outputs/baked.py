"""The texture resampled into the layout that the target mesh has (--bake)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ....maps.extended_inverse import ExtendedInverse
from ....maps.kinds import AnyMap
from ....meshes import bake as baking
from ....meshes import layout
from ....pixels.sampler import Sampler
from ...pictures import image_files
from ...shapes.mesh_shape import MeshShape, as_mesh
from ...shapes.shape import Shape
from .. import raster_size
from ..state import Run
from . import checks
from .picture import Picture

BAKED = "the whole picture at once (--bake)"


class Baked(Picture):
    """A picture for the texture coordinates of the target mesh."""

    def check(self, run: Run) -> None:
        """The layouts, the texture, room for both, and whether the format holds what will be made."""
        target = as_mesh(run.target)
        layout.check_layout(target.spec, target.uv, target.uv_faces)
        checks.coordinates(run, target, *([run.source] if run.source.is_mesh else []))
        checks.texture(run)
        (width, height), image = _size(run), run.image
        checks.room(run)
        room = baking.whole_bytes(height, width, image.pixels.shape[2], image.pixels.itemsize)
        run.room.check(room, BAKED)
        self.check_format(run, image, width, height)

    def write(self, run: Run, path: Path) -> None:
        """The whole at once."""
        target, job = as_mesh(run.target), run.job
        options: dict[str, Any] = {"padding": job.padding, "max_error": job.max_pixel_error}
        with run.phases.timed("resample"):
            pixels, figures = bake(
                target, run.fit.map, run.source, run.sampler, _size(run), threads=run.threads, **options
            )
            made = run.image.with_pixels(pixels, run.image.alpha)
        run.figures |= figures
        if count := figures["overlapping_texels"]:
            run.note(
                f"{target.spec}: {count} texels lie in several triangles of its layout; the first one's is kept"
            )
        with run.phases.timed("write"):
            image_files.write(path, made)


def bake(
    target: MeshShape,
    map: AnyMap,
    source: Shape,
    sampler: Sampler,
    size: tuple[int, int],
    *,
    threads: int | None = None,
    **options: Any,
) -> tuple[NDArray, dict[str, Any]]:
    """The texture resampled into the target's own UV layout: its pixels, and figures for the report.

    Args:
        target: the mesh.
        map: from the source's plane to the target's.
        source: its shape; a mesh gives its own texture coordinates.
        sampler: the texture, which lies in the source's plane or is that of a mesh source.
        size: width and height of the picture to make.
        threads: as many as there are processors by default.
        options: padding, max_error of `iccm.meshes.bake.bake`.

    Raises:
        InputError: the target, or a mesh source, has no texture coordinates.
    """
    twin = target.flattening.patch.triangles.twin
    grid = layout.layout(target.spec, target.uv, target.uv_faces, twin, *size)
    inverse, place = ExtendedInverse(map, threads), source.placing(sampler.texture)
    pixels, figures = baking.bake(
        target.flattening, grid, inverse, sampler, place, threads=threads, **options
    )
    return pixels, figures | {"flattening": target.flattening.report()}


def _size(run: Run) -> tuple[int, int]:
    """Width and height of a baked picture: by default the texture's."""
    height, width = run.image.pixels.shape[:2]
    return raster_size.bounded(run.job.size or (width, height), complex(width, height), run.job.max_pixels)
