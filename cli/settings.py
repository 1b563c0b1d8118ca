"""Limits for all commands: from environment variables (ICCM_MAX_PIXELS, …) or a configuration file.

Options on the command line have precedence over the environment, which has precedence over the file: `[limits]` in
`iccm/config.toml`, in `$XDG_CONFIG_HOME` or `~/.config` (`%APPDATA%` on Windows), or the file in `ICCM_CONFIG`.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..io.options import TABLE, Option, options_of

FILE_VARIABLE = "ICCM_CONFIG"
LIMITS = tuple(
    dict.fromkeys(
        name
        for table in TABLE
        for name, (_, option) in options_of(table).items()
        if option.topic == "limits" and name not in ("resume", "dask")
    )
)
"""The options that may be set for all commands, each once."""


def defaults(rows: Mapping[str, Option]) -> dict[str, str]:
    """Return the limits that are set for a command, as text by option name.

    Args:
        rows: the options of the command.

    Raises:
        InputError: the file cannot be read, or contains other settings.
    """
    limits = _from_file() | _from_environment()
    return {name: value for name, value in limits.items() if name in rows}


def _from_environment() -> dict[str, str]:
    return {name: os.environ[variable(name)] for name in LIMITS if os.environ.get(variable(name))}


def variable(name: str) -> str:
    """Return the name of the environment variable for a limit."""
    return f"ICCM_{name.upper()}"


def path() -> Path:
    """Return the path of the configuration file."""
    if name := os.environ.get(FILE_VARIABLE):
        return Path(name)
    home = os.environ.get("APPDATA" if os.name == "nt" else "XDG_CONFIG_HOME")
    return (Path(home) if home else Path.home() / ".config") / "iccm" / "config.toml"


def _from_file() -> dict[str, str]:
    place = path()
    try:
        content: dict[str, Any] = tomllib.loads(place.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        if os.environ.get(FILE_VARIABLE):
            raise InputError(
                f"{place}: no such file; check the variable {FILE_VARIABLE}, which names it"
            ) from None
        return {}
    except OSError as error:
        raise InputError(f"{place}: cannot read this file: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{place}: not valid TOML: {str(error).splitlines()[0]}") from None
    limits = content.get("limits", {})
    unknown = [key for key in content if key != "limits"]
    unknown += [key for key in limits if key not in LIMITS] if isinstance(limits, dict) else ["limits"]
    if unknown:
        allowed = ", ".join(LIMITS)
        raise InputError(
            f"{place}: {unknown[0]}: unknown key; the file takes one table, [limits], with {allowed}"
        )
    return {key: str(value) for key, value in limits.items()}
