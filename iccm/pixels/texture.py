"""A picture with its place in the plane, and the same made ready to be filtered."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box
from ..errors import InputError
from ..memory import Room
from ..parallel import over_slices
from . import colour, filters
from .colour import Float

LARGE = 1 << 27  # numbers in a texture from which it is not turned into floats
MENDING = 48  # bytes that each texel takes on the way where some are not finite


def check_kind(kind: str, channels: int, name: str = "the picture") -> None:
    """Refuse normals without three channels; `name` is the picture's.

    Raises:
        InputError: saying how many there are.
    """
    if kind.startswith("normal") and channels < 3:
        raise InputError(
            f"kind {kind!r}: {name} has {channels} channel{'s' * (channels > 1)}; normals need 3"
        )


def strip_bytes(height: int, width: int, channels: int) -> int:
    """Bytes that a thread takes to prepare rows of a texture."""
    return 16 * min(height, filters.strip_rows(width, channels)) * width * channels


def mend(picture: Float, alpha: int = -1, room: Room | None = None, threads: int | None = None) -> None:
    """Takes out what is not finite, so that a filter does not spread it: texels around it stand for it.

    Args:
        picture: (h, w, c) ready to be filtered; changed in place, channel by channel, where it is not finite.
        alpha: the channel that the others are premultiplied by, or -1; where it is 0 they become 0.
        room: says whether there is room for that.
        threads: never change the result.

    Raises:
        InputError: there is no room.
    """
    room, clean = room or Room(), list[bool]()

    def look(part: slice) -> None:
        clean.append(bool(np.isfinite(picture[part]).all()))
        room.release()

    over_slices(look, len(picture), threads, filters.strip_rows(*picture.shape[1:]))
    if all(clean):
        return
    from .padding import pad

    height, width, channels = picture.shape
    room.threads(1, MENDING * height * width, "a texture that is not finite everywhere")
    for k in sorted(range(channels), key=lambda k: k != alpha):  # alpha first
        known = np.isfinite(picture[..., k])
        picture[..., k][~known] = 0
        if alpha not in (-1, k):
            known |= picture[..., alpha] == 0
        picture[..., k : k + 1] = pad(picture[..., k : k + 1], known, -1)


@dataclass(frozen=True, eq=False)
class Texture:
    """Pixels with their placement in the plane.

    Attributes:
        pixels: (h, w, c) uint8, uint16, float16 or float32, row 0 on top.
        box: lower left and upper right corner of the picture, in the source's plane.
        alpha: index of the alpha channel, or -1.
        transfer: "srgb" or "linear", how the colour channels are encoded.
        associated: whether they are premultiplied by alpha.
    """

    pixels: NDArray
    box: Box
    alpha: int = -1
    transfer: str = "srgb"
    associated: bool = False

    @property
    def scale(self) -> tuple[float, float]:
        """Texels a unit of the source's plane, across and down."""
        size = self.box[1] - self.box[0]
        return self.pixels.shape[1] / size.real, self.pixels.shape[0] / size.imag


class Prepared:
    """A texture ready for a filter: decoded and reduced, or as it is stored when that would take too much memory.

    Args:
        texture: the texture.
        filter, kind, edge: as for `resample.warp`.
        room: where the large arrays are kept.
        threads: as many as there are processors by default; the result does not depend on it.

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
        room: Room | None = None,
        threads: int | None = None,
    ):
        for given, known, what in (
            (filter, ("auto", *filters.FILTERS), "filter"),
            (kind, ("colour", "data", "normal", "normal-down"), "kind"),
            (edge, ("clamp", "transparent"), "edge"),
            (texture.transfer, ("srgb", "linear"), "transfer"),
        ):
            if given not in known:
                raise InputError(f"{what} {given!r}: not one of {', '.join(known)}")
        check_kind(kind, texture.pixels.shape[2])
        self.texture, self.kind, self.room = texture, kind, room or Room()
        name = "cubic" if filter == "auto" else filter
        self.filter = filters.FILTERS[name]
        self.mixes = kind == "colour" and name != "nearest"
        self.srgb = texture.transfer == "srgb" and self.mixes
        self.channels = texture.pixels.shape[2] + (texture.alpha < 0)
        self.alpha = texture.alpha if texture.alpha >= 0 else self.channels - 1
        self.pyramid = self._pyramid(filters.CLAMP if edge == "clamp" else filters.CLEAR, threads)

    def _pyramid(self, edge: int, threads: int | None) -> filters.Pyramid:
        pixels, texture, room = self.texture.pixels, self.texture, self.room
        rows = filters.strip_rows(*pixels.shape[1:])
        threads = room.threads(threads, strip_bytes(*pixels.shape), "the texture")
        ready: Callable[[NDArray], Float]
        if pixels.dtype.kind == "u" and not texture.associated:
            decode = colour.tables(pixels.dtype, pixels.shape[2], texture.alpha, srgb=self.srgb)
            over = texture.alpha if self.mixes else -1
            if pixels.size > LARGE:
                return filters.compact(pixels, decode, over, edge, self.filter, room, threads)

            def ready(rows: NDArray) -> Float:
                return filters.ready(rows, decode, over)
        else:

            def ready(rows: NDArray) -> Float:
                premultiply = self.mixes or texture.associated
                return colour.decode(
                    rows,
                    texture.alpha,
                    srgb=self.srgb,
                    associated=texture.associated,
                    premultiply=premultiply,
                )

        picture = room(pixels.shape, np.float32)

        def strip(part: slice) -> None:
            picture[part] = ready(pixels[part])
            room.release()

        over_slices(strip, len(pixels), threads, rows)
        if pixels.dtype.kind == "f" and self.filter != filters.NEAREST:
            mend(picture, texture.alpha if self.mixes else -1, room, threads)
        return filters.pyramid(picture, edge, self.filter, room, threads)

    def read(self, z: NDArray, right: NDArray, down: NDArray) -> Float:
        """(p, c) linear values at points z (p,) of the source's plane; right and down, (p,), are the pixels' steps."""
        (sx, sy), (low, high) = self.texture.scale, self.texture.box
        xy = np.column_stack([(z.real - low.real) * sx, (high.imag - z.imag) * sy])
        turn = np.column_stack([right.real * sx, down.real * sx, -right.imag * sy, -down.imag * sy])
        out = np.empty((z.size, self.pyramid.base.shape[2]), dtype=np.float32)
        filters.read_all(self.pyramid, xy, turn, self.filter, out)
        return out

    def stored(self, values: Float, cover: Float) -> NDArray:
        """(p, c) filtered values unpremultiplied, covered (p,) and encoded, with an alpha channel."""
        colours = [k for k in range(self.channels) if k != self.alpha]
        dtype, associated = self.texture.pixels.dtype, self.texture.associated
        if self.texture.alpha < 0:
            values = np.column_stack([values, cover])
        else:
            alpha = values[:, self.alpha].copy()
            if self.mixes and not associated:
                values[:, colours] /= np.where(alpha != 0, alpha, 1)[:, None]
            values[:, self.alpha] = alpha * cover
        if associated:
            values[:, colours] *= cover[:, None]
        return colour.encode(values[None], dtype, self.alpha, srgb=self.srgb, associated=associated)[0]
