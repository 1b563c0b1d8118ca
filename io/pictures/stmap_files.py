"""STMap files; see `iccm.pixels.stmap` for the convention."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Box, Real
from ...errors import InputError
from ...memory import Memory
from ...pixels import stmap
from ...pixels.canvas import BAND_ROWS, Canvas
from ...pixels.sampler import Sampler
from ...pixels.texture import Placing
from ...pixels.warp import BYTES_PER_PIXEL, Warp
from .. import formats, limits
from . import image_files

TILE_EDGE_SHARE = 1e-4
"""Distance from a tile's edge, as a share of its size, within which a point may belong to either tile: a tenth of a
texel of 1024."""
_SAID = "STMap: R = s from the left, G = t from the bottom, 0..1; A = coverage"


def write(
    path: str | Path,
    map,
    box: Box,
    canvas: Canvas,
    *,
    placing: Placing | None = None,
    room: Memory | None = None,
    threads: int | None = None,
) -> bool:
    """Write a map as a float STMap (.exr or .tif), row by row as it is computed; return whether it covers any pixel.

    Args:
        path: the file.
        map: source → target.
        box: the part of the source's plane that textures will cover.
        canvas: the raster, in the target's plane.
        placing: as for `stmap.stmap`.
        room: limits the number of threads by memory.
        threads: number of threads.

    Raises:
        InputError: the suffix's format does not support floats, or the file cannot be written.
    """
    check(path)
    bytes_per_band, purpose = band_bytes(canvas.width), f"rows of {canvas.width} pixels"
    threads = (room or Memory()).threads(threads, bytes_per_band, purpose)
    covered = False

    def rows() -> Iterator[NDArray]:
        nonlocal covered
        for block in stmap.stmap(map, box, canvas, placing=placing, threads=threads):
            covered = covered or bool(block[..., 3].any())
            yield block

    image_files.write_bands(path, _like(), canvas.height, canvas.width, rows())
    return covered


def write_whole(path: str | Path, st: NDArray[np.float32]) -> None:
    """Write (h, w, 4) s, t, 0 and coverage; errors as for `write`."""
    check(path)
    height, width = st.shape[:2]
    image_files.write_bands(path, _like(), height, width, [st])


def is_own(image: image_files.Image) -> bool:
    """Return whether a picture's metadata says that it is an STMap written by iccm."""
    return image.metadata.get("ImageDescription") == ("string", _SAID)


def _like() -> image_files.Image:
    metadata = {"ImageDescription": ("string", _SAID)}
    return image_files.Image(np.zeros((1, 1, 4), np.float32), 3, True, "data", metadata)


def band_bytes(width: int) -> int:
    """Return the working memory in bytes with which a thread makes a band of an STMap."""
    return width * BAND_ROWS * BYTES_PER_PIXEL


def check(path: str | Path) -> None:
    """Refuse a suffix whose format does not support floats."""
    formats.check(path, "stmap", "an STMap needs floats")


def read(path: str | Path, *, max_pixels: int = limits.READ_PIXELS, room: Memory | None = None) -> NDArray:
    """Return the (h, w, c) floats of an STMap.

    Raises:
        InputError: the file cannot be read, has fewer than two channels, or no floats.
    """
    image = image_files.read(path, max_pixels=max_pixels, room=room)
    if image.pixels.shape[2] < 2 or image.pixels.dtype.kind != "f":
        raise InputError(
            f"{path}: not an STMap: it has {image.pixels.shape[2]} channels of {image.pixels.dtype}, but "
            "needs at least 2 channels of floats"
        )
    return image.pixels


def _is_set(st: NDArray) -> NDArray[np.bool_]:
    """Mark the pixels (h, w) of an STMap that have a place in a picture."""
    is_finite: NDArray[np.bool_] = np.isfinite(st[..., :2]).all(axis=-1)
    return is_finite & (st[..., 3] > 0 if st.shape[2] > 3 else (st[..., :2] != 0).any(axis=-1))


def places(st: NDArray) -> Real:
    """Return (p, 2) s and t of an STMap's pixels, except those on the edge of a tile, which may belong to either."""
    st_of_pixels = st[_is_set(st)][:, :2].astype(float)
    return st_of_pixels[(np.abs(st_of_pixels - np.round(st_of_pixels)) > TILE_EDGE_SHARE).all(axis=1)]


def apply(
    st: NDArray,
    image: image_files.Image,
    path: str | Path,
    *,
    tiles: Box | None = None,
    filter: str = "auto",
    kind: str = "colour",
    edge: str = "clamp",
    room: Memory | None = None,
    threads: int | None = None,
) -> str:
    """Write a picture warped by an STMap, row by row as it is computed.

    `tiles` is the range of s and t that the picture covers, by default 0..1, and `room` limits memory. The other
    arguments are those of `iccm.pixels.warp.warp`.

    Returns:
        Why nothing of the picture is seen; empty if something is.
    """
    from dataclasses import replace

    height, width = image.pixels.shape[:2]
    low, high = tiles or (0j, 1 + 1j)
    aspect = width / (high - low).real / (height / (high - low).imag)
    stored = stmap.Stored(st, aspect)
    box = complex(low.real * aspect, low.imag), complex(high.real * aspect, high.imag)
    image_files.check(path, image.covered(), *st.shape[:2])
    texture = image.texture(box, kind=kind, room=room)
    sampler = Sampler(texture, filter, kind, edge, memory=room, threads=threads)
    work = Warp(stored, sampler, stored.canvas)

    is_transparent = work.alpha >= 0

    def blocks():
        nonlocal is_transparent
        for block in work.blocks(threads):
            is_transparent = is_transparent and not block[..., work.alpha].any()
            yield image.with_pixels(block, work.alpha).pixels

    image_files.write_bands(path, replace(image, alpha=work.alpha), st.shape[0], st.shape[1], blocks())
    if fault := _fault(st, low, high, repeats=edge in ("repeat", "mirror")):
        return fault
    return "the picture is transparent wherever it is shown" if is_transparent else ""


def _fault(st: NDArray, low: complex, high: complex, *, repeats: bool) -> str:
    """Return why an STMap shows nothing of a picture from `low` to `high`; empty if it shows something.

    Such maps come from programs that failed, or are in pixels.
    """
    set_places = st[_is_set(st)][:, :2]
    if not set_places.size:
        return "none of its pixels has a place in a picture: all are NaN, zero or uncovered"
    if st.shape[0] * st.shape[1] > 1 and (set_places == set_places[0]).all():
        return "all of its pixels have the same place in a picture"
    s, t = set_places.T
    is_inside = (low.real <= s) & (s <= high.real) & (low.imag <= t) & (t <= high.imag)
    if not repeats and not is_inside.any():
        return "all of its pixels have their places outside of the picture"
    return ""
