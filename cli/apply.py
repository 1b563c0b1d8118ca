"""`iccm apply`."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from . import logs, options, status
from .options import FILE


@click.command(cls=options.Command)
@click.argument("stmap", type=FILE)
@click.argument("image", type=FILE)
@options.of("apply")
@logs.options
def command(stmap: str, image: str, output: str, **given: Any) -> int:
    """Warp IMAGE through STMAP, a map that `iccm map --stmap` or another program wrote.

    An STMap is a picture of floats: red is where in the image a pixel comes from, from 0 at its left edge to 1 at its
    right edge, green the same from its bottom to its top edge; alpha is the coverage. The map is solved once, and the
    pictures of a whole material go through it.

    \b
    iccm map rose.svg leaf.svg --stmap leaf.exr
    iccm apply leaf.exr albedo.png -o leaf-albedo.png
    iccm apply leaf.exr normal.png --kind normal -o leaf-normal.png
    iccm apply leaf.exr roughness.tif --kind data -o leaf-roughness.tif

    Names with <UDIM> in them stand for the tiles of texture coordinates: 'leaf.<UDIM>.exr' for all that there are.

    Exit code: 0 done, 2 an input is wrong.
    """
    from ..io import files, formats
    from ..io.memory import Bounded
    from ..io.pictures import image_files, tiles
    from ..io.pictures import stmap_files as maps
    from ..memory import Memory
    from ..pixels.texture import check_kind

    room = Bounded(given["memory"], Path(output).resolve().parent) if given["memory"] else Memory()
    sampling = {name: given[name] for name in ("filter", "kind", "edge", "threads")} | {"room": room}
    limits = {"max_pixels": given["max_pixels"], "colorspace": given["colorspace"], "room": room}
    pairs = _tiles(stmap, output)
    made = [name for _, name in pairs if name != "-"]
    images = tiles.files_of(image) if tiles.is_pattern(image) else [image]
    files.check_outputs(made, [*images, *(name for name, _ in pairs)], force=given["force"])
    with ExitStack() as stack:
        stack.enter_context(status.show_phases("read"))
        for source, name in pairs:
            st = maps.read(source, max_pixels=given["max_pixels"], room=room)
            picture, box = _picture(image, st, limits)
            check_kind(given["kind"], picture.pixels.shape[2], image)
            lost = image_files.clipping_note(formats.written(name), picture)
            for note in (*picture.notes, *([f"{name}: {lost}"] if lost else [])):
                logs.log.warning(note)
            path = stack.enter_context(files.writing(name, force=given["force"]))
            maps.apply(st, picture, path, tiles=box, **sampling)
    for name in made:
        logs.log.info(f"wrote {name}")
    return 0


def _tiles(stmap: str, output: str) -> list[tuple[str, str]]:
    """The STMaps and what is made of each: of tiles (UDIM) all that there are.

    Raises:
        InputError: one of the names is for tiles and the other is not, or there are none.
    """
    from ..io.pictures import tiles

    if not (tiles.is_pattern(stmap) or tiles.is_pattern(output)):
        return [(stmap, output)]
    if not (tiles.is_pattern(stmap) and tiles.is_pattern(output)):
        raise InputError(f"{output}: {tiles.MARK} must stand in the names of both, the STMap and the output")
    found = tiles.files_of(stmap)
    if not found:
        raise InputError(f"{stmap}: no such files")
    return [(name, tiles.name_of(output, tiles.number_in(stmap, name))) for name in found]


def _picture(image: str, st: Any, limits: dict[str, Any]) -> tuple[Any, Any]:
    """The picture, and what of s and t it covers where it is of several tiles."""
    from ..io.pictures import image_files, stmap_files, tiles

    if not tiles.is_pattern(image):
        return image_files.read(image, **limits), None
    found = tiles.read(image, tiles.all_of(stmap_files.places(st)), **limits)
    return found.image, found.box
