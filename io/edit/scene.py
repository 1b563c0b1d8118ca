"""Drawings in the page's own coordinates: of size about 1, with y down, so that 32 bits suffice.

A point of a file is origin + scale · (x, ±y), where the sign depends on whether y points down in the file.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Box, Complex
from ...maps.triangulated.map import TriangulatedMap
from ...pixels.raster import resized_by_area
from ...plane import bounding_box, longer_side
from ..formats import picture
from ..pictures.image import Image, prepare
from ..pictures.image_files import as_png
from ..shapes.shape import Shape


@dataclass(frozen=True)
class PageHalf:
    """The coordinate system of one half of the page.

    Attributes:
        centre: the point of the core plane at the origin.
        scale: the length in the core plane that becomes 1.
    """

    centre: complex
    scale: float

    @classmethod
    def of(cls, *boxes: Box) -> PageHalf:
        """Return the coordinates in which the boxes together have size 1."""
        low, high = bounding_box(np.array(boxes))
        return cls((low + high) / 2, longer_side(low, high))

    def __call__(self, z: Complex) -> NDArray[np.float32]:
        """Convert points of the core plane to page coordinates (..., 2)."""
        w = (np.asarray(z, np.complex128) - self.centre) / self.scale
        return np.stack([w.real, -w.imag], axis=-1).astype(np.float32)

    def points(self, z: Complex) -> list[list[float]]:
        """Return points (n,) as n rounded pairs for JSON."""
        return np.round(self(z).astype(float), 6).tolist()

    def vectors(self, d: Complex) -> NDArray[np.float32]:
        """Convert differences of points to page coordinates."""
        return PageHalf(0j, self.scale)(d)

    def box(self, box: Box) -> list[float]:
        """Return left, top, right and bottom of a box."""
        (left, bottom), (right, top) = self(np.array(box)).tolist()
        return [left, top, right, bottom]

    def describe(self, shape: Shape, box: Box) -> dict[str, Any]:
        """Return what the page needs to know about the side that shows a shape in a box."""
        origin = shape.to_file(np.array([self.centre]))[0]
        return {
            "name": shape.spec,
            "origin": origin.tolist(),
            "scale": self.scale,
            "signs": [1, 1 if shape.flip else -1],
            "outline": self.points(shape.curve.z),
            "holes": [self.points(hole) for hole in shape.holes],
            "painted": [self.points(ring) for ring in shape.drawing.rings] if shape.drawing else None,
            "box": self.box(box),
            "bounds": self.box(shape.bounds),
        }


def patches(map: TriangulatedMap, source: PageHalf, target: PageHalf) -> NDArray[np.float32]:
    """Return (m, 18): for each triangle its corners in the image, then the corners and curvature vectors of its patch
    in the source.
    """
    sides = [target(map.corners), source(map.patches[:, :3]), source.vectors(map.patches[:, 3:])]
    return np.concatenate([side.reshape(len(map.faces), 6) for side in sides], axis=1)


def frame(head: dict[str, Any], floats: NDArray[np.float32]) -> bytes:
    """Return a binary message: the length of a JSON text padded to four bytes, the text, then floats, all
    little-endian.
    """
    text = json.dumps(head, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + floats.astype("<f4").tobytes()


def png(image: Image, most: int) -> bytes:
    """Return an image as a PNG for browsers, with at most so many pixels a side."""
    prepared = prepare(image, picture("texture.png"))
    height, width = prepared.pixels.shape[:2]
    if (larger := max(height, width)) > most:
        size = (round(width * most / larger) or 1, round(height * most / larger) or 1)
        prepared = prepared.with_pixels(resized_by_area(prepared.pixels, size), prepared.alpha)
    return as_png(prepared)
