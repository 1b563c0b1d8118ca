"""`iccm plugins`."""

from __future__ import annotations

import click

from ..errors import InputError
from . import logs, options

NEXT = {
    "inkscape": "restart Inkscape, then open Extensions > Texture",
    "blender": "in Blender, enable iccm under Edit > Preferences > Add-ons; its panel is in the UV "
    "Editor's sidebar (N)",
    "figma": "in Figma's desktop app, choose Plugins > Development > Import plugin from manifest, and manifest.json",
}


@click.command("plugins", cls=options.Command)
@click.argument("action", type=click.Choice(["install", "uninstall", "list"]))
@click.argument("program", type=click.Choice(["inkscape", "blender", "figma"]), required=False)
@options.of("plugins")
def command(action: str, program: str | None, to: str | None) -> int:
    """Install, remove or list the plug-ins for Inkscape, Blender and Figma.

    The plug-in is copied into the program's folder of extensions and runs iccm with the Python that iccm is now
    installed in. Install it again after moving that Python. The plug-in for Figma runs without Python; it is written
    to a folder, from which Figma imports it.

    \b
    iccm plugins install inkscape
    iccm plugins install blender
    iccm plugins install blender --to iccm-blender.zip
    iccm plugins install figma --to FOLDER
    iccm plugins list

    Exit code: 0 done, 2 the program's folder is not found or cannot be written.
    """
    from ..io import plugins

    if action == "list":
        for name in [program] if program else plugins.PROGRAMS:
            for folder in plugins.installed(name, to):
                click.echo(f"{name}\t{folder}\t{plugins.interpreter(folder)}")
        return 0
    if program is None:
        raise InputError(f"plugins {action}: choose a program: inkscape, blender or figma")
    if action == "uninstall":
        folders = plugins.uninstall(program, to)
        for folder in folders:
            logs.log.info(f"removed {folder}")
        if not folders:
            logs.log.warning(f"no plug-in for {program} is installed")
        return 0
    for path in plugins.install(program, to):
        logs.log.info(f"wrote {path}")
    logs.log.info(NEXT[program])
    return 0
