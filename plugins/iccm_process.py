"""Run iccm as a separate process, with the Python that it is installed in.

Host programs bring their own Python and set environment variables for it, which must not reach iccm's Python.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

PYTHON = Path(__file__).with_name("iccm_python.txt")
"""File with the path of iccm's Python, written by `iccm plugins install`."""
THEIRS = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "LD_LIBRARY_PATH", "LD_PRELOAD", "DYLD_LIBRARY_PATH")
AGAIN = "run `iccm plugins install {program}` again"


class Failed(Exception):
    """iccm cannot be run, or reported an error; the message is for the user."""


def python(program: str) -> str:
    """Return the path of iccm's Python, as the installation wrote it.

    Raises:
        Failed: the path was not written, or the file does not exist any more.
    """
    found = PYTHON.read_text(encoding="utf-8").strip() if PYTHON.is_file() else ""
    if not found or not os.path.isfile(found):
        raise Failed(f"cannot find iccm{f' at {found}' if found else ''}; {AGAIN.format(program=program)}")
    return found


def start(interpreter: str, arguments: list[str], folder: str, log: str) -> subprocess.Popen:
    """Start a process `iccm ARGUMENTS` in a folder, with its messages written to the file `log`."""
    environment = {name: value for name, value in os.environ.items() if name not in THEIRS}
    command = [interpreter, "-c", "from iccm.__main__ import main; main()", *arguments]
    flags = {"creationflags": 0x08000000} if sys.platform == "win32" else {}  # no console window
    with open(log, "wb") as messages:
        try:
            return subprocess.Popen(
                command,
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=messages,
                **flags,
            )
        except OSError as error:
            raise Failed(f"{interpreter}: {error.strerror}") from error


def messages(log: str) -> tuple[list[str], list[str]]:
    """Return the errors and warnings that were logged with `--log-format json`."""
    errors, notes = [], []
    for line in Path(log).read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            record = json.loads(line)
        except ValueError:
            errors.append(line.removeprefix("error: ").partition(" (run `")[0])
            continue
        if record.get("level") in ("error", "critical"):
            errors.append(record["message"])
        elif record.get("level") == "warning":
            notes.append(record["message"])
    return errors, notes
