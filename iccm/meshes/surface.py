"""A mesh's own texture carried to a planar target, through its texture coordinates."""

from functools import partial

import numpy as np

from ..arrays import Complex
from ..maps.extended_inverse import ExtendedInverse
from ..maps.kinds import AnyMap, image_outline, inverted
from ..pixels.canvas import Canvas, Diagnostics
from ..pixels.coverage import coverage
from ..pixels.sampler import Places, Reader
from ..pixels.warp import Warped
from .bake import Plane, Surface

ROWS = 64


def warp(
    map: AnyMap, read: Reader, canvas: Canvas, place: Plane | Surface, threads: int | None = None
) -> Warped:
    """The texture seen through the map; as `resample.warp`, but `place` says where points of the source lie in it.

    Args:
        map: source → target.
        read: the texture.
        canvas: the raster to make, in the target's plane.
        place: where points of the source's plane lie in the texture.
        threads: as many as there are processors by default.
    """
    inverse, texture = inverted(map), read.texture
    pull, loop = ExtendedInverse(inverse, threads), canvas.pixels(image_outline(inverse))
    alpha = texture.alpha if texture.alpha >= 0 else read.channels
    out = np.zeros((canvas.height, canvas.width, read.channels + (texture.alpha < 0)), read.dtype)
    full = np.iinfo(out.dtype).max if out.dtype.kind == "u" else 1
    done = Diagnostics()
    for row in range(0, canvas.height, ROWS):
        rows = min(ROWS, canvas.height - row)
        cover, inside = coverage(loop, row, rows, canvas.width)
        at = np.flatnonzero((cover > 0) | inside)
        steps = _steps(pull, canvas, canvas.centres(row, rows).ravel()[at])
        pixels = read(partial(_places, place, steps), at.size, threads)
        share = np.maximum(cover.ravel()[at], inside.ravel()[at] * 1e-6)
        band = out[row : row + rows].reshape(-1, out.shape[2])
        band[at, : read.channels] = pixels
        opacity = pixels[:, alpha] if texture.alpha >= 0 else full
        band[at, alpha] = np.rint(opacity * share) if full > 1 else opacity * share
        if texture.associated:
            band[at, : read.channels] = (pixels * share[:, None]).astype(out.dtype)
        done.inside += int(inside.sum())
        done.edge += int(at.size - inside.sum())
    done.exact, done.fallback = done.inside, pull.outside
    return Warped(out, alpha, done)


def _steps(pull: ExtendedInverse, canvas: Canvas, w: Complex) -> tuple[Complex, Complex, Complex]:
    """Where points of the target come from, and the steps there of a pixel right and one down."""
    z = pull(w)
    z_w, z_wbar = (np.nan_to_num(s) for s in pull.slopes(z))
    dx, dy = canvas.step
    return z, (z_w + z_wbar) * dx, -1j * (z_w - z_wbar) * dy


def _places(place: Plane | Surface, steps: tuple[Complex, Complex, Complex], part: slice) -> Places:
    z, zx, zy = (values[part] for values in steps)
    return place.texels(z, zx, zy, 1)
