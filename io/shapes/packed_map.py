"""Triangulated maps packed into a short text, for files that people send to each other.

A map of a few pins has some 3,000 vertices on both sides and 6,000 triangles, 250 kB as lists of numbers. Packed it has
a fifth of that:

- Coordinates are multiples of a step, a power of two. Vertices of outlines and of exact pins must stay where they are,
  and get steps of 2⁻³⁶ of the shape's extent; the rest of the map converges again, and gets coarser ones.
- Vertices are sorted by place, so that the differences between neighbours are small numbers.
- The differences are compressed by zlib, and written as base 85.

Rounding is idempotent: a map that was packed and unpacked is packed to the same text.
"""

from __future__ import annotations

import base64
import struct
import zlib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...plane import triangle_areas
from .. import limits

Points = NDArray[np.float64]  # (n, 2)
Triangles = NDArray[np.int64]  # (m, 3)

FINE_BITS, DOUBLE_BITS = 36, 52
"""Of a coordinate relative to the shape's extent, at places that must be kept; and at most, of a double."""
COARSE_BITS = (16, 20)
"""The same elsewhere. With the first a vertex moves by a sixtieth of a pixel on a screen; the second is for maps whose
thin triangles that would flip."""
STRIPS = 40  # into which the source is divided, to sort vertices by place
HEADER = struct.Struct("<4sIII2h2h")
MAGIC = b"icm1"
DAMAGED = "is damaged; save the pins again in iccm edit"


class PackedMap(NamedTuple):
    """A map as it is after packing.

    Attributes:
        source: (n, 2) vertices in the source.
        target: (n, 2) the same in the target.
        triangles: (m, 3) numbers of vertices.
    """

    source: Points
    target: Points
    triangles: Triangles


def round_map(source: Points, target: Points, triangles: Triangles, is_fixed: NDArray[np.bool_]) -> PackedMap:
    """Return a map whose coordinates are rounded for `pack`, with its vertices sorted.

    Args:
        source: (n, 2) vertices in the source.
        target: (n, 2) the same in the target.
        triangles: (m, 3) numbers of vertices.
        is_fixed: (n,) whether a vertex must stay where it is.
    """
    fine = [_rounded(side, _exponent(side, FINE_BITS)) for side in (source, target)]
    rounded = fine
    for bits in COARSE_BITS:
        coarse = [
            np.where(is_fixed[:, None], fine_side, _rounded(fine_side, _exponent(side, bits)))
            for fine_side, side in zip(fine, (source, target))
        ]
        if not any(_folds(side, triangles) for side in coarse):
            rounded = coarse
            break
    order = _order(rounded[0])
    faces = np.argsort(order)[triangles]
    first = faces.argmin(axis=1)
    faces = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
    faces = faces[np.lexsort((faces[:, 2], faces[:, 1], faces[:, 0]))]
    return PackedMap(rounded[0][order], rounded[1][order], faces)


def pack(map: PackedMap) -> str:
    """Return the text for a map that `round_map` has rounded."""
    fine = [_exponent(side, FINE_BITS) for side in map[:2]]
    coarse = fine
    is_coarse = np.zeros(len(map.source), bool)
    for bits in COARSE_BITS:
        exponents = [_exponent(side, bits) for side in map[:2]]
        on_grid = np.ones(len(map.source), bool)
        for side, exponent in zip(map[:2], exponents):
            on_grid &= (_rounded(side, exponent) == side).all(axis=1)
        if on_grid.sum() > is_coarse.sum():
            is_coarse, coarse = on_grid, exponents
    parts = [np.packbits(is_coarse).tobytes()]
    for side, *exponents in zip(map[:2], fine, coarse):
        for is_selected, exponent in zip((~is_coarse, is_coarse), exponents):
            parts += [_differences(np.ldexp(values, -exponent)) for values in side[is_selected].T]
    a, b, c = map.triangles.T
    parts += [_differences(a), _as_bytes(b - a), _as_bytes(c - a)]
    header = HEADER.pack(MAGIC, len(map.source), int(is_coarse.sum()), len(map.triangles), *fine, *coarse)
    return base64.b85encode(zlib.compress(header + b"".join(parts), 9)).decode()


def unpack(text: str) -> PackedMap:
    """Return the map of a text that `pack` has made.

    Raises:
        ValueError: it is something else, or too large.
    """
    try:
        content = _decompress(base64.b85decode(text))
        magic, count, coarse_count, faces, *exponents = HEADER.unpack_from(content)
    except (ValueError, zlib.error, struct.error):
        raise ValueError(DAMAGED) from None
    mask_bytes = -(-count // 8)
    length = HEADER.size + mask_bytes + 8 * (4 * count + 3 * faces)
    if magic != MAGIC or max(count, faces) > limits.START_ENTRIES or len(content) != length:
        raise ValueError(DAMAGED)
    mask = np.frombuffer(content, np.uint8, mask_bytes, HEADER.size)
    is_coarse = np.unpackbits(mask, count=count).astype(bool)
    if is_coarse.sum() != coarse_count or not all(-1074 <= power <= 900 for power in exponents):
        raise ValueError(DAMAGED)
    position = HEADER.size + mask_bytes

    def numbers(size: int) -> NDArray[np.int64]:
        nonlocal position
        planes = np.frombuffer(content, np.uint8, 8 * size, position).reshape(8, size)
        position += 8 * size
        return np.ascontiguousarray(planes.T).view("<i8").ravel().astype(np.int64)

    sides = [np.empty((count, 2)), np.empty((count, 2))]
    for side, fine, coarse in zip(sides, exponents[:2], exponents[2:]):
        for is_selected, exponent in ((~is_coarse, fine), (is_coarse, coarse)):
            for k in range(2):
                values = np.cumsum(numbers(int(is_selected.sum()))).astype(np.float64)
                side[is_selected, k] = np.ldexp(values, exponent)
    a = np.cumsum(numbers(faces))
    b, c = a + numbers(faces), a + numbers(faces)
    return PackedMap(sides[0], sides[1], np.stack([a, b, c], axis=1))


def _exponent(side: Points, bits: int) -> int:
    """Return the exponent of the step of the coordinates of a side (n, 2)."""
    extent = float(np.ptp(side, axis=0).max())
    largest = float(np.abs(side).max())
    of_extent, of_largest = (int(np.frexp(value)[1]) for value in (extent, largest))
    return max(of_extent - bits, of_largest - DOUBLE_BITS)


def _rounded(side: Points, exponent: int) -> Points:
    return np.ldexp(np.rint(np.ldexp(side, -exponent)), exponent)


def _folds(side: Points, triangles: Triangles) -> bool:
    return bool((triangle_areas((side[:, 0] + 1j * side[:, 1])[triangles]) <= 0).any())


def _order(source: Points) -> NDArray[np.int64]:
    """Return the vertices strip by strip."""
    low, extent = source[:, 0].min(), np.ptp(source[:, 0])
    strip = np.floor(STRIPS * (source[:, 0] - low) / extent) if extent else np.zeros(len(source))
    return np.lexsort((source[:, 0], source[:, 1], strip))


def _differences(values: NDArray[np.float64] | NDArray[np.int64]) -> bytes:
    numbers = values.astype(np.int64)
    numbers[1:] -= numbers[:-1].copy()
    return _as_bytes(numbers)


def _as_bytes(values: NDArray[np.int64]) -> bytes:
    """Return numbers as bytes, the lowest ones of all first: the higher ones are mostly alike."""
    return np.ascontiguousarray(values.astype("<i8").view(np.uint8).reshape(-1, 8).T).tobytes()


def _decompress(content: bytes) -> bytes:
    """Return what was compressed, at most as much as the largest map has."""
    most = HEADER.size + limits.START_ENTRIES * (1 + 8 * 7)
    engine = zlib.decompressobj()
    unpacked = engine.decompress(content, most)
    if not engine.eof:
        raise ValueError(DAMAGED)
    return unpacked
