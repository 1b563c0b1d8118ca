"""Filter a texture at scattered points with their footprints, and encode the results like stored pixels."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex
from ..errors import InputError
from ..memory import Memory
from ..parallel import over_slices
from ..plane import cross
from . import colour, filters, pyramid
from .canvas import Band
from .colour import Float
from .normals import rotate
from .texture import Texture, TexturePlaces, check_kind, mend, strip_bytes

LARGE_VALUES = 1 << 27
"""Number of values of a texture from which it is not converted to floats: they would take half a gigabyte."""
SLICE_POINTS = 1 << 15  # points filtered at a time, which bounds memory
KINDS = ("colour", "data", "normal", "normal-down")


class Sampler:
    """A texture prepared for a filter: decoded and reduced, or in its stored form if that would take too much memory.

    Args:
        texture: the texture.
        filter: "nearest", "linear", "cubic" (Catmull-Rom; colours are clamped to the range of the texels it reads),
            "lanczos", "spline" (quintic, for smooth pictures that are enlarged; cubic where they are shrunk), or "auto"
            (cubic).
        kind: "colour" (filtered in linear light, premultiplied), "data" (filtered as stored), or "normal" and
            "normal-down" (tangent-space normals with y up or down; rotated and reflected by the texture's orientation
            in the output, and normalized).
        edge: what is outside the texture: its edge pixels ("clamp"), nothing ("transparent"), or the texture again
            ("repeat"), mirrored each time ("mirror").
        outlines: of the source and its holes. If the texture's alpha ends there, this edge is removed (`own_edge`),
            unless there is not enough memory: then `faded` is true.
        memory: where to allocate large arrays.
        threads: number of threads, by default that of processors; it does not affect the result.

    Raises:
        InputError: an unknown filter, kind, edge or transfer; normals without three channels.
    """

    def __init__(
        self,
        texture: Texture,
        filter: str = "auto",
        kind: str = "colour",
        edge: str = "clamp",
        *,
        outlines: Sequence[Complex] = (),
        memory: Memory | None = None,
        threads: int | None = None,
    ):
        for value, values, option in (
            (filter, ("auto", *filters.FILTERS), "filter"),
            (kind, KINDS, "kind"),
            (edge, pyramid.EDGES, "edge"),
            (texture.transfer, ("srgb", "linear"), "transfer"),
        ):
            if value not in values:
                raise InputError(f"{option} {value!r}: must be one of {', '.join(values)}")
        check_kind(kind, texture.pixels.shape[2])
        self.texture, self.kind, self.memory = texture, kind, memory or Memory()
        name = "cubic" if filter == "auto" else filter
        self.filter = filters.FILTERS[name]
        self.mixes = kind == "colour" and name != "nearest"
        self.clamped = self.mixes and name == "cubic"
        self.faded = False
        if outlines and self.mixes and texture.alpha >= 0:
            self._bleed(outlines)
        self.srgb = texture.transfer == "srgb" and self.mixes
        self.pyramid = self._pyramid(pyramid.EDGES[edge], threads)

    @property
    def channels(self) -> int:
        """Number of channels of the texture."""
        return self.texture.pixels.shape[2]

    @property
    def dtype(self) -> np.dtype:
        """Type of the texture's pixels."""
        return self.texture.pixels.dtype

    def _bleed(self, outlines: Sequence[Complex]) -> None:
        from . import own_edge

        height, width = self.texture.pixels.shape[:2]
        try:
            self.memory.threads(1, own_edge.BYTES_PER_TEXEL * height * width, "the texture's edge")
        except InputError:
            self.faded = True
        else:
            self.texture = own_edge.without_own_edge(self.texture, outlines)

    def _pyramid(self, edge: int, threads: int | None) -> pyramid.Pyramid:
        pixels, texture, memory = self.texture.pixels, self.texture, self.memory
        over, reduced = texture.alpha if self.mixes else -1, self.filter != filters.NEAREST
        ready: pyramid.Rows
        if pixels.dtype.kind == "u" and not texture.associated:
            decode = colour.tables(pixels.dtype, self.channels, texture.alpha, srgb=self.srgb)
            if pixels.size > LARGE_VALUES:
                return pyramid.compact(
                    pixels, decode, over, edge, memory, reduced=reduced, clamped=self.clamped
                )

            def ready(rows: Any, out: Float | None) -> Float:
                return pyramid.ready(pixels[rows], decode, over, out)
        else:

            def ready(rows: Any, out: Float | None) -> Float:
                premultiply, associated = self.mixes or texture.associated, texture.associated
                values = colour.decode(
                    pixels[rows],
                    texture.alpha,
                    srgb=self.srgb,
                    associated=associated,
                    premultiply=premultiply,
                )
                if out is not None:
                    out[:] = values
                return values

        picture = memory(pixels.shape, np.float32)
        smooth = self.filter == filters.SPLINE
        mended = pixels.dtype.kind == "f" and reduced
        if mended:
            self._decode_all(picture, ready, threads)
            mend(picture, over, memory, threads)
        return pyramid.pyramid(
            picture, edge, memory, None if mended else ready,
            reduced=reduced, spline=smooth, clamped=self.clamped,
        )  # fmt: skip

    def _decode_all(self, picture: Float, ready: pyramid.Rows, threads: int | None) -> None:
        """Fill in a picture whose texels are mended together, if some of them are not finite."""
        threads = self.memory.threads(threads, strip_bytes(*picture.shape), "the texture")

        def strip(part: slice) -> None:
            ready(part, picture[part])
            self.memory.release()

        over_slices(strip, len(picture), threads, pyramid.strip_rows(*picture.shape[1:]))

    def __call__(
        self, places: Callable[[slice], TexturePlaces], count: int, threads: int | None = None
    ) -> NDArray:
        """Return (count, c) pixels in the texture's stored form.

        Args:
            places: returns the places in the texture of a slice of the points.
            count: number of points.
            threads: number of threads, by default that of processors.
        """
        out = np.empty((count, self.channels), self.dtype)

        def fill(part: slice) -> None:
            out[part] = self.stored(self.values(places(part)))
            self.memory.release()

        over_slices(fill, count, threads, SLICE_POINTS)
        return out

    def values(self, places: TexturePlaces) -> Float:
        """Return (p, c) filtered values in linear light; normals are rotated."""
        values = filters.read(self.pyramid, places.xy, places.jacobian, self.filter, self.clamped)
        if self.kind.startswith("normal"):
            assert places.right is not None
            assert places.down is not None
            rotation = np.where(places.right != 0, places.right, 1).conj()
            mirrored = cross(places.right, places.down) > 0
            up = self.kind == "normal"
            values[:, :3] = rotate(values[:, :3], rotation, self.dtype, up=up, mirrored=mirrored)
        return values

    @property
    def paints(self) -> bool:
        """Whether `paint` supports the texture and filter: sRGB bytes, read by a kernel."""
        kernel = self.filter not in (filters.NEAREST, filters.SPLINE) and self.texture.rotation == 1
        return self.srgb and self.dtype == np.uint8 and not self.texture.associated and kernel

    def paint(self, band: Band, columns: tuple[int, int], out: NDArray[np.uint8]) -> None:
        """Filter and encode some columns of a band in one pass, for points in the plane of the texture.

        The result is the same as that of `values` and `stored`; it is written to `out`.
        """
        alpha = self.texture.alpha if self.texture.alpha >= 0 else self.channels
        corner, kind = self.texture.corner, self.filter
        filters.paint(self.pyramid, band, columns, corner, kind, self.clamped, alpha, out)

    def stored(self, values: Float, cover: Float | None = None) -> NDArray:
        """Return (p, c) filtered values unpremultiplied and encoded; `values` may be overwritten.

        Alpha is multiplied by the coverage (p,) if given; an alpha channel is appended if the texture has none.
        """
        alpha, associated = self.texture.alpha, self.texture.associated
        colours = [k for k in range(self.channels) if k != alpha]
        if alpha >= 0 and self.mixes and not associated:
            values[:, colours] /= np.where(values[:, alpha] != 0, values[:, alpha], 1)[:, None]
        if cover is not None:
            scaled = colours if associated else []
            values[:, [*scaled, *([alpha] if alpha >= 0 else [])]] *= cover[:, None]
            if alpha < 0:
                values, alpha = np.column_stack([values, cover]), self.channels
        return colour.encode(values[None], self.dtype, alpha, srgb=self.srgb, associated=associated)[0]


def put(out: NDArray, indices: NDArray[np.intp], pixels: NDArray) -> None:
    """Compute out[at] = pixels for (n, c) contiguous arrays, several times as fast."""
    pixel = np.dtype((np.void, pixels.itemsize * pixels.shape[1]))
    np.put(out.view(pixel), indices, pixels.view(pixel))
