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
from typing import Any

import numpy as np

from . import jit
from .arrays import Complex
from .parallel import thread_count

SQUARE = np.array([-0.5 - 0.5j, 0.5 - 0.5j, 0.5 + 0.5j, -0.5 + 0.5j])
FAN = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])  # the square and its middle
SMALL = 32  # pixels of a picture that all pixels' kernels are needed for


def _order() -> None:
    """The order of a factorisation's unknowns, and its fronts."""
    from .balanced.minimise.cholesky import system_of

    system_of(FAN, np.roll(np.arange(4), -1), FAN.max() + 1)


def _minimise() -> None:
    """Untangling and Newton's method on four triangles; the energy first, since `_order` is compiled meanwhile."""
    from .balanced.discrete import DiscreteMap
    from .balanced.minimise.cholesky import system_of
    from .balanced.minimise.energy import energy_of
    from .balanced.outline import Outline
    from .balanced.pairs import Pairs
    from .curve import Curve

    z: Complex = np.append(SQUARE, 0)
    energy_of(z, z, FAN)
    outline = Outline.of(Curve(SQUARE), 0.0, 0.0)
    s = outline.curve.knots[:-1]
    corners = np.ones(4, bool)
    pairs = Pairs(s, s.copy(), corners, corners)
    system = system_of(FAN, np.roll(np.arange(4), -1), z.size)
    state = DiscreteMap(outline, outline, FAN, system, z, z, pairs, ~corners)
    state.unfolded().forward(1.0, 1.0, 1, 1e-3, corners=True)


def _mesh() -> None:
    """Triangulating, the nearest points of a curve, and the matches to start from."""
    from .balanced.meshing.mesh import Sizes, triangulate
    from .balanced.starts import elastic_matches
    from .curve import Curve

    triangulate(SQUARE, Sizes.even(0.1))
    Curve(SQUARE).closest(SQUARE)
    next(iter(elastic_matches(Curve(SQUARE), Curve(SQUARE), 0.0)))


def _pixels() -> None:
    """A picture through a map."""
    from .maps.triangulated.map import TriangulatedMap
    from .pixels.warp import Canvas, Texture, warp

    z: Complex = np.append(SQUARE, 0)
    box = complex(SQUARE[0]), complex(SQUARE[2])
    image: Complex = 1.1 * z
    map = TriangulatedMap(z, image, FAN, (np.arange(4),))
    map(z)
    picture = np.full((SMALL, SMALL, 3), 99, np.uint8)
    for size in (2 * SMALL, SMALL // 4):  # enlarged, and shrunk
        warp(map, Texture(picture, box), Canvas(size, size, box), threads=1)


# the longest first, then what it needs, too; one kernel of each, compiled last, tells whether it is there
PARTS: dict[str, tuple[Callable[[], None], str, str]] = {
    "minimise": (_minimise, "balanced.minimise.newton", "descend"),
    "order": (_order, "balanced.minimise.fronts", "_grouped"),
    "pixels": (_pixels, "pixels.filters", "_painted"),
    "mesh": (_mesh, "balanced.meshing.mesh", "_split_chords"),
}


def missing() -> list[str]:
    """The parts that Numba's cache has not, or has of an older source."""
    from importlib import import_module

    return [
        part
        for part, (_, module, name) in PARTS.items()
        if not _cached(getattr(import_module(f".{module}", __package__), name))
    ]


def _cached(kernel: jit.Kernel) -> bool:
    if not hasattr(kernel.entry, "stats"):
        return True  # NUMBA_DISABLE_JIT: nothing is compiled at all
    source = Path(kernel.py_func.__code__.co_filename)
    indices = Path(kernel.entry.stats.cache_path).glob(f"{source.stem}.{kernel.py_func.__name__}-*.nbi")
    newest = max(written for written, _ in jit.STAMP)
    return any(index.stat().st_mtime_ns >= newest for index in indices)


def compile_ahead(threads: int | None = None) -> None:
    """Compiles the parts that are missing: with threads to spare in processes of their own, but for the last ones."""
    parts = missing()
    beside = max(0, min(thread_count(threads), len(parts)) - 1)
    running = [_process(part) for part in parts[:beside]]
    with _nothing_collected():
        for part in parts[beside:]:
            PARTS[part][0]()
    for process in running:
        if process is not None:
            process.wait()


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


def _process(part: str) -> subprocess.Popen | None:
    """A Python that compiles a part; None where it cannot be started: that is compiled when it is needed then."""
    quiet: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    try:
        return subprocess.Popen([sys.executable, "-m", f"{__package__}.ahead", part], **quiet)
    except OSError:
        return None


if __name__ == "__main__":
    if sys.argv[1:]:
        with _nothing_collected():
            PARTS[sys.argv[1]][0]()
    elif missing():
        print("compiling the kernels, which is done once; this may take a minute", flush=True)
        compile_ahead()
