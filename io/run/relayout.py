"""What `iccm relayout` reads, writes and tells."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...arrays import Box
from ...errors import InputError
from ...meshes.charted import Charted
from ...meshes.relayout import Origin, carry
from ...pixels.sampler import Sampler
from ...pixels.texture import check_kind
from .. import files
from ..meshes import mesh_files
from ..pictures import image_files, tiles
from ..pictures.image import Image
from ..spec import Spec
from . import report
from .inputs import tiled
from .raster_size import bounded

SCHEMA = "iccm.relayout/1"
TEXELS = ("overlapping_texels", "covered_texels")  # of a layout, counted in each tile
STEM = "{stem}"  # in an output's name: that of the texture


@dataclass(frozen=True)
class CarriedPicture:
    """A texture to carry over.

    Attributes:
        path: of the old layout.
        kind: what its channels are (see `pixels.sampler.KINDS`).
        output: where it goes.
    """

    path: str
    kind: str
    output: str


def pictures(given: dict[str, Sequence[str]], outputs: Sequence[str], meshes: Sequence[str], force: bool):
    """The textures of each kind with their outputs: one for each, in order, or one name with `{stem}`.

    Raises:
        InputError: none given, an output too many or too few, named twice, or an input.
    """
    all_of = [(path, kind) for kind, paths in given.items() for path in paths]
    if not all_of:
        raise InputError("no texture: name one with --texture, --normal or --data")
    if len(outputs) == 1 and STEM in outputs[0]:
        names = [outputs[0].replace(STEM, Path(path).stem) for path, _ in all_of]
    elif len(outputs) == len(all_of):
        names = list(outputs)
    else:
        raise InputError(
            f"{len(all_of)} textures and {len(outputs)} outputs: name one -o for each texture, or one with {STEM} in it"
        )
    taken = {Spec.of(mesh).path.resolve() for mesh in meshes} | {Path(path).resolve() for path, _ in all_of}
    for name in names:
        real = files.check_output(name, force=force)
        if real in taken:
            raise InputError(f"{name}: is an input, or named for two outputs; name another file")
        taken.add(real)
    return [CarriedPicture(path, kind, name) for (path, kind), name in zip(all_of, names)]


def run(
    old: str,
    new: str,
    wanted: Sequence[CarriedPicture],
    *,
    size: tuple[int, ...] | None,
    filter: str,
    limit: float,
    padding: int | None,
    max_pixels: int,
    threads: int | None,
    report_to: str | None,
    force: bool,
) -> dict[str, Any]:
    """Carry textures from one layout to another; the report.

    Args:
        old: the mesh with the layout that the textures have.
        new: the mesh with the layout to make them for.
        wanted: the textures.
        size: of the new pictures, or their longer side; by default that of the largest texture.
        filter: how textures are sampled.
        limit: the largest distance between the surfaces, of the new mesh's diagonal.
        padding: texels to spread past the charts.
        max_pixels: the largest picture read.
        threads: never change the result.
        report_to: where the report is written.
        force: whether files are replaced.

    Raises:
        InputError: a mesh without texture coordinates, a picture that cannot be read or written.
    """
    from ...blas import one_thread

    sources = [mesh_files.read(name) for name in (old, new)]
    before, after = (Charted.of(source.mesh) for source in sources)
    for mesh in (before, after):
        if (mesh.uv_faces < 0).any():
            raise InputError(f"{mesh.name}: some faces have no texture coordinates; give all of them some")
    read = [_read(each.path, before, max_pixels) for each in wanted]
    width, height = _size(size, read, max_pixels)
    for each, (image, _) in zip(wanted, read):
        check_kind(each.kind, image.pixels.shape[2], each.path)
        image_files.check(each.output, image, height, width)
    files_of = [_outputs(each.output, after, force) for each in wanted]
    with one_thread(), ExitStack() as stack:
        needed = dict.fromkeys(tile for names in files_of for tile in names)
        origins = {tile: Origin.of(before, after, width, height, tile) for tile in needed}
        for each, (image, box), names in zip(wanted, read, files_of):
            sampler = Sampler(image.texture((0j, 1 + 1j), each.kind), filter, each.kind, threads=threads)
            for tile, name in names.items():
                options: dict[str, Any] = {"tiles": box, "padding": padding, "threads": threads}
                made = carry(origins[tile], sampler, limit * after.diagonal, **options)
                path = stack.enter_context(files.writing(name, force=force))
                image_files.write(path, image.with_pixels(made, image.alpha))
        notes = [f"{name}: {note}" for name, source in zip((old, new), sources) for note in source.notes]
        notes += [_named(each.path, note) for each, (image, _) in zip(wanted, read) for note in image.notes]
        inputs = tiled([str(Spec.of(name).path) for name in (old, new)] + [each.path for each in wanted])
        figures = _figures(list(origins.values()), limit, inputs) | {"notes": notes}
        figures["written"] = [name for names in files_of for name in names.values()]
        if report_to:
            report.write(figures, report_to, stack, force=force)
    return figures


def _read(path: str, mesh: Charted, max_pixels: int) -> tuple[Image, Box | None]:
    """A texture, and what of the mesh's layout it covers where it is of several tiles."""
    if not tiles.is_pattern(path):
        return image_files.read(path, max_pixels=max_pixels), None
    found = tiles.read(path, tiles.all_of(mesh.uv[mesh.uv_faces].mean(axis=1)), max_pixels=max_pixels)
    return found.image, found.box


def _outputs(name: str, mesh: Charted, force: bool) -> dict[complex | None, str]:
    """The files of an output, by the tile of the layout that each is of.

    Raises:
        InputError: one cannot be written, or faces lie where no tile has a number.
    """
    if not tiles.is_pattern(name):
        return {None: name}
    found: dict[complex | None, str] = {}
    for tile in tiles.all_of(mesh.uv[mesh.uv_faces].mean(axis=1)):
        number = tiles.number_of(tile)
        if number is None:
            raise InputError(
                f"{mesh.name}: faces lie at u {tile.real:g}, v {tile.imag:g}, where no tile has a number"
            )
        found[tile] = tiles.name_of(name, number)
        files.check_output(found[tile], force=force)
    return found


def _named(path: str, note: str) -> str:
    return note if note.startswith(path) else f"{path}: {note}"


def _size(
    size: tuple[int, ...] | None, read: Sequence[tuple[Image, Box | None]], most: int
) -> tuple[int, int]:
    """Width and height of the new pictures: by default those of the largest, or of a tile of it."""
    sizes = []
    for image, box in read:
        height, width = image.pixels.shape[:2]
        across = box[1] - box[0] if box else 1 + 1j
        sizes.append((width // int(across.real), height // int(across.imag)))
    width, height = max(sizes, key=lambda sides: sides[0] * sides[1])
    return (width, height) if size is None else bounded(size, complex(width, height), most)


def _figures(origins: Sequence[Origin], limit: float, inputs: Sequence[str]) -> dict[str, Any]:
    first = origins[0]
    diagonal, partner = first.new.diagonal, first.partner
    distance = np.concatenate([origin.distance for origin in origins])
    far = sum(int(origin.far(limit * diagonal).sum()) for origin in origins)
    layout = {key: sum(origin.grid.report[key] for origin in origins) for key in TEXELS}
    return report.plain(
        {
            "schema": SCHEMA,
            "version": __version__,
            "status": "far" if far else "done",
            "triangles": partner.size,
            "same_triangles": int((partner >= 0).sum()),
            "distance": {
                "limit": limit,
                "p95": float(np.quantile(distance, 0.95)) / diagonal if distance.size else 0.0,
                "max": float(distance.max(initial=0.0)) / diagonal,
            },
            "nearest_texels": sum(int(origin.nearest.size) for origin in origins),
            "far_texels": far,
            "layout": first.grid.report | layout,
            "inputs": [{"path": name, "sha256": files.sha256(name)} for name in inputs],
        }
    )


def remarks(figures: dict[str, Any]) -> list[str]:
    """What a person may want to know, a sentence each; the first says how triangles were found."""
    same, count = figures["same_triangles"], figures["triangles"]
    found = [f"{same} of {count} triangles are those of the old mesh"]
    nearest, overlaps = figures["nearest_texels"], figures["layout"]["overlapping_texels"]
    if nearest:
        worst = f"{figures['distance']['max']:.2g} of the diagonal"
        found.append(f"{nearest} texels are taken from the nearest point, {worst} away at most")
    if overlaps:
        found.append(f"{overlaps} texels lie in several triangles of the new layout; the first one's is kept")
    return found
