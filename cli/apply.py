"""`iccm apply`."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from . import logs, options, status
from .paths import FILE


@click.command()
@click.argument("stmap", type=FILE)
@click.argument("image", type=FILE)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=FILE,
    required=True,
    help="The picture to write; - for a PNG on stdout.",
)
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

    Exit code: 0 done, 2 an input is wrong.
    """
    from ..io import files
    from ..io.memory import Bounded
    from ..io.pictures import image_files
    from ..io.pictures import stmap_files as maps
    from ..memory import Memory
    from ..pixels.texture import check_kind

    limit, threads = given["max_pixels"], given["threads"]
    inputs = [Path(name).resolve() for name in (stmap, image)]
    if output != "-" and files.check_output(output, force=given["force"]) in inputs:
        raise InputError(f"{output}: is also an input; name another output")
    room = Bounded(given["memory"], Path(output).resolve().parent) if given["memory"] else Memory()
    sampling = {name: given[name] for name in ("filter", "kind", "edge")} | {"room": room, "threads": threads}
    with ExitStack() as stack:
        stack.enter_context(status.watched("read"))
        st = maps.read(stmap, max_pixels=limit, room=room)
        picture = image_files.read(image, max_pixels=limit, colorspace=given["colorspace"], room=room)
        check_kind(given["kind"], picture.pixels.shape[2], image)
        for note in picture.notes:
            logs.log.warning(note)
        path = stack.enter_context(files.writing(output, force=given["force"]))
        maps.apply(st, picture, path, **sampling)
    if output != "-":
        logs.log.info(f"wrote {output}")
    return 0
