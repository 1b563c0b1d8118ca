"""The command line. A command's module is only imported when the command is used, so that help is instant.

map       `iccm map`
deform    `iccm deform`
morph     `iccm morph`
apply     `iccm apply`
compose   `iccm compose`
cartogram  `iccm cartogram`
field     `iccm field`
edit      `iccm edit`
flatten   `iccm flatten`
relayout  `iccm relayout`
batch     `iccm batch`
standardize  `iccm standardize`
init      `iccm init`
check     `iccm check`
info      `iccm info`
doctor    `iccm doctor`
completion  `iccm completion`
plugins   `iccm plugins`
help      `iccm help`
settings  limits from the environment and from a configuration file
options   click's arguments and options, made from `iccm.io.options`
logs      messages on stderr; failures as one line and an exit code
status    the status line
process   standard streams; stopping within two seconds of a signal
"""

from __future__ import annotations

import gc
import os
import shlex
import sys
from collections.abc import Callable
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import click

from .. import __version__
from ..errors import InputError
from ..io import extensions
from . import logs, process
from .logs import EXIT_INPUT, Unread, explain

COMMANDS = {
    "map": "Map one shape onto another and carry a texture through the map.",
    "deform": "Deform a shape and its texture with pins and strokes.",
    "morph": "Animate one shape into another.",
    "apply": "Carry pictures, drawings, points, lines and polygons through a saved map.",
    "compose": "Compose saved maps, or invert one.",
    "cartogram": "Write a map in which areas are in proportion to a value, such as population.",
    "field": "Write saved maps as displacement fields, arrays for OpenCV, or pictures for compositors.",
    "edit": "Place pins and strokes in the browser and watch the map follow.",
    "flatten": "Flatten a mesh patch into the plane.",
    "relayout": "Carry textures from one UV layout of a mesh to another.",
    "batch": "Run many jobs, from a pattern of files or a manifest.",
    "standardize": "Map specimens with landmarks onto their mean shape, and summarise their pictures.",
    "init": "Write an example manifest to start from.",
    "check": "Compare results with stored baselines, for CI.",
    "info": "Show how iccm reads a file.",
    "doctor": "Check that iccm is installed correctly.",
    "completion": "Set up completion of commands, options and files in the shell.",
    "plugins": "Install the plug-ins for Inkscape and Blender.",
    "help": "Show help for a command or one of its topics.",
}


class Commands(click.Group):
    """A group that lists its commands with one-line descriptions without importing them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in the order of the table, then those of extensions."""
        return [*COMMANDS, *extensions.commands()]

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """Import and return the command that is used."""
        if name not in COMMANDS:
            command = extensions.command_of(name)
            if command is not None and not isinstance(command, click.Command):
                raise InputError(
                    f"{name}: the extension names a {type(command).__name__}, not a command of click"
                )
            return command
        return import_module(f".{name}", __package__).command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the options before the name of the command; those of commands are refused there."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            raise click.UsageError(
                f"No such option {error.option_name}; options follow the command", ctx
            ) from None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is named first; for an unknown name, suggest what was probably meant."""
        name = args[0]
        if name in COMMANDS or name in extensions.commands():
            return super().resolve_command(ctx, args)
        if Path(name).suffix and not Path(name).is_dir():
            files = [argument for argument in args if argument not in COMMANDS]
            raise click.UsageError(
                f"{name}: not a command; to map this file, run: iccm map {shlex.join(files)}", ctx
            )
        similar = get_close_matches(name, COMMANDS, 1)
        hint = f"did you mean {similar[0]!r}?" if similar else f"choose one of {', '.join(COMMANDS)}"
        raise click.UsageError(f"No such command {name!r}; {hint}", ctx)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a closed stdout has its own exit code."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError as error:
            raise Unread from error

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the table of commands, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))
        if added := extensions.commands():
            with formatter.section("Commands of extensions"):
                formatter.write_dl([(name, f"From the package {origin}.") for name, origin in added.items()])


@click.group(
    cls=Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="iccm")
@click.pass_context
def iccm(ctx: click.Context) -> int:
    """Texture transfer between planar shapes by (quasi-)conformal maps.

    \b
    Example:  iccm map rose.svg leaf.svg --texture petals.jpg -o rose-leaf.png
    Help:     iccm map --help
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help(), err=True)
    return EXIT_INPUT


def main(arguments: list[str] | None = None, started: Callable[[], object] | None = None) -> NoReturn:
    """Run the command line, and raise SystemExit with its exit code.

    `started` is called as soon as errors are reported properly. Garbage collection is disabled: it takes a tenth of a
    small job's time, while a job leaves only a thousand objects in reference cycles.
    """
    gc.disable()
    # otherwise pydantic looks for plug-ins in every installed package
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # Linear algebra uses a single thread anyway (`iccm.blas`); others would still be started, and wait busily for a
    # while.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    process.mend()
    logs.reset()
    if process.lacks_memory():
        sys.exit(explain(MemoryError()))
    logs.silence_others()
    sys.exit(run(arguments, started))


def run(arguments: list[str] | None = None, started: Callable[[], object] | None = None) -> int:
    """Run a command line and return its exit code; all errors are reported in one line on stderr.

    `started` is called as soon as that is ensured.
    """
    logs.reset()
    try:
        if started is not None:
            started()
        with process.watch_signals(), logs.raise_on_signals():
            code = iccm.main(arguments, prog_name="iccm", standalone_mode=False)
            sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except BaseException as error:
        return explain(error)
