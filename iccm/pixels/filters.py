"""Read a picture with the footprint that a map gives each pixel: a mip pyramid and an anisotropic kernel.

A pixel's footprint in the texture is the ellipse of the Jacobian J = d(texel) / d(pixel). The kernel is k(u) k(v) with
(u, v) = S⁻¹ d, where S is the symmetric square root of J Jᵀ with no axis below one texel. So it is the usual separable
kernel where the texture is magnified, a wider one where a conformal map shrinks it, a sheared one under a
quasiconformal map, and it changes continuously between these. Wide kernels read a coarser level of the pyramid.

Negative lobes make a kernel sharp, but let it overshoot: a dark edge gets a darker ring. Colours are therefore clamped,
channel by channel, to the range of the texels that the kernel reads, which does not make edges less steep.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..native import Record, function
from .canvas import Band
from .colour import Float, byte_edges
from .pyramid import Pyramid
from .texture import Corner

_nearest = function(
    "int64_t iccm_pixels_nearest(const Pyramid *picture, const double *xy, int64_t count, float *out)"
)
_filter = function("""int64_t iccm_pixels_filter(
    const Pyramid *picture, const double *xy, const double *jacobian, int64_t count, int64_t kernel, bool clamped,
    float *out)""")
_spline = function("""int64_t iccm_pixels_spline(
    const float *coefficients, int64_t height, int64_t width, int64_t c, int64_t edge, const double *xy,
    const double *jacobian, int64_t count, float *out)""")
_paint = function("""int64_t iccm_pixels_paint(
    const Pyramid *picture, const Complex *z, const Complex64 *right, const Complex64 *down, const float *covered,
    int64_t rows, int64_t width, int64_t first, int64_t last, const double *corner, int64_t kernel, bool clamped,
    int64_t alpha, const double *edges, const uint8_t *start, uint8_t *out)""")
LANE_NUMBERS = 4  # numbers written at a time, possibly beyond the last pixel's channels
NEAREST, LINEAR, CUBIC, LANCZOS, SPLINE = 0, 1, 2, 3, 4
FILTERS = {"nearest": NEAREST, "linear": LINEAR, "cubic": CUBIC, "lanczos": LANCZOS, "spline": SPLINE}


def paint(
    tex: Pyramid,
    band: Band,
    columns: tuple[int, int],
    corner: Corner,
    kind: int,
    clamped: bool,
    alpha: int,
    out: NDArray[np.uint8],
) -> None:
    """Write sRGB bytes of the covered pixels of a band, in some of its columns.

    Args:
        tex: the picture.
        band: the pixels.
        columns: the first column, and the one after the last.
        corner: position of the picture's corner in the source's plane, and its scale, see `Texture.corner`.
        kind: one of FILTERS except NEAREST and SPLINE.
        clamped: whether to clamp each channel to the range of the texels that the kernel reads.
        alpha: index of the alpha channel; the number of channels if one is to be appended.
        out: (rows, width, c), or one channel more; written where pixels are covered.
    """
    z, covered = np.ascontiguousarray(band.z, np.complex128), np.ascontiguousarray(band.coverage, np.float32)
    right, down = (np.ascontiguousarray(slope, np.complex64) for slope in (band.right, band.down))

    def work(picture: Record, row: int) -> int:
        """Paint the rows of the band from this one on."""
        rows = (part[row:] for part in (z, right, down, covered))
        place = (len(z) - row, z.shape[1], *columns, np.array(corner))
        return _paint(picture, *rows, *place, kind, clamped, alpha, *byte_edges(), out[row:])

    tex.filtered(work)


def read(tex: Pyramid, xy: Real, jacobian: Real, kind: int, clamped: bool = False) -> Float:
    """Filter a picture at points.

    Args:
        tex: the picture.
        xy: (p, 2) texel coordinates, x right, y down, the first texel's centre at 0.5.
        jacobian: (p, 4) their derivatives by the output's x and y: dx/dx, dx/dy, dy/dx, dy/dy.
        kind: one of FILTERS.
        clamped: as for `paint`; ignored by NEAREST and SPLINE.

    Returns:
        (p, c) values.
    """
    c, count = tex.base.shape[2], len(xy)
    xy, jacobian = np.ascontiguousarray(xy, np.float64), np.ascontiguousarray(jacobian, np.float64)
    numbers = np.empty(count * c + LANE_NUMBERS, np.float32)
    out = numbers[:-LANE_NUMBERS].reshape(-1, c)
    kernel = CUBIC if kind == SPLINE else kind

    def work(picture: Record, first: int) -> int:
        """Filter the points from this one on."""
        points, count = xy[first:], len(xy) - first
        if kind == NEAREST:
            return _nearest(picture, points, count, out[first:])
        return _filter(picture, points, jacobian[first:], count, kernel, clamped, numbers[first * c :])

    tex.filtered(work)
    if kind == SPLINE and tex.spline.size:
        _spline(tex.spline, *tex.spline.shape, tex.edge, xy, jacobian, count, out)
    return out
