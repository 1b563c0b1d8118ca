"""UDIM tiles: pictures named `name.<UDIM>.png`, one for each unit square of the texture coordinates.

The tile with lower left corner u, v has the number 1001 + u + 10 v, with u from 0 to 9.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Box, Real
from ...errors import InputError, first_names
from ...memory import Memory
from .. import limits

if TYPE_CHECKING:
    from .image import Image

MARK = "<UDIM>"
TILES_PER_ROW = 10  # by the UDIM convention: tiles are 1001 + column + 10 row


def is_pattern(name: str | Path | bytes | None) -> bool:
    """Return whether a name is a pattern for the pictures of all tiles."""
    return isinstance(name, str | Path) and MARK in str(name)


def number_of(tile: complex) -> int | None:
    """Return the number of the tile with this lower left corner; None if it is outside the numbered range."""
    number = 1001 + int(tile.real) + TILES_PER_ROW * int(tile.imag)
    return number if 0 <= tile.real < TILES_PER_ROW and tile.imag >= 0 and number <= limits.TILE else None


def name_of(pattern: str, number: int) -> str:
    """Return the file name of a tile."""
    return pattern.replace(MARK, str(number))


def name_at(pattern: str, tile: complex, mesh: str) -> str:
    """Return the file name of the tile with this lower left corner, which contains faces of a mesh.

    Raises:
        InputError: it is outside the numbered range.
    """
    number = number_of(tile)
    if number is None:
        raise InputError(
            f"{mesh}: some faces lie at u {tile.real:g}, v {tile.imag:g}, outside the "
            "numbered tiles (UDIM); move them to u and v from 0 to 10"
        )
    return name_of(pattern, number)


def all_of(uv: Real) -> list[complex]:
    """Return the tiles that contain points (p, 2) of the layout, row by row."""
    return sorted((complex(u, v) for u, v in np.unique(np.floor(uv), axis=0)), key=lambda z: (z.imag, z.real))


def files_of(pattern: str | Path) -> list[str]:
    """Return the existing files of a pattern, ordered by tile."""
    path = Path(pattern)
    prefix, _, suffix = path.name.partition(MARK)
    if not path.parent.is_dir():
        return []
    names = [entry.name for entry in path.parent.iterdir() if entry.name.startswith(prefix)]
    middle = [name[len(prefix) : len(name) - len(suffix)] for name in names if name.endswith(suffix)]
    numbers = sorted({int(word) for word in middle if word.isdecimal() and 1001 <= int(word) <= limits.TILE})
    return [str(path.with_name(prefix + str(number) + suffix)) for number in numbers]


def number_in(pattern: str, name: str) -> int:
    """Return the tile number in the name of a pattern's file."""
    prefix, _, suffix = Path(pattern).name.partition(MARK)
    return int(Path(name).name[len(prefix) :].removesuffix(suffix))


@dataclass(frozen=True, eq=False)
class TiledImage:
    """The pictures of several tiles as one.

    Attributes:
        image: the picture, empty at tiles without one.
        box: the range of texture coordinates that it covers.
    """

    image: Image
    box: Box


def read(
    pattern: str | Path,
    tiles: Iterable[complex],
    *,
    max_pixels: int = limits.READ_PIXELS,
    colorspace: str | None = None,
    room: Memory | None = None,
) -> TiledImage:
    """Read the pictures of tiles as one, given the tiles' lower left corners; missing ones are noted.

    Args:
        pattern: file name that contains `<UDIM>`.
        tiles: tiles that are used.
        max_pixels: limit for all together.
        colorspace, room: as for `image_files.read`.

    Raises:
        InputError: there is no file, or they are incompatible or too large.
    """
    from . import image_files

    corners = sorted(set(tiles), key=lambda tile: (tile.imag, tile.real))
    paths = {tile: name_of(str(pattern), n) for tile in corners if (n := number_of(tile)) is not None}
    present = {tile: name for tile, name in paths.items() if Path(name).is_file()}
    if not present:
        listed = ", ".join(str(number_of(tile) or f"({tile.real:g}, {tile.imag:g})") for tile in corners[:8])
        raise InputError(f"{pattern}: no file for any tile of the mesh: {listed}")
    options: dict[str, Any] = {"max_pixels": max_pixels, "colorspace": colorspace, "room": room}
    images = {tile: image_files.read(name, **options) for tile, name in present.items()}
    first = next(iter(images.values()))
    height, width = (max(image.pixels.shape[k] for image in images.values()) for k in range(2))
    u, v = (np.array([getattr(tile, part) for tile in images], int) for part in ("real", "imag"))
    low, high = complex(u.min(), v.min()), complex(u.max() + 1, v.max() + 1)
    columns, rows = int((high - low).real), int((high - low).imag)
    if columns * width * rows * height > max_pixels:
        size = f"{columns * width}x{rows * height}"
        raise InputError(
            f"{pattern}: all tiles together, {size}, exceed the limit of {max_pixels} pixels; raise --max-pixels"
        )
    shape = rows * height, columns * width, first.pixels.shape[2]
    pixels = (room or Memory())(shape, first.pixels.dtype)
    pixels[:] = 0
    for tile, image in images.items():
        offset = tile - low
        x, y = int(offset.real) * width, (rows - 1 - int(offset.imag)) * height
        pixels[y : y + height, x : x + width] = _alike(present[tile], image, first, width, height)
    notes = [note for image in images.values() for note in image.notes]
    if lacking := [tile for tile in corners if tile not in present]:
        names = [str(number_of(tile) or f"({tile.real:g}, {tile.imag:g})") for tile in lacking]
        colour = "black" if first.alpha < 0 else "transparent"
        notes.append(f"{pattern}: no file for the tiles {first_names(names, 8)}; the mesh is {colour} there")
    holes = sum(image.holes for image in images.values())
    return TiledImage(replace(first, pixels=pixels, notes=tuple(notes), holes=holes), (low, high))


def read_any(name: str, uv: Callable[[], Real], **options: Any) -> tuple[Image, Box | None]:
    """Read a picture, or those of the tiles that contain points (p, 2), and the range of coordinates they cover.

    Raises:
        InputError: as for `read` and `image_files.read`, to which options are passed.
    """
    if not is_pattern(name):
        from . import image_files, rasters

        raster = None
        if not options.get("colorspace"):
            raster = rasters.read(name, max_pixels=options["max_pixels"], nearest=False)
        return raster or image_files.read(name, **options), None
    tiled = read(name, all_of(uv()), **options)
    return tiled.image, tiled.box


def _alike(name: str, image: Image, first: Image, width: int, height: int) -> Any:
    """Return the pixels of a tile, repeated to the size of the largest tile.

    Raises:
        InputError: channels, type or colour space differ from those of the first, or the sizes do not divide.
    """
    kinds = [
        (picture.pixels.shape[2], picture.pixels.dtype, picture.alpha, picture.associated, picture.colorspace)
        for picture in (image, first)
    ]
    if kinds[0] != kinds[1]:
        raise InputError(f"{name}: its channels, type or colour space differ from those of the other tiles")
    h, w = image.pixels.shape[:2]
    if height % h or width % w:
        raise InputError(
            f"{name}: its size {w}x{h} does not divide {width}x{height}, the size of the "
            "largest tile; resize it"
        )
    return image.pixels.repeat(height // h, axis=0).repeat(width // w, axis=1)
