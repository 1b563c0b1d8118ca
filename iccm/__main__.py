"""Start the command line: `iccm`, and `python -m iccm`."""

import os
import signal
import sys
from contextlib import suppress
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line. An interrupt ends it without a traceback, also while modules are imported."""
    usual = signal.getsignal(signal.SIGINT)
    # background jobs of a shell ignore interrupts
    if usual is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    from .cli import main as run

    try:
        run(started=lambda: signal.signal(signal.SIGINT, usual))
    except SystemExit as ended:
        if "iccm.cli.batch" in sys.modules:
            raise
        _end(ended.code)


def _end(code: int | str | None) -> NoReturn:
    """End the process at once, with an exit code.

    Everything is written and closed by then. Python would otherwise tear down all modules and libraries, which
    takes a quarter of a second; only a batch, which has worker processes to end, needs that. The function is
    here and not in `iccm.cli.main`, so that tests and programs that call the latter get a SystemExit.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(code if isinstance(code, int) else 1)


def _leave(number: int, frame: object) -> NoReturn:
    """End the process at once; nothing has begun."""
    os._exit(128 + number)


if __name__ == "__main__":
    main()
