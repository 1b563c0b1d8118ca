"""What `iccm relayout` reads, writes and tells."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...errors import InputError
from ...meshes.charted import Charted
from ...meshes.relayout import Origin, carry
from ...pixels.sampler import Sampler
from ...pixels.texture import check_kind
from .. import files
from ..meshes import mesh_files
from ..pictures import image_files
from ..spec import Spec
from . import report
from .raster_size import bounded

SCHEMA = "iccm.relayout/1"
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

    read = [image_files.read(each.path, max_pixels=max_pixels) for each in wanted]
    width, height = _size(size, [image.pixels.shape for image in read], max_pixels)
    for each, image in zip(wanted, read):
        check_kind(each.kind, image.pixels.shape[2], each.path)
        image_files.check(each.output, image, height, width)
    sources = [mesh_files.read(name) for name in (old, new)]
    before, after = (Charted.of(source.mesh) for source in sources)
    for mesh in (before, after):
        if (mesh.uv_faces < 0).any():
            raise InputError(f"{mesh.name}: some faces have no texture coordinates; give all of them some")
    with one_thread(), ExitStack() as stack:
        origin = Origin.of(before, after, width, height)
        for each, image in zip(wanted, read):
            sampler = Sampler(image.texture((0j, 1 + 1j), each.kind), filter, each.kind, threads=threads)
            made = carry(origin, sampler, limit * after.diagonal, padding=padding, threads=threads)
            path = stack.enter_context(files.writing(each.output, force=force))
            image_files.write(path, image.with_pixels(made, image.alpha))
        notes = [f"{name}: {note}" for name, source in zip((old, new), sources) for note in source.notes]
        notes += [f"{each.path}: {note}" for each, image in zip(wanted, read) for note in image.notes]
        figures = _figures(origin, limit, [old, new, *(each.path for each in wanted)]) | {"notes": notes}
        if report_to:
            report.write(figures, report_to, stack, force=force)
    return figures


def _size(size: tuple[int, ...] | None, shapes: Sequence[tuple[int, ...]], most: int) -> tuple[int, int]:
    height, width, _ = max(shapes, key=lambda shape: shape[0] * shape[1])
    if size is None:
        return width, height
    return bounded(size, complex(width, height), most)


def _figures(origin: Origin, limit: float, inputs: Sequence[str]) -> dict[str, Any]:
    diagonal, partner = origin.new.diagonal, origin.partner
    far = int(origin.far(limit * diagonal).sum())
    paths = [Spec.of(name).path for name in inputs]
    return report.plain(
        {
            "schema": SCHEMA,
            "version": __version__,
            "status": "far" if far else "done",
            "triangles": partner.size,
            "same_triangles": int((partner >= 0).sum()),
            "distance": {
                "limit": limit,
                "p95": float(np.quantile(origin.distance, 0.95)) / diagonal if origin.distance.size else 0.0,
                "max": float(origin.distance.max(initial=0.0)) / diagonal,
            },
            "nearest_texels": int(origin.nearest.size),
            "far_texels": far,
            "layout": origin.grid.report,
            "inputs": [{"path": str(path), "sha256": files.sha256(path)} for path in paths],
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
