"""`iccm completion`."""

from __future__ import annotations

import os
from pathlib import Path

import click

from ..errors import InputError
from . import logs, options

SHELLS = ("bash", "zsh", "fish")


@click.command("completion", cls=options.Command)
@click.argument("action", type=click.Choice(["install"]))
@options.of("completion")
def command(action: str, shell: str | None) -> int:
    """Let the shell complete commands, options and files.

    bash and fish find the script by themselves. zsh is told of it by a line at the end of .zshrc, once; nothing else
    in that file changes.

    \b
    iccm completion install
    iccm completion install --shell zsh

    Exit code: 0 done, 2 the shell is none of bash, zsh and fish, or its folder cannot be written.
    """
    from ..io import files

    shell = shell or Path(os.environ.get("SHELL", "")).name
    if shell not in SHELLS:
        raise InputError(
            f"{shell or 'the shell'}: no shell that iccm knows; name one: --shell {'|'.join(SHELLS)}"
        )
    script = _script(shell)
    path = _place(shell)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_file() and path.read_text(encoding="utf-8") == script:
        logs.log.info(f"{path}: is there already")
    else:
        files.write_bytes(path, script.encode(), force=True)
        logs.log.info(f"wrote {path}")
    if shell == "zsh":
        _name_in_zshrc(path)
    also = ", where the package bash-completion is installed" if shell == "bash" else ""
    logs.log.info(f"a new {shell} completes iccm{also}")
    return 0


def _script(shell: str) -> str:
    """What click has for a shell."""
    from click.shell_completion import get_completion_class

    from . import iccm

    made = get_completion_class(shell)
    assert made is not None
    return made(iccm, {}, "iccm", "_ICCM_COMPLETE").source()


def _place(shell: str) -> Path:
    """Where a shell looks for a user's completions; for zsh a place that its start file names."""
    home = Path.home()
    data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    if shell == "fish":
        settings = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config")
        return settings / "fish" / "completions" / "iccm.fish"
    if shell == "zsh":
        return data / "iccm" / "completion.zsh"
    return (
        Path(os.environ.get("BASH_COMPLETION_USER_DIR") or data / "bash-completion") / "completions" / "iccm"
    )


def _name_in_zshrc(script: Path) -> None:
    """Add the line that reads the script to the end of .zshrc, unless it is there; what is there stays as it is."""
    from shlex import quote

    path = Path(os.environ.get("ZDOTDIR") or Path.home()) / ".zshrc"
    ready = "(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }"
    line = f"{ready}; source {quote(str(script))}".encode()
    before = path.read_bytes() if path.exists() else b""
    if line in before.splitlines():
        logs.log.info(f"{path}: names it already")
        return
    with open(path, "ab") as file:
        file.write((b"" if before.endswith(b"\n") or not before else b"\n") + line + b"\n")
    logs.log.info(f"added a line to {path}")
