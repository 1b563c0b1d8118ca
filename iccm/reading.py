"""Stored pixels of a texture at scattered places with their footprints."""

import numpy as np
from numpy.typing import NDArray

from . import colour, sampling
from .curve import Real
from .errors import InputError
from .parallel import over_slices
from .resample import Texture

SLICE = 1 << 15


class Reader:
    """A texture made ready to be read at scattered places.

    Args:
        texture: the picture; its box does not matter.
        filter: "nearest", "linear", "cubic", "lanczos", or "auto" (cubic).
        kind: "colour" (filtered in linear light, premultiplied) or "data".
        edge: "clamp" or "transparent", what lies outside the picture.

    Raises:
        InputError: an unknown filter, kind or edge.
    """

    def __init__(self, texture: Texture, filter: str = "auto", kind: str = "colour", edge: str = "clamp"):
        name = "cubic" if filter == "auto" else filter
        if name not in sampling.FILTERS:
            raise InputError(f"filter {filter!r}: not one of auto, {', '.join(sampling.FILTERS)} for a mesh")
        if kind not in ("colour", "data") or edge not in ("clamp", "transparent"):
            raise InputError(
                f"kind {kind!r}, edge {edge!r}: a mesh's texture is colour or data, clamp or transparent"
            )
        self.texture = texture
        self.filter = sampling.FILTERS[name]
        self.mixes = kind == "colour" and name != "nearest"
        self.srgb = self.mixes and texture.transfer == "srgb"
        picture = colour.decode(
            texture.pixels,
            texture.alpha,
            srgb=self.srgb,
            associated=texture.associated,
            premultiply=self.mixes,
        )
        rim = sampling.CLAMP if edge == "clamp" else sampling.CLEAR
        self.pyramid = sampling.pyramid(picture, rim, self.filter)

    @property
    def channels(self) -> int:
        """Of the texture."""
        return self.texture.pixels.shape[2]

    def __call__(self, places, count: int, threads: int | None = None) -> NDArray:
        """(count, c) pixels as the texture stores them.

        Args:
            places: takes a slice of the points to their (p, 2) texel coordinates (x right, y down) and (p, 4) derivatives.
            count: number of points.
            threads: as many as there are processors by default.
        """
        out = np.empty((count, self.channels), self.texture.pixels.dtype)

        def fill(part: slice) -> None:
            xy, turn = places(part)
            values = np.empty((len(xy), self.channels), np.float32)
            sampling.read_all(self.pyramid, xy, turn, self.filter, values)
            out[part] = self._stored(values)

        over_slices(fill, count, threads, SLICE)
        return out

    def _stored(self, values: Real) -> NDArray:
        alpha = self.texture.alpha
        if alpha >= 0 and self.mixes and not self.texture.associated:
            colours = [k for k in range(self.channels) if k != alpha]
            values[:, colours] /= np.where(values[:, alpha] != 0, values[:, alpha], 1)[:, None]
        return colour.encode(values[None], self.texture.pixels.dtype, alpha, srgb=self.srgb)[0]
