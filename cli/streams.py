"""The streams and the memory that a process is started with: daemons and cron close streams.

Closed streams are replaced by ones that lead nowhere: a file that is opened would take the free number, and what a
library prints would end in a picture.
"""

import os
import select
import sys
from contextlib import suppress

LEAST = 5 << 28
"""Bytes of addresses without which libraries end the process: as they are loaded, or write a picture."""
STREAMS = ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w"))


def mend() -> None:
    """Give the process the streams that it was started without."""
    for number, name, mode in STREAMS:
        if getattr(sys, name) is not None:
            continue
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
        setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def unread() -> bool:
    """Whether the reader of stdout went away, as is otherwise learnt from the next line only."""
    if not hasattr(select, "poll"):  # Windows
        return False
    output = select.poll()
    output.register(1, 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in output.poll(0))


def lacks_memory() -> bool:
    """Whether the process may have too few addresses (`ulimit -v`) to begin."""
    with suppress(ImportError):  # Windows has no such limits
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_AS)
        return soft != resource.RLIM_INFINITY and soft < LEAST
    return False
