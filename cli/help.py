"""`iccm help`."""

from __future__ import annotations

import click

from ..io.option_groups import TOPICS
from . import options


def _names(ctx: click.Context, parameter: click.Parameter, start: str) -> list[str]:
    """Complete the name of a command or a topic."""
    from . import COMMANDS

    return [name for name in (*COMMANDS, *TOPICS) if name.startswith(start)]


def _topics(ctx: click.Context, parameter: click.Parameter, start: str) -> list[str]:
    """Complete the name of a topic."""
    return [name for name in TOPICS if name.startswith(start)]


@click.command("help", cls=options.Command)
@click.argument("name", metavar="[COMMAND]", required=False, shell_complete=_names)
@click.argument("topic", required=False, shell_complete=_topics)
@options.of("help")
@click.pass_context
def command(ctx: click.Context, name: str | None, topic: str | None) -> int:
    """Show help for all commands, for one command, or for one of its topics; a topic alone is that of `iccm map`.

    \b
    iccm help
    iccm help map
    iccm help deform texture
    iccm help constraints

    Exit code: 0 done, 2 unknown command or topic.
    """
    from . import COMMANDS, iccm

    if name in TOPICS and name not in COMMANDS:
        name, topic = "map", name
    words = [*([name] if name else []), *(["--help", topic] if topic else ["--help"])]
    return int(iccm.main(words, prog_name="iccm", standalone_mode=False) or 0)
