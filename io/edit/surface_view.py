"""A mesh as the page shows it: its triangles in space, and its texture in the plane of the flattening."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Box, Complex
from ...meshes.render import view
from ...pixels.sampler import Sampler
from ..pictures.image import Image
from ..run.job import Job
from ..shapes.mesh_shape import MeshShape

ROWS_AT_ONCE = 64  # rows of the picture made at a time
TEXELS_PER_TEXEL = 1.5
"""Texels per texel of the texture, in each direction, since flattening rotates and stretches it."""


class SurfaceView:
    """A mesh in page coordinates: of size about 1, centred at 0."""

    def __init__(self, shape: MeshShape) -> None:
        self.shape = shape
        self._points = shape.flattening.patch.points
        low, high = self._points.min(axis=0), self._points.max(axis=0)
        self.centre, self.scale = (low + high) / 2, float((high - low).max()) or 1.0

    def describe(self) -> dict[str, Any]:
        """Return what the page needs to know besides the triangles."""
        flat, axes = self.shape.flattening, view(self._points, self.shape.flattening.patch.faces)
        loops = [flat.loop, *(loop for loop in flat.patch.loops if not np.array_equal(loop, flat.loop))]
        rings = [np.round(self._page(loop), 6).tolist() for loop in loops]
        return {
            "origin": self.centre.tolist(),
            "scale": self.scale,
            "signs": [1, 1, 1],
            "outline": rings[0],
            "holes": rings[1:],
            "axes": axes.ravel().tolist(),
        }

    def _page(self, vertices: NDArray) -> NDArray:
        return (self._points[vertices] - self.centre) / self.scale

    @property
    def triangles(self) -> bytes:
        """The mesh in binary: numbers of vertices and triangles, points (n, 3) as floats, triangles (m, 3), and the
        file's index of each vertex (n,); all little-endian, four bytes each.
        """
        patch = self.shape.flattening.patch
        places = (self._points - self.centre) / self.scale
        numbers = patch.vertex + self.shape.file.mesh.base
        parts = [places.astype("<f4"), patch.faces.astype("<u4"), numbers.astype("<u4")]
        return struct.pack("<II", len(places), len(patch.faces)) + b"".join(part.tobytes() for part in parts)

    def places(self, z: Complex, digits: int) -> list[list[float]]:
        """Return points (k,) of the flattening's plane as points of the surface, rounded as a user would type them."""
        after = max(0, digits - int(np.floor(np.log10(self.scale))))
        return [[round(value, after) for value in place] for place in self.shape.to_space(z).tolist()]


def lay_out(job: Job, shape: MeshShape, image: Image, box: Box, most: int) -> Image:
    """Resample the texture of a mesh to a box in the plane of the flattening, by the mesh's own texture coordinates."""
    texture = image.texture(box, kind=job.kind)
    placing = shape.placing(texture)
    size = box[1] - box[0]
    step = max(1 / (TEXELS_PER_TEXEL * max(placing.scale)), max(size.real, size.imag) / most)
    width, height = (max(1, round(side / step)) for side in (size.real, size.imag))
    sampler = Sampler(texture, job.filter, job.kind, "clamp")
    x = box[0].real + size.real * (np.arange(width) + 0.5) / width
    y = box[1].imag - size.imag * (np.arange(height) + 0.5) / height
    out = np.empty((height, width, sampler.channels), sampler.dtype)
    right, down = complex(size.real / width), -1j * size.imag / height
    for row in range(0, height, ROWS_AT_ONCE):
        z = (x + 1j * y[row : row + ROWS_AT_ONCE, None]).ravel()

        def places(part: slice, z: Complex = z) -> Any:
            points = z[part]
            return placing.places(points, np.full(points.size, right), np.full(points.size, down))

        out[row : row + ROWS_AT_ONCE] = sampler(places, z.size).reshape(-1, width, sampler.channels)
    return image.with_pixels(out, texture.alpha)
