"""Texture transfer between shapes with arrays: `transfer` solves and warps, `warp` only warps.

`stmap` converts a map to a picture of coordinates, `from_stmap` such a picture to a map.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import solve
from .arrays import Box, Complex, as_complex
from .axes import Axes
from .blas import on_one_thread
from .errors import InputError
from .maps.triangulated.map import TriangulatedMap
from .options import OptionValues
from .pixels import stmap as stmaps
from .pixels import warp as warping
from .pixels.canvas import LONGER_SIDE_PIXELS, Canvas, Diagnostics, proportional
from .pixels.sampler import Sampler
from .pixels.texture import Texture
from .progress import Progress
from .result import Fit, refuse_other_results
from .solve import Outline, Points
from .transform import Transform

FilterName = Literal["auto", "nearest", "linear", "cubic", "lanczos", "spline"]
KindName = Literal["colour", "data", "normal", "normal-down"]
EdgeName = Literal["clamp", "transparent", "repeat", "mirror"]
EncodingName = Literal["srgb", "linear"]
TYPES = (np.uint8, np.uint16, np.float16, np.float32)


class FitOptions(OptionValues, total=False):
    """Keyword arguments of `iccm.fit`, for type checkers."""

    pins: Points | None
    strokes: Sequence[tuple[Points, Points]] | None
    source_holes: Sequence[Outline]
    target_holes: Sequence[Outline]
    hole_partners: Sequence[tuple[int, int]]
    rigid: Sequence[Outline]
    rigid_target: Sequence[Outline]
    importance: Any
    size_map: Any
    start: Fit | TriangulatedMap | None
    choices: Sequence[Any] | None
    detail: Any
    opaque: bool
    free_gaps: bool
    axes: Axes
    progress: Callable[[Progress], object] | None
    cancel: Callable[[], bool] | None


@dataclass(frozen=True, eq=False)
class Transfer:
    """A texture on the target.

    Attributes:
        pixels: (height, width, c) of the texture's type, row 0 on top. The last channel is straight alpha: the
            texture's alpha times the coverage of each pixel, or the coverage if the texture has no alpha.
        box: lower left and upper right corner of the picture, in the target's plane.
        fit: the map, the status of the solver, and figures about its quality.
        diagnostics: numbers of pixels that were inside, at the edge, and solved one by one.
    """

    pixels: NDArray
    box: Box
    fit: Fit
    diagnostics: Diagnostics

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the picture, as for `extent` of `matplotlib.pyplot.imshow`."""
        low, high = self.box
        return low.real, high.real, low.imag, high.imag

    def _repr_png_(self) -> bytes:
        """Return the picture as PNG, for notebooks."""
        from .pixels.thumbnail import png

        return png(self.pixels)

    def __repr__(self) -> str:
        return f"<Transfer: {'×'.join(map(str, self.pixels.shape))} {self.pixels.dtype}, {self.fit!r}>"


@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """How to render a texture into a picture: the options that `transfer` and `warp` have in common.

    Attributes are the arguments of `transfer` with the same names.
    """

    size: int | tuple[int, int] = LONGER_SIDE_PIXELS
    texture_box: Box | None = None
    target_box: Box | None = None
    filter: FilterName = "auto"
    kind: KindName = "colour"
    edge: EdgeName = "clamp"
    encoding: EncodingName | None = None
    padding: int = 0
    threads: int | None = None

    def sampler(self, texture: ArrayLike, box: Box, outlines: Sequence[Complex]) -> Sampler:
        """Prepare a texture for filtering.

        Args:
            texture: its pixels, as for `transfer`.
            box: its box in the source's plane, unless `texture_box` is given.
            outlines: of the source and its holes, see `Sampler`.
        """
        pixels = _pixels(texture)
        encoding = self.encoding or ("linear" if pixels.dtype.kind == "f" else "srgb")
        if encoding not in ("srgb", "linear"):
            raise InputError(f"encoding {encoding!r}: must be srgb or linear")
        alpha = pixels.shape[2] - 1 if pixels.shape[2] in (2, 4) else -1
        placed = Texture(pixels, _box(self.texture_box or box, "texture_box"), alpha, encoding)
        return Sampler(placed, self.filter, self.kind, self.edge, outlines=outlines, threads=self.threads)

    def check(self, texture: ArrayLike) -> None:
        """Check a texture and the options before a map is solved.

        Raises:
            InputError: as for `transfer`.
        """
        anywhere = 0j, 1 + 1j
        self.sampler(_pixels(texture)[:1, :1], anywhere, ())
        self.canvas(anywhere)

    def canvas(self, box: Box) -> Canvas:
        """Return the raster of the picture, which shows a box of the target's plane unless `target_box` is given."""
        return _canvas(self.size, self.target_box or box)

    def carry_through(self, fit: Fit, texture: ArrayLike) -> Transfer:
        """Warp a texture through a given map, by default from all of its source to all of its target."""
        outlines = [loop.z for loop in (fit.source, *fit.source_holes)]
        source_box, target_box = fit._boxes
        return self.carry(fit, self.sampler(texture, source_box, outlines), self.canvas(target_box))

    def carry(self, fit: Fit, sampler: Sampler, canvas: Canvas) -> Transfer:
        """Warp a texture through a map."""
        work = warping.Warp(fit._visible_map, sampler, canvas)
        warped = warping.whole(work, padding=self.padding, threads=self.threads)
        return Transfer(warped.pixels, canvas.box, fit, warped.diagnostics)


@on_one_thread
def transfer(
    texture: ArrayLike,
    source: Outline,
    target: Outline = None,
    *,
    size: int | tuple[int, int] = LONGER_SIDE_PIXELS,
    texture_box: Box | None = None,
    target_box: Box | None = None,
    filter: FilterName = "auto",
    kind: KindName = "colour",
    edge: EdgeName = "clamp",
    encoding: EncodingName | None = None,
    padding: int = 0,
    threads: int | None = None,
    **options: Unpack[FitOptions],
) -> Transfer:
    """Transfer a texture from one shape to another.

    Args:
        texture: (h, w) or (h, w, c) pixels, row 0 on top: uint8, uint16, float16, float32, float64 (converted to
            float32), bool, or other integers from 0 to 65535. With two or four channels the last one is straight alpha.
        source: a shape, as for `fit`.
        target: another shape.
        size: longer side of the result in pixels, or its width and height.
        texture_box: lower left and upper right corner of the texture in the source's plane; by default the source's
            bounding box.
        target_box: lower left and upper right corner of the result in the target's plane; by default the target's
            bounding box. It is extended about its centre to the proportions of width and height.
        filter: "nearest", "linear", "cubic", "lanczos", "spline", or "auto" (cubic).
        kind: "colour" (filtered in linear light), "data" (numbers), or "normal" and "normal-down" (tangent-space
            normals with y up or down, which are rotated with the map).
        edge: beyond the texture, repeat its last texels ("clamp"), show nothing ("transparent"), or repeat the texture
            ("repeat", or mirrored each time: "mirror").
        encoding: encoding of the colours, "srgb" or "linear"; by default srgb for integers and linear for floats.
        padding: number of pixels by which colours extend beyond the outline, where alpha is 0; -1 for all.
        threads: number of threads, by default one per processor; it does not change the result.
        **options: pins, strokes and all other options of `iccm.fit`.

    Raises:
        InputError: as for `iccm.fit`; pixels of another type or shape; a size or a box without area; an unknown
            filter, kind, edge or encoding; or normals without three channels.

    Examples:
        >>> import iccm
        >>> square = np.array([0, 1, 1 + 1j, 1j])
        >>> carried = iccm.transfer(iccm.checkerboard(64), square, 2 * square.real + 1j * square.imag, size=32)
        >>> carried.pixels.shape, carried.fit.status.ok
        ((16, 32, 4), True)
    """
    if isinstance(texture, Fit) or target is None:
        raise InputError(
            "transfer: takes a texture and two shapes; to use an existing map, call iccm.warp(fit, texture)"
        )
    solve.refuse_unknown(transfer, options, passed_to=solve.fit)
    picture = PictureOptions(
        size=size,
        texture_box=texture_box,
        target_box=target_box,
        filter=filter,
        kind=kind,
        edge=edge,
        encoding=encoding,
        padding=padding,
        threads=threads,
    )
    picture.check(texture)  # before a map is solved
    return picture.carry_through(solve.fit(source, target, **options), texture)


@on_one_thread
def warp(
    fit: Fit,
    texture: ArrayLike,
    *,
    size: int | tuple[int, int] = LONGER_SIDE_PIXELS,
    texture_box: Box | None = None,
    target_box: Box | None = None,
    filter: FilterName = "auto",
    kind: KindName = "colour",
    edge: EdgeName = "clamp",
    encoding: EncodingName | None = None,
    padding: int = 0,
    threads: int | None = None,
) -> Transfer:
    """Warp a texture through a map from `iccm.fit` or `iccm.deform`.

    Arguments and errors are those of `transfer`. By default the picture of a deformation shows the bounding box of the
    deformed shape.

    >>> import iccm
    >>> square = np.array([0, 1, 1 + 1j, 1j])
    >>> iccm.warp(iccm.fit(square, 3 * square), iccm.checkerboard(64), size=(16, 8)).box
    ((-1.5+0j), (4.5+3j))
    """
    refuse_other_results(fit, "warp")
    picture = PictureOptions(
        size=size,
        texture_box=texture_box,
        target_box=target_box,
        filter=filter,
        kind=kind,
        edge=edge,
        encoding=encoding,
        padding=padding,
        threads=threads,
    )
    return picture.carry_through(fit, texture)


@on_one_thread
def stmap(
    fit: Fit,
    *,
    size: int | tuple[int, int] = LONGER_SIDE_PIXELS,
    texture_box: Box | None = None,
    target_box: Box | None = None,
    threads: int | None = None,
) -> NDArray[np.float32]:
    """Return the map as an STMap: a picture that contains, for each pixel, its position in the texture.

    Arguments and errors are those of `warp`.

    Returns:
        (h, w, 4) s from 0 at the texture's left to 1 at its right, t from 0 at its bottom to 1 at its top, 0,
        and the coverage of the pixel; row 0 on top. `iccm.io.pictures.stmap_files.write_whole` writes it.

    >>> import numpy as np, iccm
    >>> square = np.array([0, 1, 1 + 1j, 1j])
    >>> st = iccm.stmap(iccm.fit(square, 3 * square), size=64)
    >>> back = iccm.from_stmap(st, texture_box=(0, 1 + 1j), target_box=(0, 3 + 3j))
    >>> complex(np.round(back(0.5 + 0.25j), 3))
    (1.5+0.75j)
    """
    refuse_other_results(fit, "stmap")
    boxes = fit._boxes
    canvas = _canvas(size, target_box or boxes[1])
    box = _box(texture_box or boxes[0], "texture_box")
    return np.concatenate(list(stmaps.stmap(fit._visible_map, box, canvas, threads=threads)))


def from_stmap(st: ArrayLike, *, texture_box: Box = (0j, 1 + 1j), target_box: Box | None = None) -> Transform:
    """Return the map that an STMap contains, with its inverse.

    It is accurate to a pixel at the outline, and far better inside.

    Args:
        st: (h, w, c) s, t and, in the fourth channel if there is one, coverage; without coverage, pixels with s
            = t = 0 are empty. About 1 kB of memory per pixel is needed. The map may be mirrored, and may have
            several parts.
        texture_box: lower left and upper right corner of the texture in the source's plane.
        target_box: corners of the picture in the target's plane, by default in pixels from the lower left
            corner; extended as for `transfer`.

    Raises:
        InputError: an array of another shape, no pixels with coordinates, or a box without area.

    >>> import iccm
    >>> st = np.stack(np.meshgrid((np.arange(64) + 0.5) / 64, (63.5 - np.arange(64)) / 64), axis=-1)
    >>> complex(np.round(iccm.from_stmap(st)(0.25 + 0.5j), 3))
    (16+32j)
    """
    stored = np.asarray(st)
    if stored.ndim != 3 or stored.shape[2] < 2 or stored.dtype.kind != "f":
        raise InputError(
            f"stmap: has shape {stored.shape} and type {stored.dtype}; pass floats of shape (h, w, 2) or "
            "with more channels"
        )
    height, width = stored.shape[:2]
    canvas = _canvas((width, height), target_box or (0j, complex(width, height)))
    return stmaps.transform(stored, _box(texture_box, "texture_box"), canvas)


def _pixels(texture: ArrayLike) -> NDArray:
    """Return pixels (h, w, c) of one of TYPES."""
    pixels = _of_usual_type(np.ascontiguousarray(texture))
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    if pixels.ndim != 3 or not pixels.size:
        raise InputError(f"texture: has shape {pixels.shape}; pass an array of shape (h, w) or (h, w, c)")
    return pixels


def _of_usual_type(pixels: NDArray) -> NDArray:
    """Convert pixels to one of TYPES: float64 to float32, bool to black and white, other integers by their range."""
    if pixels.dtype.type in TYPES:
        return pixels
    if pixels.dtype == np.float64:
        return pixels.astype(np.float32)
    if pixels.dtype == bool:
        return np.where(pixels, np.uint8(255), np.uint8(0))
    if pixels.dtype.kind in "iu" and pixels.size:
        low, high = int(pixels.min()), int(pixels.max())
        for kind in (np.uint8, np.uint16):
            if low >= 0 and high <= np.iinfo(kind).max:
                return pixels.astype(kind)
        raise InputError(
            f"texture: {pixels.dtype} pixels from {low} to {high}; scale them to 0..65535, or to floats of 0..1: "
            "(t - t.min()) / (t.max() - t.min())"
        )
    names = ", ".join(kind.__name__ for kind in TYPES)
    raise InputError(f"texture: has type {pixels.dtype}; use {names}, float64, bool or integers")


def _canvas(size: int | tuple[int, int], box: Box) -> Canvas:
    """Return a raster of the given size, or longer side, that shows a box."""
    low, high = box = _box(box, "target_box")
    sides = np.atleast_1d(size)
    if sides.dtype.kind not in "iu" or sides.shape not in ((1,), (2,)) or sides.min() < 1:
        raise InputError(f"size: {size!r} is not valid; give a number of pixels, or width and height")
    width, height = sides.tolist() if sides.size == 2 else proportional(int(sides[0]), high - low)
    return Canvas.about(width, height, box)


def _box(box: Box, name: str) -> Box:
    corners = as_complex(box, name)
    if corners.shape != (2,) or not (np.isfinite(corners).all() and _ahead(corners[1] - corners[0])):
        raise InputError(
            f"{name}: {box!r} is not a box; give its lower left and upper right corner as x + iy"
        )
    return complex(corners[0]), complex(corners[1])


def _ahead(step: complex) -> bool:
    return step.real > 0 and step.imag > 0
