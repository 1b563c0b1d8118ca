"""The kernels of common jobs, compiled side by side in processes before a job asks for them one after the other.

A part is a small piece of work that calls its kernels with the types that jobs call them with. What a process compiles
another one finds in Numba's cache. Run as a module, this compiles what has not been compiled yet and says so.
"""

import gc
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from . import jit
from .parallel import thread_count


class Part(NamedTuple):
    """Kernels that are compiled one after the other.

    Attributes:
        work: what calls them.
        module: of the kernel that is compiled last: it tells whether all of them are there.
        kernel: its name.
        seconds: that compiling takes.
    """

    work: Callable[[], None]
    module: str
    kernel: str
    seconds: float


PARTS: dict[str, Part] = {}  # the compiled core has all kernels


def missing() -> list[str]:
    """The parts that Numba's cache has not, or has of an older source."""
    from importlib import import_module

    return [
        part
        for part, (_, module, kernel, _) in PARTS.items()
        if not _cached(getattr(import_module(f".{module}", __package__), kernel))
    ]


def _cached(kernel: jit.Kernel) -> bool:
    if not hasattr(kernel.entry, "stats"):
        return True  # NUMBA_DISABLE_JIT: nothing is compiled at all
    source = Path(kernel.py_func.__code__.co_filename)
    indices = Path(kernel.entry.stats.cache_path).glob(f"{source.stem}.{kernel.py_func.__name__}-*.nbi")
    newest = max(written for written, _ in jit.STAMP)
    return any(index.stat().st_mtime_ns >= newest for index in indices)


def compile_ahead(threads: int | None = None) -> None:
    """Compiles the parts that are missing: with threads to spare side by side, all but one share in other processes."""
    parts = missing()
    if not parts:
        return
    *others, own = _shares(parts, min(thread_count(threads), len(parts)))
    running = [_process(share) for share in others]
    _compile(own)
    for process in running:
        if process is not None:
            process.wait()


def _shares(parts: list[str], count: int) -> list[list[str]]:
    """Parts in shares that take about as long as each other, the longest last."""
    shares: list[list[str]] = [[] for _ in range(count)]
    for part in sorted(parts, key=lambda part: -PARTS[part].seconds):
        min(shares, key=_seconds).append(part)
    return [sorted(share, key=list(PARTS).index) for share in sorted(shares, key=_seconds)]


def _seconds(parts: list[str]) -> float:
    return sum(PARTS[part].seconds for part in parts)


def _compile(parts: list[str]) -> None:
    with _nothing_collected():
        for part in parts:
            PARTS[part].work()


@contextmanager
def _nothing_collected() -> Iterator[None]:
    """The garbage collector takes a tenth of the compiler's time, and finds little."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _process(parts: list[str]) -> subprocess.Popen | None:
    """A Python that compiles parts; None where it cannot be started: they are compiled when they are needed then."""
    quiet: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    try:
        return subprocess.Popen([sys.executable, "-m", f"{__package__}.ahead", *parts], **quiet)
    except OSError:
        return None


if __name__ == "__main__":
    if sys.argv[1:]:
        _compile(sys.argv[1:])
    elif missing():
        print("compiling the kernels, which is done once; this may take a minute", flush=True)
        compile_ahead()
