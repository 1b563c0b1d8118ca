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

    `install` writes the completion script to the place where the shell looks for it. fish finds it automatically, as
    does bash with the package bash-completion; for zsh, one line is added to the end of .zshrc, once. With the name of
    a shell, the script is printed.

    \b
    iccm completion install
    iccm completion install --shell zsh
    iccm completion bash > ~/.local/share/bash-completion/completions/iccm

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
    if shell == "zsh":
        _name_in_zshrc(path)
    logs.log.info(f"open a new {shell} to complete iccm commands")
    if shell == "bash":
        logs.log.info(f"if it does not, add this line to ~/.bashrc: source {quote(str(path))}")
    return 0


def _script(shell: str) -> str:
    """Return the completion script that click generates for a shell."""
    from click.shell_completion import get_completion_class

    from . import iccm

    shell_class = get_completion_class(shell)
    assert shell_class is not None
    return shell_class(iccm, {}, "iccm", "_ICCM_COMPLETE").source()


def _place(shell: str) -> Path:
    """Return the path where a shell looks for a user's completions; for zsh the path that .zshrc loads."""
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
    """Append the line that loads the script to .zshrc, unless it is already there. Other lines stay unchanged."""
    path = Path(os.environ.get("ZDOTDIR") or Path.home()) / ".zshrc"
    ready = "(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }"
    line = f"{ready}; source {quote(str(script))}".encode()
    content = path.read_bytes() if path.exists() else b""
    if line in content.splitlines():
        logs.log.info(f"{path}: already loads the completion")
        return
    with open(path, "ab") as file:
        file.write((b"" if content.endswith(b"\n") or not content else b"\n") + line + b"\n")
    logs.log.info(f"{path}: added a line that loads the completion")
