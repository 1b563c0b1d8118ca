"""`iccm relayout`."""

from __future__ import annotations

from typing import Any

import click

from ..io.run.options import size
from . import logs, options, status
from .paths import FILE, OUTSIDE

KINDS = {"texture": "colour", "normal": "normal", "normal-down": "normal-down", "data": "data"}
HELP = {
    "texture": "A picture of colours to carry over; may be repeated, as the next three.",
    "normal": "A tangent-space normal map, y up (OpenGL, glTF, Blender).",
    "normal-down": "One with y down (DirectX).",
    "data": "A picture of numbers: roughness, height, masks.",
}


def _pictures(function):
    for name in reversed(KINDS):
        function = click.option(f"--{name}", multiple=True, type=FILE, metavar="IMAGE", help=HELP[name])(
            function
        )
    return function


@click.command()
@click.argument("old", type=FILE)
@click.argument("new", type=FILE)
@_pictures
@click.option(
    "-o",
    "--output",
    multiple=True,
    type=FILE,
    metavar="FILE",
    required=True,
    help="What to write: NEW as .glb or .obj with all maps of OLD's materials; or pictures, one for each given, or "
    "one name with {stem} in it, the picture's own. May be repeated.",
)
@click.option(
    "--size",
    metavar="WxH|N",
    callback=options.parsed(size),
    help="Of the pictures made.  [default: the largest one given]",
)
@click.option(
    "--limit",
    type=click.FloatRange(0),
    default=0.01,
    show_default=True,
    help="How far apart the surfaces may be, of the diagonal; what is farther stays empty.",
)
@click.option(
    "--padding", type=click.IntRange(-1), help="Texels to spread past the charts.  [default: size / 32]"
)
@click.option("--max-faces", type=int, default=5_000_000, show_default=True, help="Refuse larger meshes.")
@click.option("--report", type=FILE, metavar="FILE.json", help="What was found, as JSON; - for stdout.")
@OUTSIDE
@click.option("--force", is_flag=True, help="Replace files that exist.")
@options.of("relayout")
@logs.options
def command(old: str, new: str, output: tuple[str, ...], max_faces: int, **given: Any) -> int:
    """Carry the materials, or textures, of OLD to NEW, the same surface with another UV layout.

    Triangles with the same corners go to each other, however faces are ordered; where there are none, texels are taken
    from the nearest point of OLD. Normals are turned from the old tangents to the new ones (as MikkTSpace makes them).

    \b
    iccm relayout old.glb new.glb -o out.glb
    iccm relayout old.obj new.obj --texture albedo.png -o new-albedo.png
    iccm relayout old.glb new.glb --texture albedo.png --normal normal.png --data rough.png -o 'new/{stem}.png'

    Exit code: 0 done, 1 some of NEW is farther from OLD than the limit, 2 an input is wrong.
    """
    from ..io import formats
    from ..io.meshes import size_limits
    from ..io.run import relayout
    from ..io.spec import Spec

    kinds = {kind: given.pop(name.replace("-", "_")) for name, kind in KINDS.items()}
    report, force = given.pop("report"), given["force"]
    formats.check_report(report)
    wanted = relayout.wanted(kinds, output, (old, new), force)
    for mesh in (old, new):
        size_limits.faces(Spec.of(mesh).path, max_faces)
    with status.watched("carry textures"):
        found = relayout.run(old, new, wanted, report_to=report, **given)
    for note in found["notes"]:
        logs.log.warning(note)
    for remark in relayout.remarks(found):
        logs.log.info(remark)
    for name in found["written"]:
        logs.log.info(f"wrote {name}")
    if far := found["far_texels"]:
        limit = f"{given['limit']:g} of the diagonal"
        logs.log.error(f"{new}: {far} texels are farther from {old} than {limit}: left empty")
    return int(found["far_texels"] > 0)
