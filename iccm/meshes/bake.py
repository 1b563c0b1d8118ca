"""A texture resampled into a mesh's own UV layout: every texel through its flat position back to the source's texture.

Where the inverse map is all but linear within a triangle (to `max_error` texels of the texture) it is interpolated
from the corners; elsewhere it is solved at each texel.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ..arrays import Complex, Index, Real
from ..errors import InputError
from ..maps.extended_inverse import ExtendedInverse, bends
from ..parallel import over_slices
from ..pixels.sampler import Places, Reader
from ..pixels.texture import Texture
from .flatten import Flattening
from .locate import Locator
from .rasterise import Raster, affine, open_edges, rasterise

MOST_TILES = 64  # a triangle larger than so many pictures is a mistake in the file
ROWS = 64
ROUNDED = 1e-6  # texels beyond the texture's edge that are still on it

Origins = tuple[
    Complex, Complex, Complex
]  # (p,) points of the source's plane, their derivatives by the output's x and y


@dataclass(frozen=True, eq=False)
class Plane:
    """Places in a texture that lies flat in the source's plane."""

    texture: Texture

    @property
    def scale(self) -> complex:
        """Texels a unit, right and up."""
        low, high = self.texture.box
        height, width = self.texture.pixels.shape[:2]
        return complex(width / (high - low).real, height / (high - low).imag)

    def texels(self, z: Complex, zx: Complex, zy: Complex, threads: int | None = None) -> Places:
        """Places of the points z, given their derivatives by the output's x and y."""
        origin = complex(self.texture.box[0].real, self.texture.box[1].imag)
        xy, turn = _placed(z, zx, zy, origin, self.scale)
        return Places(xy, turn, zx, zy)


@dataclass(frozen=True, eq=False)
class Surface:
    """Places in the texture of a mesh, whose flattening is the source's plane.

    Attributes:
        locator: of the flattening.
        corners: (m, 3, 2) texture coordinates of its triangles in texels, y down; beyond the texture it repeats.
        size: the texture's width and height in texels.
    """

    locator: Locator
    corners: Real
    size: tuple[int, int]

    @property
    def scale(self) -> complex:
        """Texels a unit: the square root of the ratio of areas."""
        at = self.locator.flat[self.locator.faces]
        flat = _areas(np.stack([at.real, at.imag], axis=-1)).sum()
        return complex(1, 1) * np.sqrt(_areas(self.corners).sum() / flat)

    def texels(self, z: Complex, zx: Complex, zy: Complex, threads: int | None = None) -> Places:
        """Places of the points z, given their derivatives by the output's x and y."""
        triangle, weights = self.locator(z, threads)
        place = np.einsum("pk,pkc->pc", weights, self.corners[triangle])
        beyond = (place < -ROUNDED) | (place > np.add(self.size, ROUNDED))
        place = np.where(beyond, np.mod(place, self.size), place)
        at = self.locator.flat[self.locator.faces[triangle]]
        e1, e2 = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
        area = (e1.conj() * e2).imag
        d1, d2 = (self.corners[triangle, k] - self.corners[triangle, 0] for k in (1, 2))
        turn = np.empty((z.size, 4))
        for k, step in enumerate((zx, zy)):
            s, t = (step.conj() * e2).imag / area, (e1.conj() * step).imag / area
            turn[:, k::2] = s[:, None] * d1 + t[:, None] * d2
        turned = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
        tangent = np.sign(turned) * (e1 * d2[:, 1] - e2 * d1[:, 1])  # where x grows and y does not
        steps = (step * tangent.conj() for step in (zx, zy))
        return Places(place, turn, *(np.where(turned > 0, step.conj(), step) for step in steps))

    @classmethod
    def of(cls, locator: Locator, uv: Real, size: tuple[int, int]) -> "Surface":
        """From (m, 3, 2) texture coordinates, v up; each triangle comes to where its middle is on the texture."""
        corners = np.stack([uv[..., 0], 1 - uv[..., 1]], axis=-1)
        return cls(locator, (corners - np.floor(corners.mean(axis=1, keepdims=True))) * size, size)


@dataclass(frozen=True, eq=False)
class Layout:
    """The texel grid of a mesh's UV charts.

    Attributes:
        corners: (m, 3, 2) texture coordinates of the triangles in texels, y down.
        raster: who owns which texel.
        report: charts, mirrored triangles, overlaps and what lies outside 0..1.
    """

    corners: Real
    raster: Raster
    report: dict

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        height, width = self.raster.owner.shape
        return height, width


def layout(name: str, uv: Real, uv_faces: Index, twin: Index, width: int, height: int) -> Layout:
    """Rasterise UV charts; what lies outside 0..1 comes in on the other side, as renderers repeat textures.

    Args:
        name: of the mesh, for messages.
        uv: (t, 2) texture coordinates, v up.
        uv_faces: (m, 3) coordinate of each triangle's corner.
        twin: (3m,) which half-edges lie on one edge (see `topology.Triangles`), to tell where charts end.
        width, height: texels.

    Raises:
        InputError: a corner without coordinates, or one that is not finite or absurdly far off.
    """
    at = check_layout(name, uv, uv_faces)
    corners = np.empty_like(at)
    corners[..., 0], corners[..., 1] = at[..., 0] * width, (1 - at[..., 1]) * height
    beyond = outside(at)
    raster = rasterise(corners, width, height, border=open_edges(uv_faces, twin), wrap=bool(beyond.any()))
    turn = _turns(corners)
    report = {
        "charts": int(np.count_nonzero(np.bincount(charts(uv_faces, len(uv))[uv_faces[:, 0]]))),
        "mirrored_triangles": int((turn > 0).sum()),  # y is down
        "flat_triangles": int((turn == 0).sum()),
        "outside_triangles": int(beyond.sum()),
        "overlapping_texels": raster.overlaps,
        "covered_texels": int(raster.centre.sum()),
    }
    return Layout(corners, raster, report)


def check_layout(name: str, uv: Real, uv_faces: Index) -> Real:
    """The texture coordinates (m, 3, 2) of the triangles' corners; arguments and errors as for `layout`."""
    if (uv_faces < 0).any():
        bad = int(np.flatnonzero((uv_faces < 0).any(axis=1))[0])
        raise InputError(
            f"{name}: triangle {bad} has no texture coordinates; leave out --bake to make new ones"
        )
    at = np.take(uv, uv_faces, axis=0)  # several times faster than uv[uv_faces]
    low, high = _over_corners(np.minimum, at), _over_corners(np.maximum, at)
    span = (high - low).max(initial=0.0)
    if not np.isfinite(span) or span * span > MOST_TILES or np.abs(low).max(initial=0.0) > 1e6:
        raise InputError(
            f"{name}: texture coordinates of a triangle are not finite or span {span:.3g} pictures"
        )
    return at


def bake(
    target: Flattening,
    grid: Layout,
    pull: ExtendedInverse,
    read: Reader,
    place: Plane | Surface,
    *,
    padding: int | None = None,
    max_error: float = 0.05,
    threads: int | None = None,
) -> tuple[NDArray, dict]:
    """The target's UV charts filled from the source's texture.

    Args:
        target: the flattened patch.
        grid: its UV layout, triangle for triangle.
        pull: from the target's plane to the source's.
        read: the texture to carry over.
        place: where points of the source's plane lie in it.
        padding: texels to spread colours past the charts' seams, -1 for all; a thirty-second of the picture by default,
            so that mip-maps down to 32 texels do not bleed.
        max_error: of places in the texture, in texels.
        threads: as many as there are processors by default.

    Returns:
        (h, w, c) pixels of the texture's type and channels, zero where nothing reaches, and a report.
    """
    source = _Source(target, grid, pull, abs(place.scale) / np.sqrt(2), max_error)
    out = np.zeros((*grid.shape, read.channels), read.dtype)

    def fill(rows: slice) -> None:
        at, origins = source.rows(rows)
        pixels = read(lambda part: place.texels(*origins(part), 1), at.size, 1)
        pixel = np.dtype(
            (np.void, pixels.itemsize * read.channels)
        )  # whole: several times faster than channels
        np.put(out[rows].reshape(-1, read.channels).view(pixel), at, pixels.view(pixel))

    over_slices(fill, grid.shape[0], threads, ROWS)
    reach = max(4, max(grid.shape) // 32) if padding is None else padding
    report = grid.report | {
        "exact_triangles": int(source.exact.sum()),
        "padding": reach,
        "outside_points": pull.outside,
        "outside_distance": pull.away / target.boundary.diagonal,
    }
    return padded(out, grid.raster.owner >= 0, reach), report


class _Source:
    """Where the texels of a layout come from in the source's plane."""

    def __init__(
        self, target: Flattening, grid: Layout, pull: ExtendedInverse, scale: float, max_error: float
    ):
        self.owner, self.pull, self.corners = grid.raster.owner, pull, grid.corners
        self.faces, self.w = target.patch.faces, target.flat
        z = pull(self.w)
        self.exact = bends(self.faces, self.w, *pull.slopes(z), pull.threads) * scale > max_error
        self.linear = affine(self.corners, z[self.faces], pull.threads)
        self.flat = affine(self.corners, self.w[self.faces], pull.threads) if self.exact.any() else None

    def rows(self, rows: slice) -> tuple[Index, Callable[[slice], Origins]]:
        """The covered texels of some rows, counted from their first, and where a slice of them comes from."""
        owner = self.owner[rows].ravel()
        at = np.flatnonzero(owner >= 0)
        own = owner[at]
        hard = np.flatnonzero(self.exact[own])
        solved = self._solved(own[hard], at[hard], rows.start) if hard.size else None

        def origins(part: slice) -> Origins:
            found = self._affine(self.linear, own[part], at[part], rows.start)
            if solved is not None:
                a, b = np.searchsorted(hard, [part.start, part.stop])
                for values, better in zip(found, solved):
                    values[hard[a:b] - part.start] = better[a:b]
            return found

        return at, origins

    def _affine(self, coefficients: Complex, own: NDArray, at: Index, first: int) -> Origins:
        z, zx, zy = (np.empty(at.size, complex) for _ in range(3))
        _evaluate(coefficients, self.corners, own, at, first, self.owner.shape, z, zx, zy)
        return z, zx, zy

    def _solved(self, own: NDArray, at: Index, first: int) -> Origins:
        """Where texels come from one by one; the linear steps stay where the map has no derivative."""
        assert self.flat is not None
        w, wx, wy = self._affine(self.flat, own, at, first)
        _, zx, zy = self._affine(self.linear, own, at, first)
        z = self.pull(_into(self.w[self.faces[own]], w))
        z_w, z_wbar = self.pull.slopes(z)
        good = np.isfinite(z_w)
        zx[good] = (z_w * wx + z_wbar * wx.conj())[good]
        zy[good] = (z_w * wy + z_wbar * wy.conj())[good]
        return z, zx, zy


def padded(pixels: NDArray, covered: NDArray[np.bool_], reach: int) -> NDArray:
    """The picture with colours spread `reach` texels (-1: everywhere) past what is covered, from the nearest texel."""
    if reach == 0 or covered.all() or not covered.any():
        return pixels
    import cv2

    away, label = cv2.distanceTransformWithLabels(
        (~covered).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    source = np.zeros(int(label.max()) + 1, np.int64)
    at = np.flatnonzero(covered)
    source[label.ravel()[at]] = at
    fill = np.flatnonzero(~covered & ((away <= reach) | (reach < 0)))
    flat = pixels.reshape(-1, pixels.shape[2])
    flat[fill] = flat[source[label.ravel()[fill]]]
    return pixels


@njit(cache=True, nogil=True)
def _evaluate(coefficients, corners, owner, at, first, shape, z, zx, zy):
    """An affine function a triangle at the texels they own, a texel that came in from the other side put back there."""
    height, width = shape
    for i in range(owner.size):
        t = owner[i]
        x = _beside(corners[t, 0, 0], corners[t, 1, 0], corners[t, 2, 0], at[i] % width + 0.5, width)
        y = _beside(
            corners[t, 0, 1], corners[t, 1, 1], corners[t, 2, 1], first + at[i] // width + 0.5, height
        )
        zx[i], zy[i] = coefficients[t, 1], coefficients[t, 2]
        z[i] = coefficients[t, 0] + zx[i] * x + zy[i] * y


@njit(cache=True, nogil=True)
def _beside(a, b, c, x, size):
    """The place x, moved by multiples of `size` unless it lies among three others or half a texel beside them."""
    low, high = min(a, b, c) - 0.5, max(a, b, c) + 0.5
    if x < low:
        x += size * np.ceil((low - x) / size)
    elif x > high:
        x -= size * np.ceil((x - high) / size)
    return x


@njit(cache=True, nogil=True)
def _placed(z, zx, zy, origin, scale):
    xy, turn = np.empty((z.size, 2)), np.empty((z.size, 4))
    sx, sy = scale.real, scale.imag
    for i in range(z.size):
        xy[i, 0], xy[i, 1] = (z[i].real - origin.real) * sx, (origin.imag - z[i].imag) * sy
        turn[i, 0], turn[i, 1] = zx[i].real * sx, zy[i].real * sx
        turn[i, 2], turn[i, 3] = -zx[i].imag * sy, -zy[i].imag * sy
    return xy, turn


def _into(triangle: Complex, w: Complex) -> Complex:
    """Points (p,) moved into their triangles (p, 3): texels that a chart's border only touches have centres outside."""
    a, b, c = triangle.T
    area = ((b - a).conj() * (c - a)).imag
    weights = np.stack([((q - p).conj() * (w - p)).imag / area for p, q in ((b, c), (c, a), (a, b))], axis=1)
    weights = np.maximum(weights, 0)
    return np.einsum("pk,pk->p", weights / weights.sum(axis=1, keepdims=True), triangle)


def outside(corners: Real) -> NDArray[np.bool_]:
    """(m,) which triangles of (m, 3, 2) texture coordinates leave 0..1."""
    low, high = _over_corners(np.minimum, corners), _over_corners(np.maximum, corners)
    return (np.minimum(low[:, 0], low[:, 1]) < -1e-9) | (np.maximum(high[:, 0], high[:, 1]) > 1 + 1e-9)


def _over_corners(function: np.ufunc, corners: Real) -> Real:
    """(m, 2) least or greatest coordinates of (m, 3, 2) corners; numpy's own reduction over three is slow."""
    return function(function(corners[:, 0], corners[:, 1]), corners[:, 2])


def _turns(corners: Real) -> Real:
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]


def _areas(corners: Real) -> Real:
    return 0.5 * np.abs(_turns(corners))


def charts(uv_faces: Index, count: int) -> Index:
    """(t,) the chart each of `count` texture coordinates belongs to, joined by the triangles (m, 3)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    a, b = np.repeat(uv_faces[:, 0], 2), uv_faces[:, 1:].ravel()
    graph = coo_matrix((np.ones(a.size, np.int8), (a, b)), shape=(count, count))
    return connected_components(graph, directed=False)[1]
