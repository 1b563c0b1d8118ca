"""A mesh's own texture carried to a planar target, through its texture coordinates."""

import numpy as np

from .bake import Plane, Surface
from .canvas import Canvas
from .coverage import coverage
from .harmonic import HarmonicMap
from .pullback import Pullback
from .reading import Reader
from .resample import Texture, Warped

ROWS = 64


def warp(
    map: HarmonicMap,
    texture: Texture,
    canvas: Canvas,
    place: Plane | Surface,
    *,
    filter: str = "auto",
    kind: str = "colour",
    edge: str = "clamp",
    antialias: bool = True,
    threads: int | None = None,
) -> Warped:
    """The texture seen through the map; as `resample.warp`, but `place` says where points of the source lie in it.

    Raises:
        InputError: an unknown filter, kind or edge.
    """
    from .canvas import Diagnostics

    pull, read = Pullback(map, threads), Reader(texture, filter, kind, edge)
    loop = canvas.pixels(pull.rim.z)
    alpha = texture.alpha if texture.alpha >= 0 else read.channels
    out = np.zeros((canvas.height, canvas.width, read.channels + (texture.alpha < 0)), texture.pixels.dtype)
    full = np.iinfo(out.dtype).max if out.dtype.kind == "u" else 1
    done = Diagnostics()
    for row in range(0, canvas.height, ROWS):
        rows = min(ROWS, canvas.height - row)
        cover, inside = coverage(loop, row, rows, canvas.width)
        at = np.flatnonzero((cover > 0) | inside)
        z = pull(canvas.centres(row, rows).ravel()[at])
        z_w, z_wbar = (np.nan_to_num(s) for s in pull.slopes(z))
        dx, dy = canvas.step
        zx, zy = (z_w + z_wbar) * dx, -1j * (z_w - z_wbar) * dy
        pixels = read(lambda p, z=z, zx=zx, zy=zy: place.texels(z[p], zx[p], zy[p], 1), at.size, threads)
        share = np.maximum(cover.ravel()[at], inside.ravel()[at] * 1e-6)
        share = share if antialias else np.round(share)
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
