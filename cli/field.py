"""`iccm field`."""

from __future__ import annotations

import click

from . import logs, options, status
from .options import FILE


@click.command("field", cls=options.Command)
@click.argument("maps", type=FILE, nargs=-1, required=True, metavar="MAP...")
@options.of("field")
def command(
    maps: tuple[str, ...],
    output: str,
    size: tuple[int, ...] | None,
    fixed: str | None,
    moving: str | None,
    vectors: str | None,
    force: bool,
) -> int:
    """Write saved maps as a displacement field, arrays for OpenCV, or a picture for compositors.

    Each pixel of the target's canvas contains its place in the source. inverse:MAP is the inverse of a map, and several
    maps are applied one after another. The suffix of the output decides: .nrrd .mha .nii .nii.gz are displacement
    fields of ITK, .npz contains map_x and map_y for cv2.remap, .exr and .tif are STMaps, or with --vectors pixels
    vectors in pixels.

    \b
    iccm field rose-leaf.npz --moving petals.jpg -o field.nrrd
    iccm field inverse:rose-leaf.npz --fixed petals.jpg -o back.nrrd
    iccm field rose-leaf.npz --moving petals.jpg --size 800 -o remap.npz
    iccm apply field.nrrd petals.jpg -o petals-on-leaf.png

    Exit code: 0 done, 2 wrong input.
    """
    from ..io import fields

    with status.show_phases("sample"):
        width, height = fields.write(
            maps,
            output,
            size=size,
            fixed=fixed,
            moving=moving,
            vectors=vectors,
            force=force,
            tell=logs.log.warning,
        )
    logs.log.info(f"wrote {output}, {width}×{height}")
    return 0
