"""What a run can write: pictures, meshes, baked textures, figures."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ...errors import InputError
from .. import formats
from ..spec import Spec
from . import framing, raster_size
from .job import Job
from .plain import Colours
from .state import Run

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...pixels.canvas import Diagnostics
    from ...pixels.warp import Warp
    from ..pictures.image_files import Image

Maker = Callable[[Run, Path | None, Path], None]
"""Writes one product of a run: the run, a temporary file (None for stdout), the final name."""

PADDED, BAKED = (f"the whole picture at once ({option})" for option in ("--padding", "--bake"))


def is_mesh(spec: str) -> bool:
    """Whether a spec names a mesh: by suffix, and for OBJ by what is in it."""
    if not formats.of(Spec.of(spec).path).mesh:
        return False
    from ..meshes import mesh_files

    return mesh_files.is_mesh(spec)


def suffix_for(job: Job) -> str:
    """Of the output that is written when none is named: a mesh for a mesh, else a picture."""
    if job.target is None or job.bake or not is_mesh(job.target):
        return ".png"
    path = Spec.of(job.target).path
    return formats.suffix_of(path) if formats.of(path).uv else ".obj"


def maker(name: str, job: Job) -> Maker:
    """What writes an output, by its suffix.

    Raises:
        InputError: nothing does, or not for this target.
    """
    format, suffix = formats.of(name), formats.suffix_of(name)
    onto_mesh = bool(job.target) and is_mesh(job.target or "")
    if job.bake and not onto_mesh:
        raise InputError(f"{job.target or job.source}: --bake needs a mesh as target")
    if format.mesh:
        if job.target is None:
            raise InputError(
                f"{name}: a deformation is in the plane and writes no mesh; use a picture's suffix"
            )
        if not onto_mesh:
            raise InputError(f"{name}: a mesh is written for a mesh as target; {job.target} is none")
        formats.check(name, "uv", "-o")
        return mesh
    if suffix == ".svg":
        if formats.suffix_of(Spec.of(job.source).path) != ".svg" or onto_mesh:
            raise InputError(
                f"{name}: artwork is carried from an SVG to a planar shape; use a picture's suffix"
            )
        return artwork
    if name != "-":
        formats.check(name, "picture", "-o")
    if job.padding and not job.bake and format.picture and not format.picture.hidden:
        raise InputError(
            f"{name}: {suffix} keeps no colours where alpha is 0, so no --padding; use .png or .tif"
        )
    return baked if job.bake else picture


def plotter(name: str) -> Maker:
    """What draws the figure.

    Raises:
        InputError: unknown suffix.
    """
    formats.check(name, "plot", "--plot")
    return plot


def stmapper(name: str) -> Maker:
    """What writes the map itself.

    Raises:
        InputError: a suffix whose format does not hold floats.
    """
    from ..pictures import stmap_files

    stmap_files.check(name)
    return stmapped


def picture(run: Run, path: Path | None, name: Path) -> None:
    """The texture carried to the target's canvas, in the texture's own depth and colour space."""
    from ..pictures import image_files

    if run.job.padding:
        image = _padded(run)
        with run.timed("write"):
            put(path, lambda file: image_files.write(file, image))
    else:
        put(path, lambda file: _streamed(run, file))


def put(path: Path | None, write: Callable[[Path], None]) -> None:
    """Write to a file, or as PNG to stdout."""
    if path is not None:
        write(path)
        return
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "picture.png")
        with open(Path(folder) / "picture.png", "rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)


def _extended(run: Run, image: Image) -> Image:
    """The picture with its colours extended beyond the outline."""
    from ...pixels.warp import padded
    from ..pictures.image import straight

    with run.timed("resample"):
        image = straight(image)
        return replace(image, pixels=padded(image.pixels, image.alpha, run.job.padding or 0, run.job.fill))


def _warp(run: Run) -> Warp:
    from ...pixels.warp import Warp

    placing = None
    if run.on_mesh:
        from ..shapes import mesh_shape

        placing = mesh_shape.placing(run.source, run.sampler.texture)
    return Warp(run.mapping, run.sampler, run.canvas, placing=placing, max_error=run.job.max_pixel_error)


def _padded(run: Run) -> Image:
    """The picture with padding, which needs all of it at once."""
    from ...pixels.warp import whole, whole_bytes

    with run.timed("resample"):
        work, canvas = _warp(run), run.canvas
        each = whole_bytes(canvas.height, canvas.width, work.channels, work.dtype.itemsize)
        run.room.threads(1, each, PADDED)
        warped = whole(work, threads=run.threads, progress=_advance(run))
    colours = Colours()
    colours.see(warped.pixels, warped.alpha)
    _told(run, colours, warped.diagnostics)
    return _extended(run, run.image.with_pixels(warped.pixels, warped.alpha))


def _streamed(run: Run, path: Path) -> None:
    """The picture, written as it is made: memory for some rows only."""
    from ..pictures import image_files

    def blocks() -> Iterator[NDArray]:
        for block in work.blocks(run.threads):
            if advance:
                advance(len(block))
            colours.see(block, work.alpha)
            yield run.image.with_pixels(block, work.alpha).pixels

    with run.timed("resample"):
        work, advance, colours = _warp(run), _advance(run), Colours()
        like = replace(run.image, alpha=work.alpha)
        image_files.write_bands(path, like, run.canvas.height, run.canvas.width, blocks())
    _told(run, colours, work.diagnostics)


def _told(run: Run, colours: Colours, seen: Diagnostics) -> None:
    """Report what became of the pixels, and say so when they show nothing."""
    run.figures["pixels"] = seen.as_dict()
    textured = bool(run.job.texture) and run.job.texture_box != "bbox" and not run.on_mesh
    note = colours.note(bool(seen.inside or seen.edge), textured)
    if note and note not in run.notes:
        run.note(note)


def _advance(run: Run) -> Callable[[int], None] | None:
    progress = run.progress
    return None if progress is None else lambda done: progress(done, run.canvas.height)


def stmapped(run: Run, path: Path | None, name: Path) -> None:
    """The map as an STMap: for each pixel of the target its place in the texture."""
    from ..pictures import stmap_files

    assert path is not None
    box = framing.covered(run.job, run.source)
    with run.timed("resample"):
        stmap_files.write(path, run.mapping, box, run.canvas, room=run.room, threads=run.threads)


def artwork(run: Run, path: Path | None, name: Path) -> None:
    """The drawing inside the source shape as SVG: its paths mapped, its styles kept."""
    from ..artwork import carry_parts

    assert path is not None
    with run.timed("artwork"):
        carried = [(source, fit.map) for (source, _), fit in zip(run.pairs, run.fits)]
        for note in carry_parts(carried, run.target, path):
            run.note(note)


def mesh(run: Run, path: Path | None, name: Path) -> None:
    """The target mesh with texture coordinates that show the texture: nothing is resampled."""
    from ..shapes import mesh_shape

    assert path is not None
    box = framing.covered(run.job, run.source)
    target: Any = run.target
    options: dict[str, Any] = {"texture": _shown(run), "force": run.job.force, "threads": run.threads}
    with run.timed("write"):
        figures = mesh_shape.new_uvs(target, run.fit.map, run.source, box, path, name=name, **options)
    for note in figures.pop("material_notes"):
        run.note(note)
    before = run.figures.get("also_written", [])
    run.figures |= figures | {"also_written": [*before, *figures["also_written"]]}


def _shown(run: Run) -> Path | bytes | None:
    """The picture that a mesh with new coordinates shows: --texture, or that of a mesh source."""
    from ..shapes import mesh_shape

    if run.job.texture:
        return Path(run.job.texture)
    source: Any = run.source
    return mesh_shape.texture_in(source) if run.on_mesh else None


def check(run: Run) -> None:
    """Refuse before the solving what the products would refuse after it, and tell what is left out of the texture.

    Raises:
        InputError: a mesh without the texture coordinates that are needed, a picture that is too large or has channels
            or a colour space that its format does not hold, normals of fewer than three channels, too little --memory.
    """
    _check_meshes(run)
    job, room = run.job, run.room
    if raster_size.pictured(job) or job.stmap:
        for note in framing.off_canvas(job, run.source, run.target):
            run.note(note)
        low, high = run.target.box
        width, height = raster_size.size_of(job, job.size or (raster_size.LONGER_SIDE,), high - low)
        if job.stmap:
            from ..pictures import stmap_files

            room.check(stmap_files.band_bytes(width), f"rows of {width} pixels")
    if not (raster_size.pictured(job) or job.texture or job.bake):
        return
    from ...pixels.texture import check_kind

    image = run.image
    for note in image.notes:
        run.note(note)
    check_kind(job.kind, image.pixels.shape[2], job.texture or job.source)
    for name in job.output:
        if formats.of(name).mesh:
            from ..meshes import mesh_files

            mesh_files.check_texture(Path(name), _shown(run))
    if job.bake:
        width, height = _baked_size(run)
    elif raster_size.pictured(job):
        image = image.covered()
    if raster_size.pictures(job):
        _check_room(run, image, width, height)
    for name in raster_size.pictures(job):
        _check_picture(run, name, image, width, height)


def _check_meshes(run: Run) -> None:
    source, target = cast(Any, run.source), cast(Any, run.target)
    needed = [target] if run.job.bake else []
    if hasattr(source, "flattening"):
        meshes = any(formats.of(name).mesh for name in run.job.output)
        needed += [source] if run.job.bake or run.on_mesh or meshes else []
    for shape in needed:
        _ = shape.uv_faces
    if not (run.job.bake or hasattr(source, "flattening")):
        return
    from ..shapes import mesh_shape

    if run.job.bake:
        mesh_shape.check_layout(target)
    if run.job.stmap and (run.job.bake or source.file.mesh.uv is not None):
        raise InputError(
            f"{(target if run.job.bake else source).spec}: an STMap cannot hold its texture coordinates; leave out "
            f"{'--bake' if run.job.bake else '--stmap'}, and carry each picture with --texture"
        )
    if run.job.bake or raster_size.pictured(run.job):
        for shape in needed:
            for note in mesh_shape.beyond_unit(shape):
                run.note(note)
    if hasattr(source, "flattening"):
        if not run.on_mesh:
            run.note(f"{source.spec}: names no texture; give one with --texture")
        for note in mesh_shape.several_textures(source) if not run.job.texture else ():
            run.note(note)


def _check_room(run: Run, image: Image, width: int, height: int) -> None:
    from ...pixels.texture import MENDING, strip_bytes
    from ...pixels.warp import band_bytes, whole_bytes

    rows, columns, planes = run.image.pixels.shape
    run.room.check(strip_bytes(rows, columns, planes), "the texture")
    if run.image.holes:
        run.room.check(MENDING * rows * columns, "a texture that is not finite everywhere")
    channels, itemsize = image.pixels.shape[2], image.pixels.itemsize
    if run.job.bake:
        from ...meshes import bake

        run.room.check(bake.whole_bytes(height, width, channels, itemsize), BAKED)
        return
    run.room.check(band_bytes(width), f"rows of {width} pixels")
    if run.job.padding:
        run.room.check(whole_bytes(height, width, channels, itemsize), PADDED)


def _check_picture(run: Run, name: str, image: Image, width: int, height: int) -> None:
    from ..pictures import image_files

    job, suffix, format = run.job, formats.suffix_of(name), formats.picture(name)
    image_files.check("stdout.png" if name == "-" else name, image, height, width)
    as_stored = job.kind != "colour" or job.filter == "nearest"
    hides = not format.hidden and not (format.light == "linear" and format.alpha and image.associated)
    if as_stored and run.image.alpha >= 0 and hides:
        run.note(f"{name}: {suffix} keeps no colours where alpha is 0; use .png or .tif to keep them")
    usual = "lin_rec709" if image.pixels.dtype.kind == "f" else "sRGB"
    if format.light == "any" and not format.named and image.colorspace not in (usual, "data", job.colorspace):
        run.note(f"{name}: {suffix} does not say the colour space {image.colorspace}; its numbers are kept")


def beside(run: Run) -> list[str]:
    """The files that the job's meshes bring along: material libraries and pictures."""
    names = [Path(name) for name in run.job.output if Path(name).suffix.lower() == ".obj"]
    if not names:
        return []
    from ..meshes import mesh_files

    return [other for name in names for other in mesh_files.companions(name, _shown(run))]


def baked(run: Run, path: Path | None, name: Path) -> None:
    """The texture resampled into the layout that the target mesh has."""
    from ..pictures import image_files
    from ..shapes import mesh_shape

    image, size, target = run.image, _baked_size(run), cast(Any, run.target)
    options: dict[str, Any] = {"padding": run.job.padding, "max_error": run.job.max_pixel_error}
    with run.timed("resample"):
        pixels, figures = mesh_shape.bake(
            target, run.fit.map, run.source, run.sampler, size, threads=run.threads, **options
        )
        made = image.with_pixels(pixels, image.alpha)
    run.figures |= figures
    if figures["overlapping_texels"]:
        text = f"{figures['overlapping_texels']} texels lie in several triangles of its layout; the first one's is kept"
        run.note(f"{target.spec}: {text}")
    with run.timed("write"):
        put(path, lambda file: image_files.write(file, made))


def _baked_size(run: Run) -> tuple[int, int]:
    """Width and height of a baked picture: by default the texture's."""
    height, width = run.image.pixels.shape[:2]
    return raster_size.size_of(run.job, run.job.size or (width, height), complex(width, height))


def plot(run: Run, path: Path | None, name: Path) -> None:
    """The figure of the run; for a mesh its flattening and its textured surface."""
    assert path is not None
    with run.timed("plot"):
        if not hasattr(run.target, "flattening"):
            from . import figure as figure

            if len(run.fits) > 1:
                run.note(f"{name}: shows the largest part alone")
            figure.draw(run, path)
            return
        from . import mesh_figure

        target: Any = run.target
        placed = run.image.texture(run.box, kind=run.job.kind)
        mesh_figure.draw(target, path, map=run.fit.map, source=run.source, texture=placed, pins=run.fit.pins)
