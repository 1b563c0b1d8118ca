"""`iccm completion`."""

from __future__ import annotations

import os
from pathlib import Path
from shlex import quote

import click

from ..errors import InputError
from . import logs, options

SHELLS = ("bash", "zsh", "fish")


@click.command("completion", cls=options.Command)
@click.argument("action", type=click.Choice(["install", *SHELLS]))
@options.of("completion")
def command(action: str, shell: str | None) -> int:
    """Set up completion of commands, options and files in the shell.

    `install` writes the completion script where fish finds it, or adds one line that loads it to the end of .bashrc or
    .zshrc, once. With the name of a shell, the script is printed.

    \b
    iccm completion install
    iccm completion install --shell zsh
    iccm completion fish > ~/.config/fish/completions/iccm.fish

    Exit code: 0 done, 2 the shell is not bash, zsh or fish, or its folder cannot be written.
    """
    from ..io import files

    if action != "install":
        if shell is not None:
            raise InputError(f"--shell: only applies to install; {action} prints the script of {action}")
        click.echo(_script(action))
        return 0

    shell = shell or Path(os.environ.get("SHELL", "")).name
    if shell not in SHELLS:
        raise InputError(
            f"{shell or 'the shell'}: iccm has no completion for this shell; choose one with --shell "
            f"{'|'.join(SHELLS)}"
        )
    script = _script(shell)
    path = _place(shell)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_file() and path.read_text(encoding="utf-8") == script:
        logs.log.info(f"{path}: already installed")
    else:
        files.write_bytes(path, script.encode(), force=True)
        logs.log.info(f"wrote {path}")
    if shell != "fish":
        _name_in_settings(shell, path)
    logs.log.info(f"open a new {shell} to complete iccm commands")
    return 0


def _script(shell: str) -> str:
    """Return the completion script that click generates for a shell."""
    from click.shell_completion import get_completion_class

    from . import iccm

    shell_class = get_completion_class(shell)
    assert shell_class is not None
    return shell_class(iccm, {}, "iccm", "_ICCM_COMPLETE").source()


def _place(shell: str) -> Path:
    """Return the path where fish looks for a user's completions; for bash and zsh the path that their settings load."""
    home = Path.home()
    if shell == "fish":
        settings = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config")
        return settings / "fish" / "completions" / "iccm.fish"
    data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    return data / "iccm" / f"completion.{shell}"


def _name_in_settings(shell: str, script: Path) -> None:
    """Append the line that loads the script to .bashrc or .zshrc, unless it is there. Other lines stay unchanged."""
    folder = os.environ.get("ZDOTDIR") if shell == "zsh" else None
    path = Path(folder or Path.home()) / f".{shell}rc"
    ready = "(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }; " if shell == "zsh" else ""
    line = f"{ready}source {quote(str(script))}".encode()
    content = path.read_bytes() if path.exists() else b""
    if line in content.splitlines():
        logs.log.info(f"{path}: already loads the completion")
        return
    with open(path, "ab") as file:
        file.write((b"" if content.endswith(b"\n") or not content else b"\n") + line + b"\n")
    logs.log.info(f"{path}: added a line that loads the completion")
