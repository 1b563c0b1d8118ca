"""`iccm info`."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import InputError
from ..progress import tell
from . import logs, options, status
from .options import FILE


@click.command("info", cls=options.Command)
@click.argument("file", type=FILE, nargs=-1)
@options.of("info")
def command(
    file: tuple[str, ...], formats: bool, json: bool, plot: str | None, force: bool, max_faces: int
) -> int:
    """Show how iccm reads each FILE: outlines and ids, pins and strokes, pictures, meshes, constraints, jobs.

    \b
    iccm info body.obj
    iccm info sheet.svg --plot parts.png
    iccm info --formats

    Exit code: 0 done, 2 a file could not be read; the others are shown.
    """
    from json import dumps

    from ..io import files
    from ..io import formats as file_formats
    from ..io.describe import describe, lines
    from ..io.run.report import as_json

    if formats:
        if file or json or plot:
            raise InputError("--formats: lists all formats; leave out files and other options")
        click.echo("\n".join([*file_formats.table(), "", "* is read, but not written"]))
        return 0
    if not file:
        raise click.MissingParameter(param_type="argument", param_hint="FILE")
    if plot:
        file_formats.check_plot(plot)
        if len(file) > 1:
            raise InputError(f"--plot: shows the parts of one file, but {len(file)} files are given")
        files.check_outputs([plot], file, force=force)
    code = 0
    for name in file:
        try:
            with status.show_status():
                tell(f"read {name}")
                facts = describe(name, max_faces=max_faces)
        except InputError as error:
            if len(file) == 1:
                raise
            code = logs.explain(error)
            continue
        click.echo(dumps(as_json(facts), ensure_ascii=False) if json else "\n".join(lines(facts)))
    if plot:
        from ..io import sheet

        with status.show_phases(f"draw {plot}"), files.replacing(plot, force=force) as path:
            sheet.draw(Path(file[0]), path, max_faces=max_faces)
        logs.log.info(f"wrote {plot}")
    return code
