"""`iccm apply`: pictures through STMaps, and pictures, drawings and points through saved maps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

import click

from ..errors import InputError
from ..io.options import of_command
from ..status import Status
from . import logs, options, status
from .options import FILE

SAVED = (
    *("inverse", "columns", "pixel_size", "unit", "unmapped"),
    *("max_line_error", "report", "size", "texture_box", "target_box"),
)
"""Options that do not apply to an STMap."""
OF_PICTURES = ("texture_box", "edge", "filter", "kind", "colorspace", "size", "target_box")
"""Options that only apply to pictures."""


def refuse_given(names: Iterable[str], arguments: dict[str, Any], why: str) -> None:
    """Raise an InputError for the first of some options whose value is not its default."""
    rows = of_command("apply")
    for name in names:
        if arguments[name] not in (None, rows[name][1].default):
            raise InputError(f"--{name.replace('_', '-')}: {why}")


@click.command("apply", cls=options.Command)
@click.argument("maps", type=FILE, nargs=-1, required=True, metavar="MAP...")
@click.argument("input", type=FILE)
@options.of("apply")
def command(maps: tuple[str, ...], input: str, output: str, **arguments: Any) -> int:
    """Carry INPUT through MAP, a saved map. INPUT is a picture, a drawing, or a file of points, lines and polygons.

    MAP is an .npz file written by `iccm map -o map.npz`. It carries pictures, drawings (.svg .dxf), tables of points
    (.csv .tsv), GeoJSON, landmarks (.json .tps .pts), regions of ImageJ (.roi .zip) and lines (.obj), in the units of
    the files, from the source to the target or (--inverse) back. The output has the format of the input; DXF is written
    in millimetres.

    Several maps are applied one after another, the first MAP first; inverse:MAP is the inverse of a map. --inverse
    inverts the whole chain.

    MAP can also be an STMap, written by `iccm map --stmap` or another program, which carries pictures. An STMap is a
    picture of floats that gives for each pixel the position from which its colour is taken: red runs from 0 at the
    left edge to 1 at the right edge, green from 0 at the bottom to 1 at the top, alpha is the coverage.

    MAP can also be a field written by `iccm field` or other programs: a displacement field of ITK (.nrrd .mha .nii), or
    arrays map_x and map_y for OpenCV's remap (.npz).

    A name with <UDIM> stands for all tiles of a UV layout, such as 'leaf.<UDIM>.exr'.

    \b
    iccm map rose.svg leaf.svg -o leaf.npz --stmap leaf.exr
    iccm apply leaf.npz petals.jpg -o petals-on-leaf.png
    iccm apply leaf.npz landmarks.csv -o on-leaf.csv
    iccm apply leaf.npz cells.geojson --inverse -o on-rose.geojson
    iccm apply leaf.npz inverse:heart-leaf.npz cells.geojson -o on-heart.geojson
    iccm apply leaf.exr normal.png --kind normal -o leaf-normal.png

    Exit code: 0 done, 1 the result is empty, 2 wrong input.
    """
    from ..io import fields, formats

    fault = ""
    with status.show_phases("read"):
        if len(maps) == 1 and (not formats.of(maps[0]).map or fields.is_field(maps[0])):
            written, fault = _stmap(maps[0], input, output, arguments)
        else:
            written, fault = _saved(maps, input, output, arguments)
    for name in written:
        logs.log.info(f"wrote {name}")
    if fault:
        logs.log.error(fault)
    return int(bool(fault))


Carried = tuple[list[str], str]
"""Names of the files that were written, and what is wrong with the result, or an empty text."""


def _saved(maps: Sequence[str], input: str, output: str, arguments: dict[str, Any]) -> Carried:
    """Carry a file through saved maps."""
    from ..io import formats
    from ..io.apply import carry_geometry, in_one, inverse_chain, read_chain
    from ..io.geometry.document import READERS
    from ..io.spec import path_of

    if unsaved := [name for name in maps if not formats.of(name).map]:
        raise InputError(
            f"{unsaved[0]}: only saved maps (.npz) can be chained; apply other maps one at a time"
        )
    name = formats.suffix_of(path_of(input))
    chain = inverse_chain(maps) if arguments["inverse"] else maps
    steps = read_chain(chain)
    of_geometry = ("columns", "pixel_size", "unit", "max_line_error", "unmapped", "report")
    geometry_options = {key: arguments[key] for key in of_geometry}
    if name in READERS:
        refuse_given(OF_PICTURES, arguments, f"is for pictures, and {input} is not a picture")
        counts = carry_geometry(
            steps, input, output, force=arguments["force"], tell=logs.log.warning, **geometry_options
        )
        carried = ", ".join(
            f"{counts[kind]} {kind}" for kind in ("points", "lines", "polygons") if counts[kind]
        )
        written = [path for path in (output, geometry_options["report"]) if path not in ("-", None)]
        if any(counts.values()) and not carried:
            return written, f"{input}: all of it lies outside of the map, so the result is empty"
        logs.log.info(f"carried {carried or 'nothing, since the file has no points, lines or polygons'}")
        return written, ""
    drawings = (".svg", ".svgz", ".dxf")
    error = geometry_options.pop("max_line_error") if name in drawings else None
    refuse_given(geometry_options, arguments, f"is for points, lines and polygons, and {input} contains none")
    if name not in drawings and name not in formats.holding("picture"):
        readable = [*formats.holding("picture"), *drawings, *READERS]
        raise InputError(f"{input}: cannot carry a file of this type; use {formats.one_of(readable)}")
    used_here = ("inverse", "max_line_error", *geometry_options)
    job = {key: value for key, value in arguments.items() if value is not None and key not in used_here}
    threads = job.pop("threads", None)
    as_drawing = name in drawings and output != "-" and formats.of(output).drawing
    if as_drawing:
        refuse_given(("kind",), arguments, f"is for pictures, and {output} is a drawing")
    job |= {"max_line_error": error} if error else {}
    job |= {"output": [output]} | ({"source": input} if as_drawing else {"texture": input})
    saved = in_one(chain, steps)
    is_empty = saved.carry(job, threads=threads, tell=logs.log.warning)
    return [output] if output != "-" else [], Status.EMPTY.value if is_empty else ""


def _stmap(stmap: str, image: str, output: str, arguments: dict[str, Any]) -> Carried:
    """Warp a picture, or its tiles, through an STMap."""
    from ..io import fields, files, formats
    from ..io.memory import within
    from ..io.pictures import image_files, tiles
    from ..io.pictures import stmap_files as maps
    from ..pixels.texture import check_kind

    refuse_given(SAVED, arguments, f"needs a map in an .npz file, and {stmap} is an STMap")
    room = within(arguments["memory"], output)
    arguments["kind"] = arguments["kind"] or "colour"
    sampling = {name: arguments[name] for name in ("filter", "kind", "edge", "threads")} | {"room": room}
    limits = {"max_pixels": arguments["max_pixels"], "colorspace": arguments["colorspace"], "room": room}
    pairs = _tiles(stmap, output)
    outputs = [name for _, name in pairs if name != "-"]
    images = tiles.files_of(image) if tiles.is_pattern(image) else [image]
    files.check_outputs(outputs, [*images, *(name for name, _ in pairs)], force=arguments["force"])
    faults = list[str]()
    with ExitStack() as stack:
        for source, name in pairs:
            if fields.is_field(source):
                picture, box = image_files.read(image, **limits), None
                st = fields.read(source, (picture.pixels.shape[1], picture.pixels.shape[0]))
            else:
                st = maps.read(source, max_pixels=arguments["max_pixels"], room=room)
                picture, box = tiles.read_any(image, partial(maps.places, st), **limits)
            check_kind(arguments["kind"], picture.pixels.shape[2], image)
            losses = image_files.losses(formats.written(name), picture)
            for note in (*picture.notes, *(f"{name}: {loss}" for loss in losses)):
                logs.log.warning(note)
            path = stack.enter_context(files.writing(name, force=arguments["force"]))
            faults.append(maps.apply(st, picture, path, tiles=box, **sampling))
    return outputs, f"{stmap}: {faults[0]}, so the result shows nothing" if all(faults) else ""


def _tiles(stmap: str, output: str) -> list[tuple[str, str]]:
    """Return pairs of an STMap and its output; for tiles (UDIM) one pair for each existing tile.

    Raises:
        InputError: only one of the names contains <UDIM>, or no tile exists.
    """
    from ..io.pictures import tiles

    if not (tiles.is_pattern(stmap) or tiles.is_pattern(output)):
        return [(stmap, output)]
    if not (tiles.is_pattern(stmap) and tiles.is_pattern(output)):
        raise InputError(
            f"{output}: {tiles.MARK} must be in both names, that of the STMap and that of the output"
        )
    files = tiles.files_of(stmap)
    if not files:
        raise InputError(f"{stmap}: no file matches this pattern")
    return [(name, tiles.name_of(output, tiles.number_in(stmap, name))) for name in files]
