"""`iccm compose`."""

from __future__ import annotations

import click

from . import logs, options, status
from .options import FILE


@click.command("compose", cls=options.Command)
@click.argument("maps", type=FILE, nargs=-1, required=True, metavar="MAP...")
@options.of("compose")
def command(maps: tuple[str, ...], output: str, force: bool) -> int:
    """Write the composition of saved maps: the first MAP is applied first, and inverse:MAP is the inverse of a map.

    Each map must begin on the shape on which the one before it ends. The result is a saved map like any other, for
    `iccm apply`, `iccm info` and --start, and is certified again.

    \b
    iccm compose rose-leaf.npz leaf-heart.npz -o rose-heart.npz
    iccm compose heart-leaf.npz inverse:rose-leaf.npz -o heart-rose.npz
    iccm compose inverse:rose-leaf.npz -o leaf-rose.npz

    Exit code: 0 done, 1 the composition is not certified, 2 wrong input.
    """
    from ..errors import InputError
    from ..io import files, formats
    from ..io.compose import compose
    from ..io.spec import saved_map_of

    if not formats.of(output).map:
        raise InputError(f"{output}: a composition is a saved map; choose a name that ends in .npz")
    inputs = [saved_map_of(name)[0] for name in maps]
    files.check_outputs([output], inputs, force=force)
    with status.show_phases("compose"):
        fit, planes = compose(maps)
    with files.writing(output, force=force) as path:
        fit.save(path, planes)
    logs.log.info(f"wrote {output}")
    logs.log.info(f"{fit.notes[0]} {fit.summary()}")
    return 0 if fit.status.ok else 1
