"""Checks before solving that several kinds of output share; repeated notes are reported once."""

from __future__ import annotations

from ....errors import InputError
from ....pixels.texture import MENDING_BYTES_PER_TEXEL, check_kind, strip_bytes
from ... import references
from ...shapes.shape import Shape
from .. import framing
from ..state import Run
from ..texture import has_texture


def source(run: Run) -> None:
    """Note which texture of a mesh source is used, if any.

    Raises:
        InputError: there are placing options, which are only possible for textures that lie flat; or the mesh's own
            picture may not be read.
    """
    if not run.source.is_mesh:
        return
    placing = framing.placing_options(run.job) + (["--edge mirror"] if run.job.edge == "mirror" else [])
    if placing:
        raise InputError(
            f"{run.source.spec}: {placing[0]} does not apply to a mesh, whose texture coordinates place the "
            "texture; leave it out"
        )
    if not has_texture(run.job, run.source) and not run.job.checkered:
        unread = next((note for note in run.source.notes if references.OUTSIDE in note), None)
        if unread:  # a checkerboard in its place would be a surprise
            raise InputError(f"{run.source.spec}: {unread}, or name another texture with --texture")
        run.note(f"{run.source.spec}: has no texture; name one with --texture")
        return
    pictures = dict.fromkeys(picture for source, _ in run.pairs for picture in source.pictures)
    if not run.job.texture and len(pictures) > 1:
        first = next(iter(pictures))
        name = f"that of {run.source.part or 'one material'}" if isinstance(first, bytes) else str(first)
        text = f"{name} replaces all of its {len(pictures)} textures; choose one part with file#part"
        run.note(f"{run.source.spec}: {text}")


def texture(run: Run) -> None:
    """Note what was left out of the texture.

    Raises:
        InputError: it cannot be read, or has fewer channels than its kind needs.
    """
    run.note(*run.image.notes, *framing.stretch_notes(run.job, run.source, run.image.pixels.shape))
    check_kind(run.job.kind, run.image.pixels.shape[2], run.job.texture or run.job.source)


def coordinates(run: Run, *shapes: Shape) -> None:
    """Note texture coordinates of meshes outside of 0..1.

    Raises:
        InputError: a mesh has none, or some that are not finite.
    """
    from ...shapes.mesh_shape import as_mesh

    counts: dict[str, int] = {}
    for shape in shapes:
        counts[shape.spec] = counts.get(shape.spec, 0) + as_mesh(shape).beyond_unit
    tiled = run.source.spec if run.tiles else None
    for spec, count in counts.items():
        if count and spec != tiled:
            text = "have texture coordinates outside 0..1, where the texture repeats; use <UDIM> for separate tiles"
            run.note(f"{spec}: {count} triangles {text}")


def canvas(run: Run, tile: complex | None = None) -> tuple[int, int]:
    """Return width and height of the target's raster before the map is known, and note what it shows of the target.

    Args:
        run: the job.
        tile: the tile that is shown, if there are several.

    Raises:
        InputError: there are more pixels than --max-pixels.
    """
    run.note(*framing.remarks(run.job, run.source, run.target) if tile is None else ())
    return framing.canvas_size(run.job, framing.picture_box(run.job, run.target))


def room(run: Run) -> None:
    """Check that the texture fits into --memory.

    Raises:
        InputError: it does not.
    """
    rows, columns, planes = run.image.pixels.shape
    run.room.check(strip_bytes(rows, columns, planes), "the texture")
    if run.image.holes:
        run.room.check(MENDING_BYTES_PER_TEXEL * rows * columns, "a texture with pixels that are not finite")
