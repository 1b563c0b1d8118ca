"""`iccm init`."""

from __future__ import annotations

import click

from . import logs, options
from .options import FILE


@click.command("init", cls=options.Command)
@click.argument("manifest", type=FILE, default="jobs.toml")
@options.of("init")
def command(manifest: str, force: bool) -> int:
    """Write an example manifest with comments to MANIFEST (by default jobs.toml).

    \b
    iccm init
    iccm init icons.toml

    Exit code: 0 done, 2 the file exists or cannot be written.
    """
    from ..errors import InputError
    from ..io import files
    from ..io.batch.starter import starter

    if not manifest.endswith(".toml"):
        raise InputError(f"{manifest}: the manifest is written as TOML; choose a name that ends in .toml")
    files.write_bytes(manifest, starter(manifest).encode(), force=force)
    logs.log.info(f"wrote {manifest}")
    logs.log.info(f"enter your files in it, then run: iccm batch {manifest}")
    return 0
