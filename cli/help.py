"""`iccm help`."""

from __future__ import annotations

import click

from . import options


@click.command("help", cls=options.Command)
@click.argument("name", metavar="[COMMAND]", required=False)
@click.argument("topic", required=False)
@options.of("help")
@click.pass_context
def command(ctx: click.Context, name: str | None, topic: str | None) -> int:
    """Show help for all commands, for one command, or for one of its topics.

    \b
    iccm help
    iccm help map
    iccm help map texture

    Exit code: 0 done, 2 unknown command or topic.
    """
    from . import iccm

    words = [*([name] if name else []), *(["--help", topic] if topic else ["--help"])]
    return int(iccm.main(words, prog_name="iccm", standalone_mode=False) or 0)
