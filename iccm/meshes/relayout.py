"""Transfer textures from one UV layout of a surface to another, texel by texel, by position on the surface.

Triangles with the same corners in both meshes correspond; texels of triangles without a partner use the nearest
point.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Complex, Flags, Index, Real, complex_of, distinct_rows
from ..parallel import over_slices
from ..pixels.padding import pad_charts
from ..pixels.sampler import Sampler, put
from ..pixels.texture import REPEAT, TexturePlaces, Wrap, wrapped
from ..plane import triangle_areas
from ..progress import counted
from .charted import Charted
from .disk_patch import SAME_PLACE_SHARE
from .layout import SAME_PLACE, Layout, charts, check_layout, layout
from .locate import barycentric, in_basis
from .mesh import face_areas
from .surface import texels

POINTS_AT_ONCE = 5_000
"""Points that are located at a time; this takes 0.8 s on a busy machine for 82k triangles (measured)."""
TILE_GRID_CELLS = 1024  # across a grid on which overlaps of tiles are detected: the texels of a usual texture
PROBED_TEXELS_ACROSS = 128
"""Texels across a layout for choosing the size of pictures, which takes powers of two."""
COLOUR_TEXELS_ACROSS = 1024
"""Texels across a picture if charts are smaller than two texels, and so do not determine its size: that
of a usual texture.
"""
MOST_TEXELS_ACROSS = 1e60
"""Limit on computed texels across a layout, so that squares are finite; pictures have far fewer
(LARGEST_TEXELS_ACROSS).
"""
LARGEST_TEXELS_ACROSS = 4096  # texels across if no size is requested, unless the old texture has more
MOST_MAGNIFIED = 2
"""Largest width of pictures relative to the old texture with all of its repetitions, if no size is requested:
larger ones would show nothing more.
"""
LOST_UNSEEN = 1.1
"""Texels of the old texture per texel of a new picture up to which no loss of detail is visible."""
TEXELS_PER_REPETITION = 8
"""Texels of a new picture per repetition of the old texture below which it is hardly
recognizable.
"""
MEAN_COLOUR_TEXELS = 256
"""Texels across a picture that shows hardly more than mean colours of a texture. Its texels are expensive,
since their footprints in the texture are large.
"""
ROWS_AT_ONCE = 64  # rows of the layout that are filtered at a time, which bounds memory


class Conflicts(NamedTuple):
    """Texels of a new layout for which no picture can be correct.

    Attributes:
        texels: number of texels in several triangles that show different places of the old texture.
        wrapped: number of these that overlap only because parts outside of 0..1 wrap around.
    """

    texels: int
    wrapped: int


@dataclass(frozen=True, eq=False)
class Origin:
    """Positions of the texels of a new layout on the old mesh.

    Attributes:
        old, new: the meshes.
        grid: texels of the new layout.
        partner: (m,) triangle of the old mesh with the same corners, -1 if there is none.
        order: (m, 3) corner of the new triangle for each corner of the old one.
        slots: (h, w) row of the next two arrays for texels without a partner, -1 elsewhere.
        nearest: (k,) triangle of the old mesh nearest to each of these texels.
        weights: (k, 3) barycentric coordinates of the nearest point.
        distance: (k,) distance to it.
        wraps: whether parts outside of the grid wrap around.
    """

    old: Charted
    new: Charted
    grid: Layout
    partner: Index
    order: Index
    slots: NDArray[np.int64]
    nearest: Index
    weights: Real
    distance: Real
    wraps: bool = True

    @classmethod
    def of(
        cls,
        old: Charted,
        new: Charted,
        width: int,
        height: int,
        tile: complex | None = None,
        pairs: tuple[Index, Index] | None = None,
    ) -> "Origin":
        """Compute the positions for a new picture of a size.

        Args:
            old: the old mesh.
            new: the new mesh.
            width, height: size of the picture.
            tile: the tile of the new layout that it shows (see `layout.layout`); None for all in one.
            pairs: the result of `partners` for the meshes, if known.

        Raises:
            InputError: a layout cannot be rasterised, or read.
        """
        check_layout(old.name, old.uv, old.uv_faces, most=np.inf)
        grid = layout(new.name, new.uv, new.uv_faces, new.twin, width, height, tile)
        partner, order = pairs or partners(old, new)
        owner = grid.owners.owner
        lonely = (owner >= 0) & (_partners_of_owners(partner, owner) < 0)
        slots = np.full(owner.shape, -1, np.int64)
        slots[lonely] = np.arange(lonely.sum())
        rows, columns = np.nonzero(lonely)
        owners = owner[rows, columns]
        weights = _barycentric(grid.corners[owners], columns, rows, grid.shape, tile is None)
        nearest_points = nearest(old, _interpolate(new.points[new.faces[owners]], weights))
        return cls(old, new, grid, partner, order, slots, *nearest_points, wraps=tile is None)

    def far(self, limit: float) -> Flags:
        """Return (h, w) texels that are farther from the old mesh than `limit`."""
        is_far = np.zeros(self.slots.shape, bool)
        is_far[self.slots >= 0] = self.distance > limit
        return is_far

    def reached(self, limit: float) -> Flags:
        """Return (h, w) texels that are on the old mesh, or not farther from it than `limit`."""
        return (self.grid.owners.owner >= 0) & ~self.far(limit)

    @property
    def blank(self) -> tuple[float, float]:
        """Area in space of triangles whose new texture coordinates have no area, and area of all triangles."""
        areas = face_areas(self.new.points[self.new.faces])
        flat = triangle_areas(complex_of(self.new.uv[self.new.uv_faces])) == 0
        return float(areas[flat].sum()), float(areas.sum())

    def interpolate(self, values: Real, where: Flags) -> Real:
        """Interpolate values at the corners of the old triangles.

        Args:
            values: (n, 3, k) of the corners.
            where: (h, w) texels of the new layout, inside its charts.

        Returns:
            (p, k) values of these texels, row by row.
        """
        _, _, triangle, weights = self._on_old(*np.nonzero(where))
        return _interpolate(values[triangle], weights)

    def _on_old(self, rows: NDArray, columns: NDArray) -> tuple[NDArray, Real, NDArray, Real]:
        """Return where texels (p,) of the new layout lie on both meshes.

        Returns:
            (p,) triangles of the new mesh, (p, 3) barycentric coordinates there, and both on the old mesh.
        """
        new_triangles, slot = self.grid.owners.owner[rows, columns], self.slots[rows, columns]
        weights = _barycentric(self.grid.corners[new_triangles], columns, rows, self.grid.shape, self.wraps)
        lonely = slot >= 0
        triangle = np.where(
            lonely, self.nearest[slot] if self.nearest.size else 0, self.partner[new_triangles]
        )
        old_weights = np.take_along_axis(weights, self.order[new_triangles], axis=1)
        old_weights[lonely] = self.weights[slot[lonely]]
        return new_triangles, weights, triangle, old_weights

    def conflicts(self, textures: Index | None = None) -> "Conflicts":
        """Count texels in several triangles of the new layout that show different places of the old texture.

        Stacked charts that show the same place are fine: the picture is correct for all of them.

        Args:
            textures: (n,) number of the texture on each old triangle; None if all have the same one.
        """
        rows, columns = np.nonzero(self.grid.owners.shared)
        if not rows.size:
            return Conflicts(0, 0)
        first, last = self.grid.owners.owner[rows, columns], self.grid.owners.last[rows, columns]
        first_triangle, first_place = self._old_places(first, rows, columns)
        last_triangle, last_place = self._old_places(last, rows, columns)
        difference = first_place - last_place
        differ = (np.abs(difference - np.rint(difference)) > SAME_PLACE).any(axis=1)
        if textures is not None:
            differ |= textures[first_triangle] != textures[last_triangle]
        tiles = np.floor(self.new.uv[self.new.uv_faces].mean(axis=1))
        wrapped = differ & (tiles[first] != tiles[last]).any(axis=1) & self.wraps
        return Conflicts(int(differ.sum()), int(wrapped.sum()))

    def _old_places(self, new_triangles: NDArray, rows: Index, columns: Index) -> tuple[Index, Real]:
        """Return (p,) old triangles and (p, 2) old texture coordinates of texels, according to given new triangles."""
        weights = _barycentric(self.grid.corners[new_triangles], columns, rows, self.grid.shape, self.wraps)
        triangle = self.partner[new_triangles].copy()
        old_weights = np.take_along_axis(weights, self.order[new_triangles], axis=1)
        lonely = triangle < 0
        points = _interpolate(self.new.points[self.new.faces[new_triangles[lonely]]], weights[lonely])
        triangle[lonely], old_weights[lonely], _ = nearest(self.old, points)
        return triangle, _interpolate(self.old.uv[self.old.uv_faces[triangle]], old_weights)

    @property
    def repeating_triangles(self) -> int:
        """Number of triangles of the new layout that are larger than the picture, so that they would repeat it."""
        corners = self.new.uv[self.new.uv_faces]
        spans = corners.max(axis=1) - corners.min(axis=1)
        flat = triangle_areas(complex_of(corners)) == 0
        return int(((spans > 1 + SAME_PLACE_SHARE).any(axis=1) & ~flat).sum()) if self.wraps else 0

    def over(self, old: Charted) -> "Origin":
        """Return the same positions with other texture coordinates of the old mesh."""
        return self if old is self.old else replace(self, old=old)

    @cached_property
    def triangles(self) -> Index:
        """(h, w) triangle of the old mesh for each texel, -1 outside of the new layout's charts."""
        owner = self.grid.owners.owner
        triangles = _partners_of_owners(self.partner, owner)
        triangles[self.slots >= 0] = self.nearest[self.slots[self.slots >= 0]]
        return triangles

    def places(
        self,
        rows: NDArray,
        columns: NDArray,
        size: tuple[int, int],
        tiles: Box | None = None,
        wrap: Wrap = REPEAT,
    ) -> TexturePlaces:
        """Return positions of texels (p,) of the new layout in a texture of the old one.

        Args:
            rows, columns: (p,) of the texels.
            size: width and height of the texture.
            tiles: box of the old layout that it covers; None for 0..1.
            wrap: how it continues beyond 0..1.
        """
        new_triangles, weights, triangle, old_weights = self._on_old(rows, columns)
        corners = texels(self.old.uv[self.old.uv_faces[triangle]], size, tiles, wrap)
        steps = self._steps(new_triangles)
        jacobian = np.empty((new_triangles.size, 4))
        edges = self.old.points[self.old.faces[triangle]]
        d = corners[:, 1:] - corners[:, :1]
        for k, step in enumerate(steps):
            jacobian[:, k::2] = np.einsum("pk,pkc->pc", in_basis(edges[:, 1:] - edges[:, :1], step), d)
        places = TexturePlaces(
            _interpolate(corners, old_weights),
            jacobian,
            *self._directions(new_triangles, weights, triangle, old_weights),
        )
        return wrapped(places, size, wrap) if tiles is None else places

    def _steps(self, triangles: Index) -> tuple[Real, Real]:
        """Return (p, 3) derivatives of the position in space with respect to the new layout's x and y."""
        corners, points = self.grid.corners[triangles], self.new.points[self.new.faces[triangles]]
        (ax, ay), (bx, by) = ((corners[:, k] - corners[:, 0]).T for k in (1, 2))
        e, f, area = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0], ax * by - ay * bx
        area = np.where(area == 0, 1.0, area)[:, None]
        return (e * by[:, None] - f * ay[:, None]) / area, (f * ax[:, None] - e * bx[:, None]) / area

    def _directions(
        self, new_triangles: Index, new_weights: Real, old_triangles: Index, old_weights: Real
    ) -> tuple[Complex, Complex]:
        """Return (p,) the new layout's tangent and its downward bitangent, in the old layout's frame.

        The real part is along the old tangent, the imaginary part along the old bitangent.
        """
        _, tangent, bitangent = _frame(self.new, new_triangles, new_weights)
        _, old_tangent, old_bitangent = _frame(self.old, old_triangles, old_weights)

        def in_old_frame(vectors: Real) -> Complex:
            x = np.einsum("pi,pi->p", vectors, old_tangent)
            return np.asarray(x + 1j * np.einsum("pi,pi->p", vectors, old_bitangent))

        return in_old_frame(tangent), in_old_frame(-bitangent)


def texels_across(
    probe: Origin, where: Flags, size: tuple[int, int], tiles: Box | None = None, wrap: Wrap = REPEAT
) -> int:
    """Return the width in texels of a square picture of the new layout that shows all detail of an old texture.

    It is the density of the texture's texels along the surface where it is highest, as a root mean square over
    the layout: texels of a triangle count by its area there.

    Args:
        probe: positions in both layouts, at any resolution.
        where: (h, w) texels that show the texture; the result is 0 if there are none.
        size: width and height of the texture.
        tiles, wrap: as for `Origin.places`.
    """
    rows, columns = np.nonzero(where)
    if not rows.size:
        return 0
    height, width = probe.grid.shape
    jacobian = probe.places(rows, columns, size, tiles, wrap).jacobian * (width, height, width, height)
    jacobian = np.clip(jacobian, -MOST_TEXELS_ACROSS, MOST_TEXELS_ACROSS)
    square = np.sum(jacobian * jacobian, axis=1)
    area = jacobian[:, 0] * jacobian[:, 3] - jacobian[:, 1] * jacobian[:, 2]
    # squares of the larger singular values
    most = (square + np.sqrt(np.maximum(square * square - 4 * area * area, 0))) / 2
    most[_are_spots(probe.old, probe.triangles[rows, columns], size, tiles)] = COLOUR_TEXELS_ACROSS**2
    owners = probe.grid.owners.owner[rows, columns]
    areas = np.maximum(np.abs(triangle_areas(complex_of(probe.grid.corners[owners]))), 1e-300)
    mean = np.average(most, weights=areas / np.bincount(owners)[owners])
    return int(np.ceil(np.sqrt(mean) - 1e-6))


@dataclass(frozen=True)
class TextureUse:
    """How an old layout uses a texture.

    Attributes:
        size: width and height of the texture.
        repetitions: how often the layout repeats it in one direction: the root of the triangles' area in
            pictures.
        spots: whether some charts are smaller than two texels, such as those of palettes.
    """

    size: tuple[int, int]
    repetitions: float = 1.0
    spots: bool = False

    @classmethod
    def measure(
        cls, old: Charted, triangles: Index, size: tuple[int, int], tiles: Box | None = None
    ) -> "TextureUse":
        """Measure how some triangles of an old layout use its texture.

        `tiles` is as for `Origin.places`.
        """
        extent = _extent(tiles)
        areas = np.abs(triangle_areas(complex_of(old.uv[old.uv_faces[triangles]])))
        repetitions = float(np.sqrt(areas.sum() / (extent.real * extent.imag)))
        return cls(size, max(repetitions, 1.0), bool(_are_spots(old, triangles, size, tiles).any()))

    @property
    def most_texels_across(self) -> int:
        """Largest width of pictures of it if no size is requested."""
        doubled = 2 ** int(np.log2(MOST_MAGNIFIED * max(self.size) * self.repetitions))
        largest = max(doubled, COLOUR_TEXELS_ACROSS) if self.spots else doubled
        return max(min(LARGEST_TEXELS_ACROSS, largest), _power_of_two(max(self.size)))


def picture_side(
    probe: Origin, where: Flags, size: tuple[int, int], tiles: Box | None = None, wrap: Wrap = REPEAT
) -> tuple[int, str]:
    """Return the side of a square picture of the new layout if no size is requested, and a note if it loses detail.

    Args:
        probe: positions in both layouts, at any resolution.
        where: (h, w) texels that show the texture; the side is 0 if there are none.
        size: width and height of the texture.
        tiles, wrap: as for `Origin.places`.
    """
    across = texels_across(probe, where, size, tiles, wrap)
    use = TextureUse.measure(probe.old, np.unique(probe.triangles[where]), size, tiles)
    side = limited(across, use)
    return side, too_small(across, side, use) if across > LOST_UNSEEN * side else ""


def limited(across: int, use: TextureUse) -> int:
    """Return the width of a picture if no size is requested.

    It is a power of two, which game engines and graphics hardware prefer, and at most `most_texels_across`. A
    texture that repeats so often that its repetitions could not be recognized gets a small picture.

    Args:
        across: texels that would show all detail; 0 if the texture is not shown.
        use: how the old layout uses the texture.
    """
    if across <= 0:
        return 0
    largest = use.most_texels_across
    if across * TEXELS_PER_REPETITION > largest * max(use.size):
        return min(MEAN_COLOUR_TEXELS, largest)
    return min(_power_of_two(across / LOST_UNSEEN), largest)


def _power_of_two(least: float) -> int:
    """Return the smallest power of two that is not less than `least`."""
    return 2 ** int(np.ceil(np.log2(max(least, 1.0)) - 1e-9))


def too_small(across: int, actual: int, use: TextureUse) -> str:
    """Return a note for pictures with fewer texels across than `texels_across` returns.

    Args:
        across: texels that would show all detail.
        actual: texels that the pictures have.
        use: how the old layout uses the texture.
    """
    width, height = use.size
    if across * TEXELS_PER_REPETITION > use.most_texels_across * max(use.size):
        return (
            f"a texture of {width}×{height} texels repeats about {across // max(use.size):.6g} times across the new "
            f"layout; pictures {actual} texels wide show only its mean colors"
        )
    return f"pictures {actual} texels wide lose detail of the old textures; use --size {across} to keep all of it"


def _extent(tiles: Box | None) -> complex:
    """Return width and height of the part of a layout that a texture covers, as width + i height."""
    return 1 + 1j if tiles is None else tiles[1] - tiles[0]


def _are_spots(old: Charted, triangles: Index, size: tuple[int, int], tiles: Box | None) -> Flags:
    """Return (p,) whether triangles belong to charts of less than two texels both ways."""
    extent = _extent(tiles)
    spots: Flags = np.all(_extents(old)[triangles] * size < (2 * extent.real, 2 * extent.imag), axis=1)
    return spots


def _extents(old: Charted) -> Real:
    """Return (m, 2) width and height of the chart of each triangle."""
    corners = distinct_rows(old.uv)[1][old.uv_faces]
    chart = charts(corners, len(old.uv))[corners]
    low, high = np.full((len(old.uv), 2), np.inf), np.full((len(old.uv), 2), -np.inf)
    np.minimum.at(low, chart, old.uv[old.uv_faces])
    np.maximum.at(high, chart, old.uv[old.uv_faces])
    return (high - low)[chart[:, 0]]


def _frame(mesh: Charted, triangle: Index, weights: Real) -> tuple[Real, Real, Real]:
    """Return (p, 3) normal, tangent and upward bitangent at points of triangles."""
    normal, tangent = (_interpolate(corner[triangle], weights) for corner in mesh.frames)
    return normal, tangent, np.cross(normal, tangent) * mesh.hands[triangle, None]


def carry(
    origin: Origin,
    sampler: Sampler,
    limit: float,
    *,
    tiles: Box | None = None,
    wrap: Wrap = REPEAT,
    padding: int | None = None,
    threads: int | None = None,
) -> NDArray:
    """Return (h, w, c) pixels of the new layout from a texture of the old one; 0 where the old mesh is too far.

    Args:
        origin: positions of the texels.
        sampler: the texture.
        limit: largest distance from the old mesh.
        tiles, wrap: as for `Origin.places`.
        padding: see `pixels.padding.pad_charts`.
        threads: number of threads; by default one per processor.
    """
    reached = origin.reached(limit)
    out = np.zeros((*origin.grid.shape, sampler.channels), sampler.dtype)
    paint(out, origin, sampler, reached, tiles=tiles, wrap=wrap, threads=threads)
    pad_charts(out, reached, padding, sampler.kind)
    return out


def paint(
    out: NDArray,
    origin: Origin,
    sampler: Sampler,
    where: Flags,
    *,
    tiles: Box | None = None,
    wrap: Wrap = REPEAT,
    threads: int | None = None,
) -> None:
    """Fill the marked texels (h, w) of a picture (h, w, c) of the new layout; arguments as for `carry`."""
    height, width, _ = sampler.texture.pixels.shape

    def fill(part: slice) -> None:
        rows, columns = np.nonzero(where[part])
        pixels = sampler(
            lambda some: origin.places(rows[some] + part.start, columns[some], (width, height), tiles, wrap),
            rows.size,
            1,
        )
        put(out[part].reshape(-1, sampler.channels), rows * out.shape[1] + columns, pixels)

    for mesh in (origin.old, origin.new):  # computed once, not in every thread
        _ = mesh.frames, mesh.hands
    over_slices(fill, len(out), threads, ROWS_AT_ONCE)


def partners(old: Charted, new: Charted) -> tuple[Index, Index]:
    """Match the triangles of two meshes by their corners.

    Returns:
        (m,) the old triangle with the same corners as each new one, -1 if there is none, and (m, 3) their
        order.
    """
    from scipy.spatial import cKDTree

    first, point_of = distinct_rows(old.points)
    distances, nearest_points = cKDTree(old.points[first]).query(
        new.points, distance_upper_bound=SAME_PLACE_SHARE * max(old.diagonal, 1e-300)
    )
    old_corners = point_of[old.faces]
    new_corners = np.where(np.isfinite(distances), nearest_points, -1)[new.faces]
    rank_old, rank = np.argsort(old_corners, axis=1), np.argsort(new_corners, axis=1)
    keys, key = (np.take_along_axis(v, r, axis=1) for v, r in ((old_corners, rank_old), (new_corners, rank)))
    first, label = distinct_rows(np.concatenate([keys, key]))
    partner = np.where(
        (key >= 0).all(axis=1) & (first < len(keys))[label[len(keys) :]], first[label[len(keys) :]], -1
    )
    if len(old_corners) == len(new_corners):
        # faces of the same file: coinciding triangles are matched by number
        partner = np.where((keys == key).all(axis=1), np.arange(len(new_corners)), partner)
    order = np.empty_like(rank)
    np.put_along_axis(order, rank_old[partner], rank, axis=1)
    return partner, order


def overlap_in_one_picture(sheet: Charted, tiles: Index) -> bool:
    """Return whether triangles of different tiles overlap if one picture shows all tiles.

    Args:
        sheet: the triangles.
        tiles: (m,) number of each triangle's tile.
    """
    size = TILE_GRID_CELLS
    owners = layout(sheet.name, sheet.uv, sheet.uv_faces, sheet.twin, size, size).owners
    return bool((tiles[owners.owner[owners.shared]] != tiles[owners.last[owners.shared]]).any())


def nearest(old: Charted, points: Real) -> tuple[Index, Real, Real]:
    """Return the triangle of the old mesh nearest to each point.

    Further results are the barycentric coordinates of the nearest point, and the distance.
    """
    if not len(points):
        return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)
    import igl

    tree, mesh = igl.AABB(), (old.points, np.ascontiguousarray(old.faces))
    tree.init(*mesh)
    parts = [  # each call blocks all threads and signals
        tree.squared_distance(*mesh, np.ascontiguousarray(points[k : k + POINTS_AT_ONCE]))
        for k in counted("nearest points", range(0, len(points), POINTS_AT_ONCE))
    ]
    squared, triangle, closest = (np.concatenate(arrays) for arrays in zip(*parts))
    return triangle, barycentric(old.points[old.faces[triangle]], closest), np.sqrt(squared)


def _interpolate(corners: Real, weights: Real) -> Real:
    """Return (p, c) points of triangles (p, 3, c)."""
    return np.einsum("pk,pkc->pc", weights, corners)


def _partners_of_owners(partner: Index, owner: NDArray) -> Index:
    """Return (h, w) partners of the owners (h, w) of texels, -1 if there is none."""
    result, inside = np.full(owner.shape, -1), owner >= 0
    result[inside] = partner[owner[inside]]
    return result


def _barycentric(corners: Real, columns: NDArray, rows: NDArray, shape: tuple[int, int], wraps: bool) -> Real:
    """Return (p, 3) barycentric coordinates of texel centres in triangles (p, 3, 2).

    Centres of texels that a chart's border only touches are moved into the triangle.
    """
    height, width = shape
    centers = np.column_stack([columns + 0.5, rows + 0.5])
    if wraps:
        # move centres that wrapped around by whole pictures, back to within half a texel of their triangles
        low, high, size = corners.min(axis=1) - 0.5, corners.max(axis=1) + 0.5, np.array([width, height])
        centers += size * (
            np.ceil(np.maximum(low - centers, 0) / size) - np.ceil(np.maximum(centers - high, 0) / size)
        )
    (ax, ay), (bx, by) = ((corners[:, k] - corners[:, 0]).T for k in (1, 2))
    px, py = (centers - corners[:, 0]).T
    area = ax * by - ay * bx
    area = np.where(area == 0, 1.0, area)
    s, t = (px * by - py * bx) / area, (ax * py - ay * px) / area
    weights = np.maximum(np.column_stack([1 - s - t, s, t]), 0)
    return weights / weights.sum(axis=1, keepdims=True)
