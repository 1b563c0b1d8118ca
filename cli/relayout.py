"""`iccm relayout`."""

from __future__ import annotations

from typing import Any

import click

from . import logs, options, status
from .options import FILE

KINDS = {"texture": "colour", "normal": "normal", "normal-down": "normal-down", "data": "data"}


@click.command(cls=options.Command)
@click.argument("old", type=FILE)
@click.argument("new", type=FILE)
@options.of("relayout")
@logs.options
def command(old: str, new: str, output: tuple[str, ...], max_faces: int, outside: bool, **given: Any) -> int:
    """Carry the materials, or textures, of OLD to NEW, the same surface with another UV layout.

    Triangles with the same corners go to each other, however faces are ordered; where there are none, texels are taken
    from the nearest point of OLD. Normals are turned from the old tangents to the new ones (as MikkTSpace makes them).

    \b
    iccm relayout old.glb new.glb -o out.glb
    iccm relayout old.obj new.obj --texture albedo.png -o new-albedo.png
    iccm relayout old.glb new.glb --texture albedo.png --normal normal.png --data rough.png -o 'new/{stem}.png'

    Exit code: 0 done, 1 some of NEW is farther from OLD than the limit or its layout is empty, 2 an input is wrong.
    """
    from ..io import formats, references
    from ..io.meshes import size_limits
    from ..io.run import relayout
    from ..io.spec import Spec

    click.get_current_context().with_resource(references.outside(outside))
    kinds = {kind: given.pop(name.replace("-", "_")) for name, kind in KINDS.items()}
    report, force = given.pop("report"), given["force"]
    formats.check_report(report)
    wanted = relayout.plan(kinds, output, (old, new), force)
    for mesh in (old, new):
        size_limits.faces(Spec.of(mesh).path, max_faces)
    with status.show_phases("carry textures"):
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
    if found["status"] == "empty":
        logs.log.error(
            f"{new}: its texture coordinates cover no texel: there is nothing to carry anything to"
        )
    return int(found["status"] != "done")
