"""Pictures placed in the plane."""

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
    double *xy, double *jacobian)""")
Corner = tuple[float, float, float, float]
MENDING_BYTES_PER_TEXEL = 48  # working memory in bytes per texel where some are not finite: arrays counted


def check_kind(kind: str, channels: int, name: str = "the picture") -> None:
    """Refuse normals without three channels; `name` is used in the message.

    Raises:
        InputError: there are fewer channels.
    """
    if kind.startswith("normal") and channels < 3:
        raise InputError(
            f"kind {kind!r}: {name} has {channels} channel{'s' * (channels > 1)}; a normal map needs 3"
        )


def strip_bytes(height: int, width: int, channels: int) -> int:
    """Return the working memory in bytes with which a thread prepares rows of a texture."""
    return 16 * min(height, strip_rows(width, channels)) * width * channels


def mend(picture: Float, alpha: int = -1, memory: Memory | None = None, threads: int | None = None) -> None:
    """Replace texels that are not finite by texels around them, so that filters do not spread them.

    Args:
        picture: (h, w, c) ready to be filtered; changed in place.
        alpha: channel by which the others are premultiplied, or -1; where it is 0 they become 0.
        memory: limits the memory used.
        threads: number of threads; it does not affect the result.

    Raises:
        InputError: there is not enough memory.
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


class TexturePlaces(NamedTuple):
    """Places of points in a texture.

    Attributes:
        xy: (p, 2) texel coordinates, x right, y down.
        jacobian: (p, 4) their derivatives by the output's x and y: dx/dx, dx/dy, dy/dx, dy/dy.
        right, down: (p,) for normals, directions of the output's x and y on the textured surface: 1 is the direction of
            the texture's x, 1j is perpendicular to it on the side of the texture's upward y.
    """

    xy: Real
    jacobian: Real
    right: NDArray | None = None
    down: NDArray | None = None


class Placing(Protocol):
    """Places points of the source's plane in a texture that lies in this plane, or on a mesh."""

    @property
    def scale(self) -> tuple[float, float]:
        """Texels per unit of the source's plane, across and down."""

    def places(self, z: Complex, right: NDArray, down: NDArray) -> TexturePlaces:
        """Return the places of points z (p,), given their derivatives (p,) by the output's x and y."""


ROUNDED_TEXELS = 1e-6
"""Distance in texels; points closer than this to the texture's edge count as inside: far above rounding."""


Wrap = tuple[str, str]
"""How a picture continues horizontally and vertically: "repeat", "mirror" or "clamp" (its edge pixels)."""
REPEAT: Wrap = ("repeat", "repeat")


def wrapped(places: TexturePlaces, size: tuple[float, float], wrap: Wrap = REPEAT) -> TexturePlaces:
    """Map places beyond the edges of a picture of this size (width, height) into it."""
    xy, jacobian = places.xy.copy(), places.jacobian.copy()
    for k, (extent, how) in enumerate(zip(size, wrap)):
        beyond = np.flatnonzero((xy[:, k] < -ROUNDED_TEXELS) | (xy[:, k] > extent + ROUNDED_TEXELS))
        if how == "clamp" or not beyond.size:
            continue
        tile, xy[beyond, k] = np.divmod(xy[beyond, k], extent)
        if how == "mirror":
            odd = beyond[tile % 2 == 1]
            xy[odd, k] = extent - xy[odd, k]
            jacobian[odd, 2 * k : 2 * k + 2] *= -1
    return places._replace(xy=xy, jacobian=jacobian)


@dataclass(frozen=True, eq=False)
class Wrapped:
    """A texture in the source's plane that continues beyond its edges according to `wrap`."""

    texture: "Texture"
    wrap: Wrap = REPEAT

    @property
    def scale(self) -> tuple[float, float]:
        """See `Placing.scale`."""
        return self.texture.scale

    def places(self, z: Complex, right: NDArray, down: NDArray) -> TexturePlaces:
        """See `Placing.places`."""
        height, width = self.texture.pixels.shape[:2]
        return wrapped(self.texture.places(z, right, down), (width, height), self.wrap)


@dataclass(frozen=True, eq=False)
class Texture:
    """Pixels placed in the plane.

    Attributes:
        pixels: (h, w, c) uint8, uint16, float16 or float32, row 0 at the top.
        box: lower left and upper right corner of the picture, in the source's plane.
        alpha: index of the alpha channel, or -1.
        transfer: "srgb" or "linear", the encoding of the colour channels.
        associated: whether they are premultiplied by alpha.
        rotation: unit complex number by which the picture is rotated about the middle of its box.
    """

    pixels: NDArray
    box: Box
    alpha: int = -1
    transfer: str = "srgb"
    associated: bool = False
    rotation: complex = 1

    @property
    def scale(self) -> tuple[float, float]:
        """Texels per unit of the source's plane, across and down."""
        size = self.box[1] - self.box[0]
        return self.pixels.shape[1] / size.real, self.pixels.shape[0] / size.imag

    @property
    def corner(self) -> Corner:
        """x and y of the upper left corner in the source's plane, without the rotation, and the scale."""
        return (self.box[0].real, self.box[1].imag, *self.scale)

    def places(self, z: Complex, right: NDArray, down: NDArray) -> TexturePlaces:
        """See `Placing.places`."""
        xy, jacobian = np.empty((z.size, 2)), np.empty((z.size, 4))
        if self.rotation != 1:
            back = np.complex64(self.rotation.conjugate())
            z, right, down = self.rotated_back(z), right * back, down * back
        points, across, below = (np.ascontiguousarray(part, np.complex128) for part in (z, right, down))
        _place(points, across, below, z.size, np.array(self.corner), xy, jacobian)
        return TexturePlaces(xy, jacobian, right, down)

    def rotated_back(self, z: Complex) -> Complex:
        """Rotate points of the source's plane back to where they would be if the picture were not rotated."""
        middle = (self.box[0] + self.box[1]) / 2
        return middle + (z - middle) * self.rotation.conjugate()
