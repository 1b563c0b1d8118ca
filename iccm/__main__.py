"""Start the command line: `iccm`, and `python -m iccm`."""

import os
import signal
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line, which an interrupt ends without a traceback, also while it is imported."""
    usual = signal.getsignal(signal.SIGINT)
    # in the background of a shell interrupts are ignored
    if usual is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    from .cli import main as run

    run(started=lambda: signal.signal(signal.SIGINT, usual))


def _leave(number: int, frame: object) -> NoReturn:
    """End at once: nothing has begun."""
    os._exit(128 + number)


if __name__ == "__main__":
    main()
