"""A picture with its place in the plane."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Complex, Real
from ..errors import InputError
from ..memory import Memory
from ..native import function
from ..parallel import over_slices
from .colour import Float
from .pyramid import strip_rows

_place = function("""int64_t iccm_pixels_place(
    const Complex *z, const Complex *right, const Complex *down, int64_t count, const double *corner,
    double *xy, double *turn)""")
Corner = tuple[float, float, float, float]
MENDING_BYTES_PER_TEXEL = 48  # bytes that each texel takes on the way where some are not finite (by hand)


def check_kind(kind: str, channels: int, name: str = "the picture") -> None:
    """Refuse normals without three channels; `name` is the picture's.

    Raises:
        InputError: saying how many there are.
    """
    if kind.startswith("normal") and channels < 3:
        raise InputError(
            f"kind {kind!r}: {name} has {channels} channel{'s' * (channels > 1)}; a normal map needs 3"
        )


def strip_bytes(height: int, width: int, channels: int) -> int:
    """Bytes that a thread takes to prepare rows of a texture."""
    return 16 * min(height, strip_rows(width, channels)) * width * channels


def mend(picture: Float, alpha: int = -1, memory: Memory | None = None, threads: int | None = None) -> None:
    """Take out what is not finite, so that a filter does not spread it: texels around it stand for it.

    Args:
        picture: (h, w, c) ready to be filtered; changed in place, channel by channel, where it is not finite.
        alpha: the channel that the others are premultiplied by, or -1; where it is 0 they become 0.
        memory: says whether there is room for that.
        threads: never change the result.

    Raises:
        InputError: there is no room.
    """
    memory, clean = memory or Memory(), list[bool]()

    def look(part: slice) -> None:
        clean.append(bool(np.isfinite(picture[part]).all()))
        memory.release()

    over_slices(look, len(picture), threads, strip_rows(*picture.shape[1:]))
    if all(clean):
        return
    from .padding import pad

    height, width, channels = picture.shape
    memory.threads(1, MENDING_BYTES_PER_TEXEL * height * width, "a texture with pixels that are not finite")
    for k in sorted(range(channels), key=lambda k: k != alpha):  # alpha first
        known = np.isfinite(picture[..., k])
        picture[..., k][~known] = 0
        if alpha not in (-1, k):
            known |= picture[..., alpha] == 0
        pad(picture[..., k : k + 1], known, -1)


class Places(NamedTuple):
    """Where points lie in a texture.

    Attributes:
        xy: (p, 2) texel coordinates, x right, y down.
        turn: (p, 4) their derivatives by the output's x and y: dx/dx, dx/dy, dy/dx, dy/dy.
        right, down: (p,) directions of the output's x and y on the textured surface, for normals: 1 is where the
            texture's x goes, 1j is square to it on the side where its upward y goes.
    """

    xy: Real
    turn: Real
    right: NDArray | None = None
    down: NDArray | None = None


class Placing(Protocol):
    """Where points of the source's plane lie in a texture: one that lies flat in it, or that of a mesh."""

    @property
    def scale(self) -> tuple[float, float]:
        """Texels a unit of the source's plane, across and down."""

    def places(self, z: Complex, right: NDArray, down: NDArray) -> Places:
        """Return places of points z (p,), given their derivatives (p,) by the output's x and y."""


ROUNDED_TEXELS = 1e-6  # texels beyond the texture's edge that are still on it (by hand: above round-off)


Wrap = tuple[str, str]
"""What lies beside a picture, and what above and below: "repeat", "mirror" or "clamp" (its edge continues)."""
REPEAT: Wrap = ("repeat", "repeat")


def wrapped(at: Places, size: tuple[float, float], wrap: Wrap = REPEAT) -> Places:
    """Return places in a picture of this width and height of those beyond its edges."""
    xy, turn = at.xy.copy(), at.turn.copy()
    for k, (extent, how) in enumerate(zip(size, wrap)):
        beyond = np.flatnonzero((xy[:, k] < -ROUNDED_TEXELS) | (xy[:, k] > extent + ROUNDED_TEXELS))
        if how == "clamp" or not beyond.size:
            continue
        tile, xy[beyond, k] = np.divmod(xy[beyond, k], extent)
        if how == "mirror":
            odd = beyond[tile % 2 == 1]
            xy[odd, k] = extent - xy[odd, k]
            turn[odd, 2 * k : 2 * k + 2] *= -1
    return at._replace(xy=xy, turn=turn)


@dataclass(frozen=True, eq=False)
class Wrapped:
    """A texture that lies flat in the source's plane, and continues beyond its edges as `wrap` says."""

    texture: "Texture"
    wrap: Wrap = REPEAT

    @property
    def scale(self) -> tuple[float, float]:
        """As `Placing.scale`."""
        return self.texture.scale

    def places(self, z: Complex, right: NDArray, down: NDArray) -> Places:
        """Return as `Placing.places`."""
        height, width = self.texture.pixels.shape[:2]
        return wrapped(self.texture.places(z, right, down), (width, height), self.wrap)


@dataclass(frozen=True, eq=False)
class Texture:
    """Pixels with their placement in the plane.

    Attributes:
        pixels: (h, w, c) uint8, uint16, float16 or float32, row 0 on top.
        box: lower left and upper right corner of the picture, in the source's plane.
        alpha: index of the alpha channel, or -1.
        transfer: "srgb" or "linear", how the colour channels are encoded.
        associated: whether they are premultiplied by alpha.
        turn: of modulus 1, by which the picture is turned about the middle of its box.
    """

    pixels: NDArray
    box: Box
    alpha: int = -1
    transfer: str = "srgb"
    associated: bool = False
    turn: complex = 1

    @property
    def scale(self) -> tuple[float, float]:
        """Texels a unit of the source's plane, across and down."""
        size = self.box[1] - self.box[0]
        return self.pixels.shape[1] / size.real, self.pixels.shape[0] / size.imag

    @property
    def corner(self) -> Corner:
        """The upper left corner's x and y in the source's plane, were it not turned, and the scale."""
        return (self.box[0].real, self.box[1].imag, *self.scale)

    def places(self, z: Complex, right: NDArray, down: NDArray) -> Places:
        """Return as `Placing.places`."""
        xy, turn = np.empty((z.size, 2)), np.empty((z.size, 4))
        if self.turn != 1:
            back = np.complex64(self.turn.conjugate())
            z, right, down = self.turned_back(z), right * back, down * back
        points, across, below = (np.ascontiguousarray(part, np.complex128) for part in (z, right, down))
        _place(points, across, below, z.size, np.array(self.corner), xy, turn)
        return Places(xy, turn, right, down)

    def turned_back(self, z: Complex) -> Complex:
        """Return where points of the source's plane would lie, were the picture not turned."""
        middle = (self.box[0] + self.box[1]) / 2
        return middle + (z - middle) * self.turn.conjugate()
