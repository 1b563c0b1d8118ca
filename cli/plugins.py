"""`iccm plugins`."""

from __future__ import annotations

import click

from ..errors import InputError
from . import logs, options

NEXT = {
    "inkscape": "restart Inkscape: Extensions > Texture",
    "blender": "in Blender: Edit > Preferences > Add-ons, switch iccm on; then UV Editor > sidebar (N) > iccm",
}


@click.command("plugins", cls=options.Command)
@click.argument("action", type=click.Choice(["install", "uninstall", "list"]))
@click.argument("program", type=click.Choice(["inkscape", "blender"]), required=False)
@options.of("plugins")
def command(action: str, program: str | None, to: str | None) -> int:
    """Put iccm into the menus of Inkscape and Blender, or take it out again.

    The plug-in's files go into the program's own folder of extensions, and run iccm by the Python that it is installed
    for: after moving that, install again.

    \b
    iccm plugins install inkscape
    iccm plugins install blender
    iccm plugins install blender --to iccm-blender.zip
    iccm plugins list

    Exit code: 0 done, 2 the program's folder is not found or cannot be written.
    """
    from ..io import plugins

    if action == "list":
        for each in [program] if program else plugins.PROGRAMS:
            for folder in plugins.installed(each, to):
                click.echo(f"{each}\t{folder}\t{plugins.interpreter(folder)}")
        return 0
    if program is None:
        raise InputError(f"plugins {action}: name a program: inkscape or blender")
    if action == "uninstall":
        found = plugins.uninstall(program, to)
        for folder in found:
            logs.log.info(f"removed {folder}")
        if not found:
            logs.log.warning(f"there is no plug-in for {program}")
        return 0
    for path in plugins.install(program, to):
        logs.log.info(f"wrote {path}")
    logs.log.info(NEXT[program])
    return 0
